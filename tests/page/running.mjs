// @ts-check
// Runs snippets of the page, beside programs that note what they are asked.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readdirSync, rmSync, writeFileSync } from "node:fs";
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

/** Programs that note what they were asked, instead of `curl`, the package `gramian` and `fetch`. */
const STUBS = {
  curl: "#!/usr/bin/env python3\nimport json, sys\nprint(json.dumps(sys.argv[1:]))\n",
  "gramian.py": [
    "import json",
    "class Cloud:",
    "    def __getattr__(self, name):",
    "        return lambda **options: print(json.dumps([name, options]))",
    "class Client:",
    "    def __init__(self, address): print(json.dumps(['client', address]))",
    "    def cloud(self, points):",
    "        print(json.dumps(['cloud', '...' if points is ... else points]))",
    "        return Cloud()",
    "",
  ].join("\n"),
  "fetch.cjs":
    "globalThis.fetch = async (...asked) => (console.log(JSON.stringify(asked)), { json: async () => ({}) });\n",
};

/** What a snippet asks for, run in a folder of its own. */
export function asked(language, text) {
  const folder = mkdtempSync(join(tmpdir(), "gramian-snippet-"));
  try {
    for (const [name, stub] of Object.entries(STUBS)) writeFileSync(join(folder, name), stub, { mode: 0o755 });
    const before = readdirSync(folder);
    const [program, ...options] = {
      curl: ["bash", "-c", text],
      python: ["python3", "-B", "-c", text],
      typescript: ["node", "--require", join(folder, "fetch.cjs"), "--input-type=module", "-e", text],
    }[language];
    const env = { ...process.env, PATH: `${folder}:${process.env.PATH}`, PYTHONPATH: folder };
    const { status, stdout, stderr } = spawnSync(program, options, { cwd: folder, env, encoding: "utf8" });
    assert.equal(status, 0, `${text}\n${stderr}`);
    assert.deepEqual(readdirSync(folder), before, text);
    return stdout
      .trim()
      .split("\n")
      .map((line) => JSON.parse(line));
  } finally {
    rmSync(folder, { recursive: true });
  }
}
