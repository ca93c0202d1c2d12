// The scenario that every client runs, against the server at GRAMIAN_URL.
import assert from "node:assert/strict";

import {
    assembleLaplaceBeltramiMatrix,
    computeCurvatures,
    computePosterior,
    createCloud,
    deleteCloud,
    getCloud,
    KernelFamily,
    PosteriorQuantity,
    type Kernel,
} from "./generated/gramian.ts";

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
const gauss: Kernel = { family: KernelFamily.gauss, length_scale: 2 };

const registered = await createCloud({ points });
assert.ok(registered.status === 200 || registered.status === 201);
const cloud = { id: registered.data.cloud_id };
assert.equal(cloud.id, "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c");

await theCloudIsKnownUntilItIsDeleted();
await curvaturesAreNullAtTheCentre();
await theMatrixTurnsCosinesIntoTheirNegatives();
await thePosteriorHasAVariance();
await aRefusalNamesTheField();

async function theCloudIsKnownUntilItIsDeleted() {
    const other = await createCloud({ points: [[1, 2]] });
    assert.ok(other.status === 200 || other.status === 201);
    const found = await getCloud(other.data.cloud_id);
    assert.ok(found.status === 200);
    assert.equal(found.data.n_points, 1);
    assert.equal((await deleteCloud(other.data.cloud_id)).status, 204);
    assert.equal((await getCloud(other.data.cloud_id)).status, 404);
}

async function curvaturesAreNullAtTheCentre() {
    const queries = [
        [1, 0],
        [0, 0],
    ];
    const body = { cloud, queries, kernel: gauss, alpha: 0 };
    const { status, data } = await computeCurvatures(body);
    assert.ok(status === 200);
    const [onTheCircle, atTheCentre] = data.mean_curvatures;
    assert.ok(Math.abs((onTheCircle ?? NaN) - 1) < 1e-6, `${onTheCircle}`);
    assert.equal(atTheCentre, null);
    assert.equal(data.flags[0]?.query, 1);
}

async function theMatrixTurnsCosinesIntoTheirNegatives() {
    const body = { cloud, kernel: gauss, alpha: 0 };
    const { status, data } = await assembleLaplaceBeltramiMatrix(body);
    assert.ok(status === 200);
    assert.equal(data.matrix.length, 8);
    data.matrix.forEach((row, i) => {
        const applied = dot(row ?? [], cosines);
        // Eight points on the circle take a wave of frequency 7 for a cosine, which adds the fraction
        // 48 I_7(1/2)/I_1(1/2) = 2.3e-6. The Bessel functions I_k are the Fourier coefficients of this kernel
        // on the circle, up to a factor.
        assert.ok(Math.abs(applied + (cosines[i] ?? NaN)) < 5e-6, `row ${i}: ${applied}`);
    });
}

async function thePosteriorHasAVariance() {
    const include = [PosteriorQuantity.variances];
    const body = { cloud, values: cosines, queries: [[0.9, 0.1]], alpha: 1e-6, include };
    const { status, data } = await computePosterior(body);
    assert.ok(status === 200);
    assert.equal(data.means.length, 1);
    assert.equal(data.variances?.length, 1);
    assert.ok((data.variances[0] ?? NaN) >= 0);
}

// A refusal is not thrown. Its `data` is a `Problem`, which `status` tells the compiler.
async function aRefusalNamesTheField() {
    const kernel = { ...gauss, length_scale: -1 };
    const { status, data } = await computeCurvatures({ cloud, kernel });
    assert.ok(status === 422);
    assert.equal(data.type, "/problems/invalid-request");
    assert.equal(data.errors?.[0]?.pointer, "/kernel/length_scale");
}

function dot(a: number[], b: number[]): number {
    assert.equal(a.length, b.length);
    return a.reduce((sum, x, i) => sum + x * (b[i] ?? NaN), 0);
}
