// gltf_check.js VALIDATOR FILE...: tells what the validator finds wrong in files, and ends with 1 if that is anything.
"use strict";
const fs = require("fs");
const path = require("path");

async function main([folder, ...files]) {
  const validator = require(path.resolve(folder));
  let wrong = 0;
  for (const file of files) {
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { uri: file });
    // 0 is an error, 1 a warning; the rest are remarks.
    for (const { code, message, pointer, severity } of issues.messages.filter((issue) => issue.severity < 2)) {
      console.error(`${file}: ${severity === 0 ? "error" : "warning"} ${code} at ${pointer}: ${message}`);
      wrong += 1;
    }
  }
  console.log(`gltf: ${files.length} files, ${wrong} errors and warnings`);
  process.exitCode = wrong > 0 ? 1 : 0;
}

main(process.argv.slice(2));
