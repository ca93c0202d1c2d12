import { computeCurvatures } from "./generated/gramian.ts";

const angles = Array.from({ length: 8 }, (_, i) => (i * Math.PI) / 4);
const points = angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
const answer = await computeCurvatures({ cloud: { points } });
console.log(answer.status === 200 ? answer.data.mean_curvatures : answer.data.detail);
