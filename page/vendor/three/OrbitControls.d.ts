// Types of the vendored build.
export * from "three/examples/jsm/controls/OrbitControls.js";
