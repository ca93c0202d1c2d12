// @ts-check
// Runs snippets as people do who copied them: `asked` beside stand-ins that note what is asked of them,
// `ran` against a server.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** Texts that begin something of their own where they are not quoted. */
export const HOSTILE = [
  "'; touch taken; '",
  '"; touch taken; "',
  "$(touch taken)",
  "`touch taken`",
  "\\'; touch taken; #",
  "\n touch taken\n",
  '"); open("taken", "w"); ("',
  "\\",
  "\\\"); open('taken', 'w') #",
  "\r\nopen('taken', 'w')\r\n",
  "\u2028open('taken', 'w')",
  "`+require('fs').writeFileSync('taken', '')+`",
  '"); require("fs").writeFileSync("taken", ""); ("',
  // biome-ignore lint/suspicious/noTemplateCurlyInString: a template is what it tries to be taken for
  "${process.exit(3)}",
];

/** The id that the stand-ins give a cloud. */
export const ID = "0".repeat(64);

/** Programs that note what they were asked in the file $ASKED, instead of `curl`, `gramian` and `fetch`. */
const STUBS = {
  curl: [
    "#!/usr/bin/env python3",
    "import json, os, sys",
    "sent = sys.stdin.read() if '@-' in sys.argv else None",
    "with open(os.environ['ASKED'], 'a') as asked: print(json.dumps([*sys.argv[1:], sent]), file=asked)",
    `print('{"cloud_id":"${ID}"}')`,
    "",
  ].join("\n"),
  "gramian.py": [
    "import json, os",
    "def note(*asked):",
    "    with open(os.environ['ASKED'], 'a') as file: print(json.dumps(asked), file=file)",
    "class Cloud:",
    "    def __getattr__(self, name): return lambda **options: note(name, options)",
    "class Client:",
    "    def __init__(self, address): note('client', address)",
    "    def cloud(self, points, normals=None):",
    "        note('cloud', points)",
    "        return Cloud()",
    "",
  ].join("\n"),
  "numpy.py": "load = lambda path: path\n",
  "fetch.cjs": [
    'const { appendFileSync } = require("node:fs");',
    "globalThis.fetch = async (address, { body, ...options }) => {",
    "  const asked = [address, { ...options, body: String(body) }];",
    "  appendFileSync(process.env.ASKED, JSON.stringify(asked) + '\\n');",
    `  return { ok: true, json: async () => ({ cloud_id: "${ID}" }) };`,
    "};",
    "",
  ].join("\n"),
};

const COMMANDS = {
  curl: (text) => ["bash", "-c", text],
  python: (text) => ["python3", "-B", "-c", text],
  typescript: (text) => ["node", "--input-type=module-typescript", "-e", text],
};

/** Calls `use` with a new folder that holds files, and removes it. */
function inFolder(files, use) {
  const folder = mkdtempSync(join(tmpdir(), "gramian-snippet-"));
  try {
    for (const [name, content] of Object.entries(files)) writeFileSync(join(folder, name), content, { mode: 0o755 });
    return use(folder);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/**
 * What a snippet asks for, run in a folder of its own beside the files that it reads.
 *
 * @param {string} language
 * @param {string} text
 * @param {Record<string, string>} files
 */
export function asked(language, text, files = {}) {
  return inFolder({ ...STUBS, ...files }, (folder) =>
    inFolder({ asked: "" }, (notes) => {
      const before = readdirSync(folder);
      const [program, ...options] = COMMANDS[language](text);
      const env = {
        ...process.env,
        PATH: `${folder}:${process.env.PATH}`,
        PYTHONPATH: folder,
        NODE_OPTIONS: `--require ${join(folder, "fetch.cjs")}`,
        ASKED: join(notes, "asked"),
      };
      const { status, stderr } = spawnSync(program, options, { cwd: folder, env, encoding: "utf8" });
      assert.equal(status, 0, `${text}\n${stderr}`);
      assert.deepEqual(readdirSync(folder), before, text);
      const lines = readFileSync(join(notes, "asked"), "utf8").trim().split("\n");
      return lines.map((line) => JSON.parse(line));
    }),
  );
}

/**
 * Runs a snippet as it is, beside the files that it reads. Returns what it printed, and what it wrote by the
 * names of the files.
 *
 * @param {string} language
 * @param {string} text
 * @param {Record<string, string | Uint8Array>} files
 * @param {Record<string, string>} variables
 */
export function ran(language, text, files = {}, variables = {}) {
  return inFolder(files, (folder) => {
    const [program, ...options] = COMMANDS[language](text);
    const python = new URL("../../sdk/python/src", import.meta.url).pathname;
    const { GRAMIAN_URL: _, ...inherited } = process.env;
    const env = { ...inherited, PYTHONPATH: python, ...variables };
    const { status, stdout, stderr } = spawnSync(program, options, { cwd: folder, env, encoding: "utf8" });
    assert.equal(status, 0, `${text}\n${stdout}\n${stderr}`);
    const written = readdirSync(folder).filter((name) => !Object.hasOwn(files, name));
    return {
      stdout,
      written: Object.fromEntries(written.map((name) => [name, readFileSync(join(folder, name), "utf8")])),
    };
  });
}

/**
 * Starts a server with flags on a port, any free one if it is 0. Returns its address, and a function that
 * ends it and waits until it is gone.
 *
 * @param {string[]} flags
 * @returns {Promise<{ address: string, stop: () => Promise<void> }>}
 */
export function started(flags, port = 0) {
  const binary = process.env.GRAMIAN_BINARY ?? "";
  const env = { ...process.env, RUST_LOG: "info" };
  for (const name of Object.keys(env)) if (name.startsWith("GRAMIAN_")) delete env[name];
  const server = spawn(binary, ["--bind", `127.0.0.1:${port}`, ...flags], { env, stdio: ["ignore", "ignore", "pipe"] });
  const ended = new Promise((resolve) => server.on("exit", resolve));
  const stop = async () => {
    server.kill();
    await ended;
  };
  return new Promise((resolve, reject) => {
    let log = "";
    ended.then(() => reject(new Error(`the server ended: ${log}`)));
    server.stderr.on("data", (part) => {
      log += part;
      const address = log.match(/"address":"([^"]+)"/)?.[1];
      if (address) resolve({ address: `http://${address}/`, stop });
    });
  });
}
