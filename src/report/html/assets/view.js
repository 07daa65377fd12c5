"use strict";
// One mesh in one canvas. Lengths are relative to the longest side of both meshes' bounding box.

const MESH_VERTEX = `
precision highp float;
in vec4 position;
uniform mat4 modelViewMatrix, projectionMatrix;
out vec3 seen, weights;
flat out uint shares;
void main() {
  seen = (modelViewMatrix * vec4(position.xyz / 65535.0, 1.0)).xyz;
  gl_Position = projectionMatrix * vec4(seen, 1.0);
  int corner = gl_VertexID % 3;
  weights = vec3(corner == 0, corner == 1, corner == 2);
  shares = uint(position.w);
}`;

// Lights and colours are those of src/picture/paint.rs.
const MESH_FRAGMENT = `
precision highp float;
precision highp int;
in vec3 seen, weights;
flat in uint shares;
uniform sampler2D tables;
uniform int colours;
uniform bool edges, discs;
uniform float pixelRatio;
out vec4 painted;

float lit(vec3 normal, vec3 lamp, float power) {
  float gloss = pow(max(dot(normal, normalize(lamp + vec3(0, 0, 1))), 0.0), 40.0);
  return power * (max(dot(normal, lamp), 0.0) + 0.15 * gloss);
}

void main() {
  vec3 fromMiddle = weights - 1.0 / 3.0;
  // Outside of the circle that touches the sides.
  if (discs && dot(fromMiddle, fromMiddle) > 1.0 / 6.0) discard;
  vec3 base = gl_FrontFacing ? vec3(0.50, 0.70, 0.90) : vec3(0.80, 0.63, 0.47);
  if (colours == 1 && !discs) base = texelFetch(tables, ivec2(shares & 255u, 0), 0).rgb;
  if (colours == 2) base = texelFetch(tables, ivec2(shares >> 8u, 1), 0).rgb;
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float light = 0.34 + lit(normal, normalize(vec3(-0.45, 0.65, 0.62)), 0.62)
    + lit(normal, normalize(vec3(0.8, 0.1, 0.45)), 0.24);
  vec3 colour = min(base * light, 1.0);
  if (edges && !discs) {
    vec3 steps = fwidth(weights);
    vec3 pixels = weights / max(steps, vec3(1e-6)) / pixelRatio;
    float nearest = min(pixels.x, min(pixels.y, pixels.z));
    // Fainter on small faces, whose colours they would hide.
    float height = 1.0 / max(max(steps.x, max(steps.y, steps.z)), 1e-6) / pixelRatio;
    float strength = clamp(height / 14.0, 0.12, 0.8);
    colour = mix(vec3(0.05, 0.08, 0.16), colour, 1.0 - strength * (1.0 - smoothstep(0.2, 1.2, nearest)));
  }
  painted = vec4(colour, 1.0);
}`;

// Half the vertical angle of view, in degrees: a weak perspective.
const HALF_ANGLE = 12;
// Where the camera starts, in degrees.
const AZIMUTH = 25;
const ELEVATION = 15;

class View {
  // For a mesh in the ball with this centre and radius.
  constructor(canvas, centre, radius, tables) {
    this.canvas = canvas;
    this.centre = new THREE.Vector3(...centre);
    this.radius = radius;
    // The drawing buffer is preserved, so that the image can be copied at any time.
    this.renderer = new THREE.WebGLRenderer({
      canvas, antialias: true, alpha: true, preserveDrawingBuffer: true,
    });
    this.scene = new THREE.Scene();
    const far = 60 * this.radius;
    this.camera = new THREE.PerspectiveCamera(2 * HALF_ANGLE, 1, far / 2000, far);
    this.controls = new THREE.TrackballControls(this.camera, canvas);
    Object.assign(this.controls, {
      staticMoving: true, rotateSpeed: 2.5, minDistance: 0.05 * this.radius, maxDistance: 30 * this.radius,
    });
    this.uniforms = {
      tables: { value: tables }, colours: { value: 0 }, edges: { value: true }, pixelRatio: { value: 1 },
      discs: { value: false },
    };
    this.lines = null;
    this.stale = true;
  }

  // With `discs`, each face stands for a point: the disc inside of it is drawn.
  showMesh(corners, discs) {
    this.uniforms.discs.value = discs;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(corners, 4));
    const material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: MESH_VERTEX, fragmentShader: MESH_FRAGMENT,
      uniforms: this.uniforms, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2,
    });
    const mesh = new THREE.Mesh(geometry, material);
    // The bounds that three.js would compute are in other units.
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  showLines(coordinates) {
    const geometry = new THREE.LineSegmentsGeometry();
    geometry.setPositions(Float32Array.from(coordinates, (value) => value / 65535));
    const material = new THREE.LineMaterial({ color: 0xd63c28, linewidth: 2.5 });
    this.lines = new THREE.LineSegments2(geometry, material);
    this.scene.add(this.lines);
  }

  set({ colours, edges, curves }) {
    this.uniforms.colours.value = ["plain", "quality", "distance"].indexOf(colours);
    this.uniforms.edges.value = edges;
    if (this.lines) this.lines.visible = curves;
    this.stale = true;
  }

  // Moves the camera to where it sees everything, with this axis up.
  home(up) {
    const [turn, rise] = [AZIMUTH, ELEVATION].map((angle) => (angle * Math.PI) / 180);
    const aside = Math.sin(turn) * Math.cos(rise);
    const before = Math.cos(turn) * Math.cos(rise);
    const direction = up === "z" ? [aside, -before, Math.sin(rise)] : [aside, Math.sin(rise), before];
    const distance = (1.03 * this.radius) / Math.sin((HALF_ANGLE * Math.PI) / 180);
    this.camera.position.set(...direction).multiplyScalar(distance).add(this.centre);
    this.camera.up.set(0, up === "z" ? 0 : 1, up === "z" ? 1 : 0);
    this.controls.target.copy(this.centre);
    this.stale = true;
  }

  follow(other) {
    this.camera.position.copy(other.camera.position);
    this.camera.up.copy(other.camera.up);
    this.controls.target.copy(other.controls.target);
    this.stale = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(window.devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.uniforms.pixelRatio.value = ratio;
    this.camera.aspect = width / height;
    // The shorter side decides, so that narrow panels show all as well.
    const tangent = Math.tan((HALF_ANGLE * Math.PI) / 180) / Math.min(1, this.camera.aspect);
    this.camera.fov = (2 * Math.atan(tangent) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    this.controls.handleResize();
    this.stale = true;
  }

  draw() {
    this.controls.update();
    if (!this.stale) return;
    this.stale = false;
    this.renderer.render(this.scene, this.camera);
  }
}
