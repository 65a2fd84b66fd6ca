// Prints what the Khronos validator finds in the GLB files named on the command line, as JSON.
const fs = require("fs");
const path = require("path");
const [modules, ...files] = process.argv.slice(2);
const validator = require(path.join(modules, "gltf-validator"));

async function main() {
  const reports = [];
  for (const file of files) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
    reports.push({ file, ...report.issues });
  }
  console.log(JSON.stringify(reports));
}

main();
