// Tests the page of `rtfmesh remesh --html` in a browser and logs what it found, ending with "page check: passed"
// or "failed". ci/page.sh inserts this before everything else in the page.
"use strict";
const problems = [];
for (const name of ["error", "warn"]) {
  const log = console[name].bind(console);
  console[name] = (...words) => {
    problems.push(`console.${name}: ${words.join(" ")}`);
    log(...words);
  };
}
addEventListener("error", (event) => problems.push(`error: ${event.message}`));
addEventListener("unhandledrejection", (event) => problems.push(`rejected: ${event.reason}`));
addEventListener("securitypolicyviolation", (event) => problems.push(`refused: ${event.blockedURI}`));

const frames = async (count) => {
  for (let k = 0; k < count; k += 1) await new Promise(requestAnimationFrame);
};
const expect = (holds, what) => {
  if (!holds) problems.push(what);
};

// The pixels of a canvas, four bytes each.
function pixels(canvas) {
  const offscreen = new OffscreenCanvas(canvas.width, canvas.height);
  const copy = offscreen.getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  return copy.getImageData(0, 0, canvas.width, canvas.height).data;
}
const drawn = (image) => image.filter((value, k) => k % 4 === 3 && value > 0).length;
function differing(a, b) {
  let count = 0;
  for (let k = 0; k < a.length; k += 4) {
    if ([0, 1, 2, 3].some((part) => Math.abs(a[k + part] - b[k + part]) > 16)) count += 1;
  }
  return count;
}

async function check() {
  for (let k = 0; k < 600 && !document.documentElement.dataset.state; k += 1) await frames(1);
  expect(document.documentElement.dataset.state === "ready", "the page is not ready");
  await frames(3);
  const canvases = [...document.querySelectorAll("canvas")];
  expect(canvases.length === 2, "there are not two canvases");
  const snapshot = () => canvases.map(pixels);
  const first = snapshot();
  first.forEach((image, k) => expect(drawn(image) > 0.1 * (image.length / 4), `canvas ${k} is nearly empty`));

  // Clicks the selected element; these views must change by at least so many pixels, or for 0 not at all.
  const click = async (selector, least, views = canvases.keys()) => {
    const before = snapshot();
    document.querySelector(selector).click();
    await frames(3);
    const after = snapshot();
    [...views].forEach((k) => {
      const image = after[k];
      const count = differing(before[k], image);
      expect(least === 0 ? count === 0 : count >= least, `${selector} changes ${count} pixels of view ${k}`);
    });
  };
  // Points have neither quality nor edges.
  const ofMeshes = [...document.querySelectorAll("figure")].flatMap(({ dataset }, k) => "points" in dataset ? [] : [k]);
  await click("[value=quality]", 1000, ofMeshes);
  expect(!document.querySelector(".ramp").hidden, "no scale for quality");
  await click("[value=distance]", 1000);
  await click("[value=plain]", 1000);
  expect(document.querySelector(".ramp").hidden, "a scale for plain colours");
  await click("[name=edges]", 200, ofMeshes);
  if (!document.querySelector("[name=curves]").disabled) await click("[name=curves]", 100);
  await click("[value=z]", 1000);
  await click("[type=reset]", 1000);
  snapshot().forEach((image, k) => expect(differing(image, first[k]) === 0, `reset does not restore view ${k}`));

  // Both views rotate when one is dragged; only that one if they are not linked.
  const drag = async () => {
    const before = snapshot();
    const [canvas] = canvases;
    const box = canvas.getBoundingClientRect();
    const send = (type, x) => canvas.dispatchEvent(new PointerEvent(type, {
      pointerId: 1, pointerType: "mouse", button: 0, buttons: 1, bubbles: true,
      clientX: box.left + x, clientY: box.top + 90, screenX: x,
    }));
    // There is no pointer to capture.
    canvas.setPointerCapture = () => {};
    canvas.releasePointerCapture = () => {};
    send("pointerdown", 60);
    for (let x = 60; x <= 140; x += 20) {
      send("pointermove", x);
      await frames(1);
    }
    send("pointerup", 140);
    await frames(3);
    return snapshot().map((image, k) => differing(before[k], image));
  };
  const both = await drag();
  expect(both.every((count) => count > 1000), `a drag changes ${both} pixels`);
  document.querySelector("[name=linked]").click();
  const one = await drag();
  expect(one[0] > 1000 && one[1] === 0, `a drag of one view changes ${one} pixels`);
  expect(document.documentElement.scrollWidth <= innerWidth, "the page is wider than the window");
}

addEventListener("load", async () => {
  await check().catch((problem) => problems.push(`check: ${problem.stack}`));
  for (const problem of problems) console.log(`page problem: ${problem.replaceAll("\n", " ")}`);
  console.log(`page check: ${problems.length ? "failed" : "passed"}`);
});
