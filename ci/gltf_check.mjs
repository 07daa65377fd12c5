// gltf_check.mjs FILE...: tells what the Khronos validator finds wrong in GLB files, and which three.js does not open with
// all their triangles; ends with 1 if that is anything.
import fs from "node:fs";
import { validateBytes } from "gltf-validator";

// What the loader expects of a browser; pictures are not decoded.
globalThis.self = globalThis;
globalThis.ProgressEvent ??= class ProgressEvent extends Event {};
globalThis.createImageBitmap = async (blob) => ({ width: 1, height: 1, size: blob.size, close() {} });
const { GLTFLoader } = await import("three/examples/jsm/loaders/GLTFLoader.js");

/** What is wrong with a file in the eyes of the validator. */
async function invalid(file, bytes) {
  const { issues } = await validateBytes(bytes, { uri: file });
  // 0 is an error, 1 a warning; the rest are remarks.
  const wrong = issues.messages.filter((issue) => issue.severity < 2);
  return wrong.map(({ code, message, pointer, severity }) =>
    `${severity === 0 ? "error" : "warning"} ${code} at ${pointer}: ${message}`);
}

/** The triangles that the accessors of a file's primitives have. */
function triangles(bytes) {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
  const primitives = json.meshes.flatMap((mesh) => mesh.primitives);
  return primitives.reduce((sum, { indices }) => sum + json.accessors[indices].count / 3, 0);
}

/** What is wrong with a file in the eyes of three.js. */
async function unopened(bytes) {
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
  const opened = await unopened(bytes).catch((error) => [`three.js does not open it: ${error.message}`]);
  const problems = [...(await invalid(file, bytes)), ...opened, ...warnings.splice(0)];
  problems.forEach((problem) => console.log(`${file}: ${problem}`));
  wrong += problems.length;
}
console.log(`gltf: ${files.length} files, ${wrong} errors and warnings`);
process.exitCode = wrong > 0 ? 1 : 0;
