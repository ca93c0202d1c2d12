// The request on screen as a command or a program.

import { OPERATIONS } from "./operations.js";

export const LANGUAGES = { curl: "curl", python: "Python", typescript: "TypeScript" };

export function snippet(language, { cloudId, operation, request, fileName }) {
  const { path, method } = OPERATIONS[operation];
  const address = new URL(".", document.baseURI).href.replace(/\/$/, "");
  const body = { cloud: { id: cloudId ?? "…" }, ...request };
  if (language === "curl") return curl(address, path, body);
  if (language === "python") return python(address, method, request, fileName);
  return typescript(address, path, body);
}

function curl(address, path, body) {
  return `curl ${address}/${path} -H 'Content-Type: application/json' \\\n  -d '${JSON.stringify(body)}'`;
}

function python(address, method, request, fileName) {
  const options = Object.entries(request).map(([name, value]) => `${name}=${pythonOf(value)}`).join(", ");
  return [
    "import gramian",
    "",
    `client = gramian.Client("${address}")`,
    `cloud = client.cloud("${fileName ?? "scan.ply"}")`,
    `answer = cloud.${method}(${options})`,
  ].join("\n");
}

function pythonOf(value) {
  if (value === true) return "True";
  if (value === false) return "False";
  if (Array.isArray(value)) return `[${value.map(pythonOf).join(", ")}]`;
  if (value !== null && typeof value === "object") {
    return `{${Object.entries(value).map(([name, entry]) => `"${name}": ${pythonOf(entry)}`).join(", ")}}`;
  }
  return JSON.stringify(value);
}

function typescript(address, path, body) {
  return [
    `const response = await fetch("${address}/${path}", {`,
    '  method: "POST",',
    '  headers: { "Content-Type": "application/json" },',
    `  body: JSON.stringify(${JSON.stringify(body)}),`,
    "});",
    "const answer = await response.json();",
  ].join("\n");
}
