// @ts-check
// The request on screen as a command or a program. People copy and run it, so every text from a link, a file
// or a server is quoted for its language.

import { OPERATIONS } from "./operations.js";

export const LANGUAGES = { curl: "curl", python: "Python", typescript: "TypeScript" };

/**
 * @param {string} language
 * @param {{
 *   address: string,
 *   cloudId?: string,
 *   operation: string,
 *   request: Record<string, any>,
 *   fileName?: string,
 * }} asked
 */
export function snippet(language, { address, cloudId, operation, request, fileName }) {
  const { path, method } = OPERATIONS[operation];
  const server = address.replace(/\/$/, "");
  const body = { cloud: { id: cloudId ?? "…" }, ...request };
  if (language === "curl") return curl(`${server}/${path}`, body);
  if (language === "python") return python(server, { method, request, fileName });
  return typescript(`${server}/${path}`, body);
}

function curl(url, body) {
  return `curl ${ofShell(url)} -H 'Content-Type: application/json' \\\n  -d ${ofShell(quoted(body))}`;
}

function python(server, { method, request, fileName = "scan.ply" }) {
  const options = Object.entries(request)
    .map(([name, value]) => `${name}=${ofPython(value)}`)
    .join(", ");
  // The client sends PLY files as they are. Points of others are read by the program of who copies this.
  const isSent = /\.ply$/i.test(fileName);
  return [
    "import gramian",
    "",
    ...(isSent ? [] : [`points = ...  # rows [n, d] of ${ofPython(fileName)}`]),
    `client = gramian.Client(${ofPython(server)})`,
    `cloud = client.cloud(${isSent ? ofPython(fileName) : "points"})`,
    `answer = cloud.${method}(${options})`,
  ].join("\n");
}

function typescript(url, body) {
  return [
    `const response = await fetch(${quoted(url)}, {`,
    '  method: "POST",',
    '  headers: { "Content-Type": "application/json" },',
    `  body: JSON.stringify(${quoted(body)}),`,
    "});",
    "const answer = await response.json();",
  ].join("\n");
}

/** A word of a POSIX shell. */
function ofShell(text) {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

function ofPython(value) {
  if (value === true) return "True";
  if (value === false) return "False";
  if (value === null) return "None";
  if (Array.isArray(value)) return `[${value.map(ofPython).join(", ")}]`;
  if (typeof value === "object") {
    return `{${Object.entries(value)
      .map(([name, entry]) => `${quoted(name)}: ${ofPython(entry)}`)
      .join(", ")}}`;
  }
  return quoted(value);
}

/**
 * A value in JSON, whose strings are those of JavaScript and Python too. Characters that nobody sees are
 * escaped.
 */
function quoted(value) {
  return JSON.stringify(value).replace(/[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]/gu, escaped);
}

function escaped(character) {
  return Array.from(
    { length: character.length },
    (_, at) => `\\u${character.charCodeAt(at).toString(16).padStart(4, "0")}`,
  ).join("");
}
