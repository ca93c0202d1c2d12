// The scenario that every client runs, against the server at GRAMIAN_URL.
import assert from "node:assert/strict";

import {
    CloudsApi,
    Configuration,
    GeometryApi,
    KernelFamily,
    OperatorsApi,
    PosteriorQuantity,
    ResponseError,
    ValuesApi,
    type Kernel,
    type Problem,
} from "gramian";

// Eight points of the unit circle.
const points = [
    [1, 0],
    [0.70710678, 0.70710678],
    [0, 1],
    [-0.70710678, 0.70710678],
    [-1, 0],
    [-0.70710678, -0.70710678],
    [0, -1],
    [0.70710678, -0.70710678],
];
const cosines = points.map(([x = NaN]) => x);
const gauss: Kernel = { family: KernelFamily.Gauss, lengthScale: 2 };

const configuration = new Configuration({ basePath: process.env.GRAMIAN_URL ?? "http://localhost:8080" });
const clouds = new CloudsApi(configuration);
const geometry = new GeometryApi(configuration);
const { cloudId } = await clouds.createCloud({ cloudRequest: { points } });
assert.equal(cloudId, "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c");
const cloud = { id: cloudId };

await theCloudIsListed();
await normalsPointOutward();
await curvaturesAreNullAtTheCentre();
await theMatrixTurnsCosinesIntoTheirNegatives();
await thePosteriorHasAVariance();
await aRefusalNamesTheField();
await aCloudIsDeletedOnce();

async function theCloudIsListed() {
    const page = await clouds.listClouds({ limit: 1000 });
    assert.ok(page.clouds.some((listed) => listed.cloudId === cloudId && listed.nPoints === 8));
}

async function normalsPointOutward() {
    const { normals } = await geometry.computeNormals({ normalsRequest: { cloud, kernel: gauss, alpha: 0 } });
    for (const [i, normal] of normals.entries()) {
        assert.ok(dot(normal ?? [], points[i] ?? []) > 0.999, `${i}: ${normal}`);
    }
    assert.equal(normals.length, 8);
}

async function curvaturesAreNullAtTheCentre() {
    const curvaturesRequest = {
        cloud,
        queries: [
            [1, 0],
            [0, 0],
        ],
        kernel: gauss,
        alpha: 0,
    };
    const { meanCurvatures, flags } = await geometry.computeCurvatures({ curvaturesRequest });
    const [onTheCircle, atTheCentre] = meanCurvatures;
    assert.ok(Math.abs((onTheCircle ?? NaN) - 1) < 1e-6, `${onTheCircle}`);
    assert.equal(atTheCentre, null);
    assert.equal(flags[0]?.query, 1);
}

async function theMatrixTurnsCosinesIntoTheirNegatives() {
    const laplaceBeltramiMatrixRequest = { cloud, kernel: gauss, alpha: 0 };
    const operators = new OperatorsApi(configuration);
    const { matrix } = await operators.assembleLaplaceBeltramiMatrix({ laplaceBeltramiMatrixRequest });
    assert.equal(matrix.length, 8);
    matrix.forEach((row, i) => {
        const applied = dot(row ?? [], cosines);
        // Eight points on the circle take a wave of frequency 7 for a cosine, which adds the fraction
        // 48 I_7(1/2)/I_1(1/2) = 2.3e-6. The Bessel functions I_k are the Fourier coefficients of this kernel
        // on the circle, up to a factor.
        assert.ok(Math.abs(applied + (cosines[i] ?? NaN)) < 5e-6, `row ${i}: ${applied}`);
    });
}

async function thePosteriorHasAVariance() {
    const include = [PosteriorQuantity.Variances];
    const posteriorRequest = { cloud, values: cosines, queries: [[0.9, 0.1]], alpha: 1e-6, include };
    const { means, variances } = await new ValuesApi(configuration).computePosterior({ posteriorRequest });
    assert.equal(means.length, 1);
    assert.equal(variances?.length, 1);
    assert.ok((variances[0] ?? NaN) >= 0);
}

async function aRefusalNamesTheField() {
    const curvaturesRequest = { cloud, kernel: { ...gauss, lengthScale: -1 } };
    const problem = await refusal(geometry.computeCurvatures({ curvaturesRequest }), 422);
    assert.equal(problem.type, "/problems/invalid-request");
    assert.equal(problem.errors?.[0]?.pointer, "/kernel/length_scale");
}

async function aCloudIsDeletedOnce() {
    await clouds.checkCloud({ cloudId });
    await clouds.deleteCloud({ cloudId });
    const problem = await refusal(clouds.deleteCloud({ cloudId }), 404);
    assert.equal(problem.type, "/problems/unknown-cloud");
}

async function refusal(call: Promise<unknown>, status: number): Promise<Problem> {
    const error = await call.then(
        () => assert.fail("this should be refused"),
        (reason: unknown) => reason,
    );
    assert.ok(error instanceof ResponseError, `${error}`);
    assert.equal(error.response.status, status);
    return error.response.json();
}

function dot(a: number[], b: number[]): number {
    assert.equal(a.length, b.length);
    return a.reduce((sum, x, i) => sum + x * (b[i] ?? NaN), 0);
}
