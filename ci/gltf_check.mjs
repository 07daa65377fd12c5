// gltf_check.mjs FILE...: prints the problems that the Khronos validator finds in GLB files, and the files that
// three.js does not open with all their triangles; exits with 1 if there are any.
import fs from "node:fs";
import { validateBytes } from "gltf-validator";

// What the loader needs of a browser; images are not decoded.
globalThis.self = globalThis;
globalThis.ProgressEvent ??= class ProgressEvent extends Event {};
globalThis.createImageBitmap = async (blob) => ({ width: 1, height: 1, size: blob.size, close() {} });
const { GLTFLoader } = await import("three/examples/jsm/loaders/GLTFLoader.js");

/** The problems of a file that the validator reports. */
async function validatorProblems(file, bytes) {
  const { issues } = await validateBytes(bytes, { uri: file });
  // 0 is an error, 1 a warning; the rest are remarks.
  const wrong = issues.messages.filter((issue) => issue.severity < 2);
  return wrong.map(({ code, message, pointer, severity }) =>
    `${severity === 0 ? "error" : "warning"} ${code} at ${pointer}: ${message}`);
}

/** The number of triangles of a file's primitives. */
function triangles(bytes) {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
  const primitives = json.meshes.flatMap((mesh) => mesh.primitives);
  return primitives.reduce((sum, { indices }) => sum + json.accessors[indices].count / 3, 0);
}

/** The problems of a file on opening it in three.js. */
async function loaderProblems(bytes) {
  const { scene } = await new GLTFLoader().parseAsync(new Uint8Array(bytes).buffer, "");
  let found = 0;
  scene.traverse((part) => {
    if (part.isMesh) found += part.geometry.index.count / 3;
  });
  return found === triangles(bytes) ? [] : [`three.js finds ${found} of ${triangles(bytes)} triangles`];
}

const warnings = [];
console.warn = console.error = (...words) => warnings.push(words.join(" "));
const files = process.argv.slice(2);
let wrong = 0;
for (const file of files) {
  const bytes = new Uint8Array(fs.readFileSync(file));
  const opened = await loaderProblems(bytes).catch((error) => [`three.js does not open it: ${error.message}`]);
  const problems = [...(await validatorProblems(file, bytes)), ...opened, ...warnings.splice(0)];
  problems.forEach((problem) => console.log(`${file}: ${problem}`));
  wrong += problems.length;
}
console.log(`gltf: ${files.length} files, ${wrong} errors and warnings`);
process.exitCode = wrong > 0 ? 1 : 0;
