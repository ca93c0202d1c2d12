import { client } from "./generated/client.gen.ts";
import { computeCurvatures, createCloud } from "./generated/index.ts";

client.setConfig({ baseUrl: process.env["GRAMIAN_URL"] ?? "http://localhost:8080" });
const angles = Array.from({ length: 8 }, (_, i) => (i * Math.PI) / 4);
const points = angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
const { data: cloud } = await createCloud({ body: { points }, throwOnError: true });
const { data, error } = await computeCurvatures({ body: { cloud: { id: cloud.cloud_id } } });
console.log(data?.mean_curvatures ?? error?.detail);
