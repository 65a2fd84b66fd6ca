// Bundles src/ into ../src/panoscene/views/report/: report.js, report.css, report.html and
// LICENCES.txt. With --check: says whether those files are what the sources make.

import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const target = join(here, "../src/panoscene/views/report");
const read = (...parts) => readFileSync(join(here, ...parts), "utf8").replaceAll("\r\n", "\n");

/** One hash of everything that the bundle depends on; tests/views/test_report.py computes it too. */
function sourceHash() {
  const sources = readdirSync(join(here, "src")).map((name) => `src/${name}`);
  const hash = createHash("sha256");
  for (const name of [...sources, "build.mjs", "package-lock.json", "package.json"].sort()) {
    hash.update(`${name}\n${read(name)}\n`);
  }
  return hash.digest("hex");
}

function packagesIn(metafile) {
  const names = Object.keys(metafile.inputs).flatMap((path) => {
    const match = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path);
    return match === null ? [] : [match[1]];
  });
  return [...new Set(names)].sort();
}

function licences(metafile) {
  const parts = packagesIn(metafile).map((name) => {
    const { version, license } = JSON.parse(read("node_modules", name, "package.json"));
    return `${name} ${version} (${license})\n\n${read("node_modules", name, "LICENSE").trim()}\n`;
  });
  const intro = "The report's scripts contain code of these npm packages, bundled by esbuild:\n";
  return [intro, ...parts].join("\n");
}

const tidy = (text) => `${text.replace(/[ \t]+$/gm, "").trimEnd()}\n`;

const options = { bundle: true, minify: true, write: false, legalComments: "none", charset: "utf8", logLevel: "warning" };
const script = await build({
  ...options,
  entryPoints: [join(here, "src/main.js")],
  absWorkingDir: here,
  format: "iife",
  target: "es2022",
  metafile: true,
});
const style = await build({ ...options, entryPoints: [join(here, "src/report.css")] });
const packages = packagesIn(script.metafile);
const header = `/* panoscene's report. Made by web/build.mjs; do not edit. sources-sha256: ${sourceHash()}
 * Contains ${packages.join(", ")}; see LICENCES.txt beside this file. */\n`;
const outputs = {
  "report.js": header + tidy(script.outputFiles[0].text),
  "report.css": tidy(style.outputFiles[0].text),
  "report.html": tidy(read("src/report.html")),
  "LICENCES.txt": tidy(licences(script.metafile)),
};

if (process.argv.includes("--check")) {
  const stale = Object.entries(outputs).filter(([name, text]) => readFileSync(join(target, name), "utf8") !== text);
  for (const [name] of stale) console.error(`${name} is stale: run "npm run build" in web/`);
  process.exitCode = stale.length > 0 ? 1 : 0;
} else {
  for (const [name, text] of Object.entries(outputs)) {
    writeFileSync(join(target, name), text);
    console.log(`${name}: ${(Buffer.byteLength(text) / 1000).toFixed(1)} kB`);
  }
}
