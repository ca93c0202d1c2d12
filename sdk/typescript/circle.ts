import { client } from "./generated/client.gen.ts";
import { computeCurvatures } from "./generated/index.ts";

client.setConfig({ baseUrl: process.env.GRAMIAN_URL ?? "http://localhost:8080" });
const angles = Array.from({ length: 8 }, (_, i) => (i * Math.PI) / 4);
const points = angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
const { data, error } = await computeCurvatures({ body: { cloud: { points } } });
console.log(data?.mean_curvatures ?? error?.detail);
