import createClient from "openapi-fetch";
import type { paths } from "./generated/gramian.ts";

type Json = "application/json" | "application/problem+json";

const client = createClient<paths, Json>({ baseUrl: process.env.GRAMIAN_URL ?? "http://localhost:8080" });
const angles = Array.from({ length: 8 }, (_, i) => (i * Math.PI) / 4);
const points = angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
const { data, error } = await client.POST("/v1/curvatures", { body: { cloud: { points } } });
console.log(data?.mean_curvatures ?? error?.detail);
