"use strict";
// Puts the meshes into their canvases, and makes the controls do what they say.

async function start() {
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await unpack(document.getElementById("three"), "gzip"));
  document.head.append(script);

  const place = document.getElementById("views");
  const sides = place.dataset.sides.split(" ").map(Number);
  const tables = { quality: coloursOf(place.dataset.quality), distance: coloursOf(place.dataset.distance) };
  const lines = new Uint16Array(await unpack(document.getElementById("lines"), "deflate"));
  const packed = document.querySelectorAll("script.mesh");
  const views = [];
  for (const [k, figure] of [...place.querySelectorAll("figure")].entries()) {
    const texture = new THREE.DataTexture(new Uint8Array([...tables.quality, ...tables.distance]), 256, 2);
    texture.needsUpdate = true;
    const view = new View(figure.querySelector("canvas"), sides, texture);
    const buffer = await unpack(packed[k], "deflate");
    view.showMesh(cornersOf(buffer, Number(figure.dataset.vertices), Number(figure.dataset.faces)));
    if (lines.length > 0) view.showLines(lines);
    views.push(view);
  }
  connect(views, tables, place.dataset);
}

function connect(views, tables, told) {
  const controls = document.getElementById("controls");
  const wanted = () => {
    const { colours, up, edges, curves, linked } = controls.elements;
    return { colours: colours.value, up: up.value, edges: edges.checked, curves: curves.checked, linked: linked.checked };
  };
  const apply = (name) => {
    const state = wanted();
    for (const view of views) {
      view.set(state);
      if (!name || name === "up") view.home(state.up);
    }
    if (name === "linked" && state.linked) views.slice(1).forEach((view) => view.follow(views[0]));
    showScale(state.colours, tables, told);
  };
  controls.addEventListener("change", (event) => apply(event.target.name));
  // The elements change after the event.
  controls.addEventListener("reset", () => setTimeout(apply));
  for (const view of views) {
    view.controls.addEventListener("change", () => {
      view.stale = true;
      if (wanted().linked) views.filter((other) => other !== view).forEach((other) => other.follow(view));
    });
    new ResizeObserver(() => view.resize()).observe(view.canvas);
    view.resize();
  }
  apply();
  const frame = () => {
    views.forEach((view) => view.draw());
    document.documentElement.dataset.state = "ready";
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

// What the colours mean.
function showScale(colours, tables, told) {
  const scale = document.getElementById("scale");
  scale.hidden = colours === "plain";
  if (scale.hidden) return;
  const stops = [0, 32, 64, 96, 128, 160, 192, 224, 255].map((k) => {
    return `rgb(${tables[colours].slice(4 * k, 4 * k + 3).join(" ")})`;
  });
  scale.querySelector(".ramp").style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  const [from, to, meaning] = colours === "quality"
    ? [`${told.worst} or less`, "1", "Q of each triangle: 1 if equilateral, 0 without area"]
    : ["0", told.largest, "from each triangle's middle to the other mesh"];
  scale.querySelector(".from").textContent = from;
  scale.querySelector(".to").textContent = to;
  scale.querySelector(".meaning").textContent = meaning;
}

start().catch((problem) => {
  const trouble = document.getElementById("trouble");
  trouble.textContent = `The views cannot be shown: ${problem.message}. They need a browser with WebGL 2.`;
  trouble.hidden = false;
  document.documentElement.dataset.state = "failed";
});
