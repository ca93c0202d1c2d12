// Types of the vendored build.
export * from "three";
