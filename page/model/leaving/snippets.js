// @ts-check
// The request on screen as a command or a program that runs as it is copied. Every text from a link, a file
// or a server is quoted for its language.

import { OPERATIONS } from "../operations.js";

/** @import { Cloud, Source } from "../../types.d.ts" */

export const LANGUAGES = { curl: "curl", python: "Python", typescript: "TypeScript" };

/** Points up to which a snippet has them itself. */
const MAX_INLINE = 64;

/** Variable of the environment with the key of the service, the same as that of the Python package. */
export const KEY_VARIABLE = "GRAMIAN_API_KEY";

/** Files that both the page and the service read to the same points, by the ends of their names. */
const SENT = { ply: "model/ply", npy: "application/x-npy" };

/**
 * The points of a cloud as a snippet has them: in itself if they are few, from the user's own file if the
 * service reads that, or from a file that the page makes.
 *
 * @param {Cloud} cloud
 * @param {boolean} isOwn
 * @returns {Source}
 */
export function sourceOf(cloud, isOwn) {
  const { name, points, normals, nLeftOut = 0 } = cloud;
  const ending = name.match(/\.(\w+)$/)?.[1].toLowerCase() ?? "";
  const isSent = Object.hasOwn(SENT, ending) && (ending === "npy" || points.width === 3);
  if (isOwn && isSent && nLeftOut === 0) return { file: name, mediaType: SENT[ending], isMade: false };
  if (points.rows <= MAX_INLINE) {
    return { inline: { points: points.lists(), ...(normals ? { normals: normals.lists() } : {}) } };
  }
  const stem = isOwn ? name.replace(/^.*[/\\]/, "").replace(/\.[^.]*$/, "") : name.replaceAll(" ", "-");
  // PLY has three coordinates.
  if (points.width === 3) return { file: `${stem}.ply`, mediaType: SENT.ply, isMade: true };
  return { file: `${stem}.json`, mediaType: "application/json", isMade: true };
}

/**
 * @param {string} language
 * @param {{
 *   address: string,
 *   operation: string,
 *   request: Record<string, any>,
 *   source: Source,
 *   hasKey?: boolean,
 * }} asked
 */
export function snippet(language, { address, operation, request, source, hasKey = false }) {
  const server = address.replace(/\/$/, "");
  const asked = { server, ...OPERATIONS[operation], request, source, hasKey };
  if (language === "curl") return curl(asked);
  return language === "python" ? python(asked) : typescript(asked);
}

// Shell.

function curl({ server, path, method, request, source, hasKey }) {
  const key = hasKey ? ` \\\n  -H "Authorization: Bearer \${${KEY_VARIABLE}:?set it to your key}"` : "";
  const post = (to, type) =>
    `curl --fail-with-body -sS ${ofShell(`${server}/${to}`)}${key} \\\n  -H ${ofShell(`Content-Type: ${type}`)}`;
  const asked = `${post(path, "application/json")} -o ${method}.json`;
  if (source.inline) return `${asked} \\\n  -d ${ofShell(quoted({ cloud: source.inline, ...request }))}`;
  // The id that the service gives the cloud goes between two quoted parts of the body.
  const [before, after] = quoted({ cloud: { id: "\0" }, ...request }).split("\\u0000");
  return [
    `id=$(${post("v1/clouds", source.mediaType)} --data-binary @- < ${ofShell(inFolder(source.file))} |`,
    `  grep -o '"cloud_id":"[^"]*"' | cut -d '"' -f 4)`,
    `${asked} \\\n  -d ${ofShell(before)}"$id"${ofShell(after)}`,
  ].join("\n");
}

/** A path that is no option and no address. */
function inFolder(file) {
  return `./${file}`;
}

/** A word of a POSIX shell. */
function ofShell(text) {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

// Python.

function python({ server, method, request, source, hasKey }) {
  const options = Object.entries(request)
    .map(([name, value]) => `${name}=${ofPython(value)}`)
    .join(", ");
  const { imports, points } = pointsOfPython(source);
  return [
    ...imports.map((name) => `import ${name}`),
    "",
    ...(hasKey ? [`# The key comes from the environment: ${KEY_VARIABLE}.`] : []),
    `client = gramian.Client(${ofPython(server)})`,
    `cloud = client.cloud(${points})`,
    `answer = cloud.${method}(${options})`,
    "print(answer)",
  ].join("\n");
}

function pointsOfPython({ inline, file, mediaType }) {
  const given = (of) => ({ imports: ["gramian"], points: of });
  if (inline) {
    const normals = inline.normals ? `, normals=${ofPython(inline.normals)}` : "";
    return given(`${ofPython(inline.points)}${normals}`);
  }
  const path = ofPython(inFolder(file));
  if (mediaType === "application/json") {
    return { imports: ["json", "gramian"], points: `**json.load(open(${path}, encoding="utf-8"))` };
  }
  if (mediaType === SENT.npy) return { imports: ["gramian", "numpy"], points: `numpy.load(${path})` };
  return given(path);
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

// TypeScript.

function typescript({ server, path, method, request, source, hasKey }) {
  const key = hasKey ? `, Authorization: \`Bearer \${process.env.${KEY_VARIABLE}}\`` : "";
  const register = source.inline
    ? []
    : [
        `const { cloud_id: id } = await post("v1/clouds", ${quoted(source.mediaType)}, await readFile(${quoted(inFolder(source.file))}));`,
      ];
  const cloud = source.inline ? quoted(source.inline) : "{ id }";
  return [
    ...(source.inline ? [] : ['import { readFile } from "node:fs/promises";', ""]),
    "async function post(path: string, type: string, body: string | Uint8Array<ArrayBuffer>) {",
    `  const headers = { "Content-Type": type${key} };`,
    `  const response = await fetch(${quoted(`${server}/`)} + path, { method: "POST", headers, body });`,
    "  if (!response.ok) throw new Error(await response.text());",
    "  return response.json();",
    "}",
    "",
    ...register,
    `const request = ${quoted(request)};`,
    `const answer = await post(${quoted(path)}, "application/json", JSON.stringify({ cloud: ${cloud}, ...request }));`,
    `console.log(answer.${MEMBERS[method]});`,
  ].join("\n");
}

/** What a program prints of an answer. */
const MEMBERS = { curvatures: "mean_curvatures", normals: "normals", level_set: "vertices" };

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
