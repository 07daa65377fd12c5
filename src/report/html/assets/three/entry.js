// What view.js uses of three.js; ci/vendor.sh makes three.min.js.gz of it, which gives the page one name, THREE.
export {
  BufferAttribute, BufferGeometry, DataTexture, DoubleSide, GLSL3, Mesh, PerspectiveCamera, RawShaderMaterial, Scene,
  Vector3, WebGLRenderer,
} from "three";
export { TrackballControls } from "three/addons/controls/TrackballControls.js";
export { LineMaterial } from "three/addons/lines/LineMaterial.js";
export { LineSegments2 } from "three/addons/lines/LineSegments2.js";
export { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
