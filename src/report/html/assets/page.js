"use strict";
// Shows the meshes in their canvases and connects the controls.

async function start() {
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await unpack(document.getElementById("three"), "gzip"));
  document.head.append(script);

  const place = document.getElementById("views");
  const sides = place.dataset.sides.split(" ").map(Number);
  const tables = { quality: coloursOf(place.dataset.quality), distance: coloursOf(place.dataset.distance) };
  const lines = new Uint16Array(await unpack(document.getElementById("lines"), "deflate"));
  const packed = document.querySelectorAll("script.mesh");
  const meshes = [];
  for (const [k, figure] of [...place.querySelectorAll("figure")].entries()) {
    const buffer = await unpack(packed[k], "deflate");
    const corners = cornersOf(buffer, Number(figure.dataset.vertices), Number(figure.dataset.faces));
    meshes.push({ canvas: figure.querySelector("canvas"), corners, discs: "points" in figure.dataset });
  }
  const centre = sides.map((side) => side / 2);
  const radius = Math.max(...meshes.map(({ corners }) => radiusOf(corners, centre)));
  const views = meshes.map(({ canvas, corners, discs }) => {
    const texture = new THREE.DataTexture(new Uint8Array([...tables.quality, ...tables.distance]), 256, 2);
    texture.needsUpdate = true;
    const view = new View(canvas, centre, radius, texture);
    view.showMesh(corners, discs);
    if (lines.length > 0) view.showLines(lines);
    return view;
  });
  connect(views, tables, place.dataset);
}

function connect(views, tables, data) {
  const controls = document.getElementById("controls");
  const settings = () => {
    const { colours, up, edges, curves, linked } = controls.elements;
    return {
      colours: colours.value, up: up.value, edges: edges.checked, curves: curves.checked, linked: linked.checked,
    };
  };
  const apply = (name) => {
    const state = settings();
    for (const view of views) {
      view.set(state);
      if (!name || name === "up") view.home(state.up);
    }
    if (name === "linked" && state.linked) views.slice(1).forEach((view) => view.follow(views[0]));
    showScale(state.colours, tables, data);
  };
  controls.addEventListener("change", (event) => apply(event.target.name));
  // The controls are reset only after the event.
  controls.addEventListener("reset", () => setTimeout(apply));
  for (const view of views) {
    view.controls.addEventListener("change", () => {
      view.stale = true;
      if (settings().linked) views.filter((other) => other !== view).forEach((other) => other.follow(view));
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
function showScale(colours, tables, data) {
  const scale = document.getElementById("scale");
  const texts = {
    plain: ["", "", "Outer sides are blue, inner sides brown."],
    quality: [`${data.worst} or less`, "1", "Q of each triangle: 1 if equilateral, 0 without area"],
    distance: ["0", data.largest, data.meaning],
  };
  ["from", "to", "meaning"].forEach((part, k) => {
    scale.querySelector(`.${part}`).textContent = texts[colours][k];
  });
  const ramp = scale.querySelector(".ramp");
  ramp.hidden = colours === "plain";
  if (ramp.hidden) return;
  const stops = [0, 32, 64, 96, 128, 160, 192, 224, 255].map((k) => {
    return `rgb(${tables[colours].slice(4 * k, 4 * k + 3).join(" ")})`;
  });
  ramp.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
}

start().catch((problem) => {
  const trouble = document.getElementById("trouble");
  const remedy = "They need a current browser with WebGL 2.";
  trouble.textContent = `The views cannot be shown: ${problem.message}. ${remedy}`;
  trouble.hidden = false;
  document.documentElement.dataset.state = "failed";
});
