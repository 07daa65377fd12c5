"use strict";
// Decodes and decompresses the data of the page.

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}

// The data in a script element; `kind` is "deflate" or "gzip".
async function unpack(element, kind) {
  const packed = new Blob([bytesOf(element.textContent)]).stream();
  return new Response(packed.pipeThrough(new DecompressionStream(kind))).arrayBuffer();
}

// All corners, four 16-bit numbers each: the coordinates, and the bytes of the face's quality and distance. Faces do
// not share corners, so that each has its own colours.
function cornersOf(buffer, vertices, faces) {
  const indices = new Uint32Array(buffer, 0, 3 * faces);
  const coordinates = new Uint16Array(buffer, 12 * faces, 3 * vertices);
  const quality = new Uint8Array(buffer, 12 * faces + 6 * vertices, faces);
  const distance = new Uint8Array(buffer, 13 * faces + 6 * vertices, faces);
  const corners = new Uint16Array(12 * faces);
  for (let k = 0; k < indices.length; k += 1) {
    const face = Math.floor(k / 3);
    const from = 3 * indices[k];
    corners.set(coordinates.subarray(from, from + 3), 4 * k);
    corners[4 * k + 3] = quality[face] + 256 * distance[face];
  }
  return corners;
}

// The largest distance of a corner from a point, relative to the longest side.
function radiusOf(corners, centre) {
  let farthest = 0;
  for (let k = 0; k < corners.length; k += 4) {
    const [x, y, z] = centre.map((middle, axis) => corners[k + axis] / 65535 - middle);
    farthest = Math.max(farthest, x * x + y * y + z * z);
  }
  return Math.sqrt(farthest);
}

// A table of colours, four bytes each.
function coloursOf(base64) {
  const bytes = bytesOf(base64);
  return Uint8Array.from({ length: 1024 }, (_, k) => (k % 4 === 3 ? 255 : bytes[3 * (k >> 2) + (k % 4)]));
}
