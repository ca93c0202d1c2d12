import { Configuration, GeometryApi } from "gramian";

const basePath = process.env.GRAMIAN_URL ?? "http://localhost:8080";
const geometry = new GeometryApi(new Configuration({ basePath }));
const angles = Array.from({ length: 8 }, (_, i) => (i * Math.PI) / 4);
const points = angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
const answer = await geometry.computeCurvatures({ curvaturesRequest: { cloud: { points } } });
console.log(answer.meanCurvatures);
