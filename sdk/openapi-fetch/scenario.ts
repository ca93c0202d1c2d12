// The scenario that every client runs, against the server at GRAMIAN_URL.
import assert from "node:assert/strict";

import createClient from "openapi-fetch";

import type { components, paths } from "./generated/gramian.ts";

type Json = "application/json" | "application/problem+json";
type Kernel = components["schemas"]["Kernel"];

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
const gauss: Kernel = { family: "gauss", length_scale: 2 };

const client = createClient<paths, Json>({ baseUrl: process.env.GRAMIAN_URL ?? "http://localhost:8080" });
const registered = answered(await client.POST("/v1/clouds", { body: { points } }));
const cloud = { id: registered.cloud_id };
assert.equal(cloud.id, "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c");

await theCloudIsKnownUntilItIsDeleted();
await curvaturesAreNullAtTheCentre();
await theMatrixTurnsCosinesIntoTheirNegatives();
await thePosteriorHasAVariance();
await aRefusalNamesTheField();

async function theCloudIsKnownUntilItIsDeleted() {
    const { data } = await client.POST("/v1/clouds", { body: { points: [[1, 2]] } });
    const params = { path: { cloud_id: data?.cloud_id ?? "" } };
    assert.equal(answered(await client.GET("/v1/clouds/{cloud_id}", { params })).n_points, 1);
    assert.equal((await client.DELETE("/v1/clouds/{cloud_id}", { params })).response.status, 204);
    assert.equal((await client.GET("/v1/clouds/{cloud_id}", { params })).error?.type, "/problems/unknown-cloud");
}

async function curvaturesAreNullAtTheCentre() {
    const queries = [
        [1, 0],
        [0, 0],
    ];
    const body = { cloud, queries, kernel: gauss, alpha: 0 };
    const data = answered(await client.POST("/v1/curvatures", { body }));
    const [onTheCircle, atTheCentre] = data.mean_curvatures;
    assert.ok(Math.abs((onTheCircle ?? NaN) - 1) < 1e-6, `${onTheCircle}`);
    assert.equal(atTheCentre, null);
    assert.equal(data.flags[0]?.query, 1);
}

async function theMatrixTurnsCosinesIntoTheirNegatives() {
    const body = { cloud, kernel: gauss, alpha: 0 };
    const data = answered(await client.POST("/v1/laplace-beltrami/matrix", { body }));
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
    const body = { cloud, values: cosines, queries: [[0.9, 0.1]], alpha: 1e-6, include: ["variances" as const] };
    const data = answered(await client.POST("/v1/posterior", { body }));
    assert.equal(data.means.length, 1);
    assert.equal(data.variances?.length, 1);
    assert.ok((data.variances[0] ?? NaN) >= 0);
}

// A refusal is not thrown but answered as `error`, a `Problem`.
async function aRefusalNamesTheField() {
    const kernel = { ...gauss, length_scale: -1 };
    const { data, error } = await client.POST("/v1/curvatures", { body: { cloud, kernel } });
    assert.equal(data, undefined);
    assert.equal(error?.type, "/problems/invalid-request");
    assert.equal(error.errors?.[0]?.pointer, "/kernel/length_scale");
}

function answered<T>({ data, error }: { data?: T; error?: components["schemas"]["Problem"] }): T {
    assert.ok(data !== undefined, error?.detail);
    return data;
}

function dot(a: number[], b: number[]): number {
    assert.equal(a.length, b.length);
    return a.reduce((sum, x, i) => sum + x * (b[i] ?? NaN), 0);
}
