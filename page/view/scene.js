// @ts-check
// The picture: points or a mesh, marks, arrows, and a cross-section.

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  Group,
  Line,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  OrthographicCamera,
  PerspectiveCamera,
  PlaneGeometry,
  Points,
  RGBAFormat,
  Scene as Graph,
  Sphere,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from "../vendor/three/three.module.min.js";
import { OrbitControls } from "../vendor/three/OrbitControls.js";
import { uniform } from "../model/examples.js";
import { colours, quantityMaterial, ringMaterial } from "./material.js";

/** @import { ColourRange } from "../types.d.ts" */

/** Points drawn while the view moves. All are drawn once it stands still. */
const MOVING = 150_000;

const MAX_ARROWS = 3000;

/** Stands for a value that there is not. Graphics processors may take NaN for a number. */
const UNKNOWN = -1e30;

const UPRIGHT = new Vector3(0, 1, 0);

export class Scene {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {() => void} changed
   */
  constructor(canvas, changed) {
    this.canvas = canvas;
    /** The element that the canvas fills. */
    this.frame = canvas.parentElement ?? canvas;
    this.changed = changed;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.graph = new Graph();
    this.perspective = new PerspectiveCamera(40, 1, 0.01, 100);
    this.orthographic = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
    /** @type {PerspectiveCamera | OrthographicCamera} */
    this.camera = this.perspective;
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("start", () => {
      this.isMoving = true;
    });
    this.controls.addEventListener("end", () => {
      this.isMoving = false;
      this.draw();
    });
    this.controls.addEventListener("change", () => this.draw());
    this.extras = new Group();
    this.graph.add(this.extras);
    this.isMoving = false;
    this.radius = 1;
    this.spacing = 1;
    this.dot = 1;
    this.n = 0;
    this.dimension = 3;
    /** Positions of what is drawn, about the middle. */
    this.placed = new Float32Array();
    this.middle = [0, 0, 0];
    /**
     * The point of the cloud at each place that is drawn, where they are shuffled.
     * @type {Uint32Array | undefined}
     */
    this.order = undefined;
    /** @type {Points | Mesh | undefined} */
    this.object = undefined;
    this.material = quantityMaterial(true);
    /** The range that the values in the buffers are relative to. */
    this.low = 0;
    this.high = 1;
    /**
     * The frame that is waited for.
     * @type {number | undefined}
     */
    this.awaited = undefined;
    this.scales = { signed: colours(true), plain: colours(false) };
    new ResizeObserver(() => this.resize()).observe(this.frame);
  }

  /**
   * Shows points, or a mesh if there are cells. Positions are relative to their middle, since the graphics
   * processor has 32 bits.
   */
  show({ positions, cells, normals, nearby }) {
    const [n, d] = positions.shape;
    this.dimension = d;
    this.n = n;
    this.clear(this.graph, this.object);
    this.middle = middleOf(positions);
    this.placed = new Float32Array(3 * n);
    this.order = cells ? undefined : shuffled(n);
    const places = this.order ?? Uint32Array.from({ length: n }, (_, at) => at);
    const turned = new Float32Array(3 * n);
    places.forEach((from, to) => {
      for (let axis = 0; axis < d; axis++) {
        this.placed[3 * to + axis] = positions.data[from * d + axis] - this.middle[axis];
        const c = normals?.data[from * d + axis];
        if (Number.isFinite(c)) turned[3 * to + axis] = c;
      }
    });
    const geometry = new BufferGeometry();
    const placed = new BufferAttribute(this.placed, 3);
    geometry.setAttribute("position", placed);
    geometry.setAttribute("normal", new BufferAttribute(turned, 3));
    geometry.setAttribute("value", new BufferAttribute(new Float32Array(n), 1));
    geometry.setAttribute("deviation", new BufferAttribute(new Float32Array(n), 1));
    const isPoint = !cells || d === 2;
    this.material = quantityMaterial(isPoint);
    if (cells && d === 3) geometry.setIndex(new BufferAttribute(Uint32Array.from(cells.data), 1));
    this.object = isPoint ? new Points(geometry, this.material) : new Mesh(geometry, this.material);
    this.object.frustumCulled = false;
    this.graph.add(this.object);
    this.radius = new Box3().setFromBufferAttribute(placed).getBoundingSphere(new Sphere()).radius || 1;
    this.spacing = d === 2 ? (6 * this.radius) / nearby : (2.4 * this.radius) / Math.sqrt(nearby);
    // Dots on a curve would hide it if they touched.
    this.dot = (d === 2 ? 0.4 : 0.85) * this.spacing;
    this.material.uniforms.size.value = this.dot;
    this.material.uniforms.isFlat.value = d === 2 || !normals;
    if (cells && d === 2) this.object.add(lines(geometry, cells.data, 0x8899aa));
    this.resize();
  }

  /**
   * Colours by a quantity, or not at all.
   *
   * @param {{ values: ArrayLike<number>, deviations?: ArrayLike<number> } | undefined} quantity
   * @param {ColourRange} range
   */
  colour(quantity, { low, high, hide, full, isSigned, hasLines }) {
    if (!this.object) return;
    const { value, deviation } = this.object.geometry.attributes;
    this.low = low;
    this.high = high;
    const source = (at) => (this.order ? this.order[at] : at);
    for (let at = 0; at < this.n; at++) {
      // Relative to the range, since these have 32 bits. What is not known has numbers of its own.
      const share = quantity ? (quantity.values[source(at)] - this.low) / (this.high - this.low) : 0;
      const off = quantity?.deviations ? quantity.deviations[source(at)] : 0;
      value.array[at] = Number.isNaN(share) ? UNKNOWN : share;
      deviation.array[at] = Number.isFinite(off) ? off : -UNKNOWN;
    }
    value.needsUpdate = true;
    deviation.needsUpdate = true;
    this.range({ low, high, hide, full, isSigned, isPlain: !quantity, hasLines });
  }

  /** Changes how values become colours. */
  range({ low, high, hide, full, isSigned, isPlain, hasLines }) {
    const { uniforms } = this.material;
    uniforms.low.value = (low - this.low) / (this.high - this.low);
    uniforms.high.value = (high - this.low) / (this.high - this.low);
    uniforms.hide.value = Number.isFinite(hide) ? hide : 3e38;
    uniforms.full.value = full;
    uniforms.hasLines.value = hasLines ?? false;
    uniforms.isPlain.value = isPlain ? 1 : 0;
    uniforms.colours.value = this.scales[isSigned ? "signed" : "plain"];
    this.draw();
  }

  /** Removes marks, arrows and sections. */
  clearExtras() {
    for (const child of [...this.extras.children]) this.clear(this.extras, child);
  }

  /** Marks points without an answer. */
  mark(points, colour) {
    const material = ringMaterial(colour);
    material.uniforms.size.value = 0.6 * this.dot;
    const places = new Float32Array(3 * points.length);
    const at = this.placeOf();
    points.forEach((point, row) => {
      places.set(this.placed.subarray(3 * at(point), 3 * at(point) + 3), 3 * row);
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(places, 3));
    const marks = new Points(geometry, material);
    marks.frustumCulled = false;
    this.extras.add(marks);
    this.resize();
  }

  /** Where a point of the cloud is among those drawn, which are shuffled. */
  placeOf() {
    if (!this.order) return (point) => point;
    const at = new Uint32Array(this.n);
    for (const [place, point] of this.order.entries()) at[point] = place;
    return (point) => at[point];
  }

  /**
   * Arrows along vectors `[n, …]` at points, `from` the vector's part of each row, both ways for directions.
   */
  arrows(tensor, { offset = 0, isBothWays = false, colour = 0x4477aa } = {}) {
    const d = this.dimension;
    const every = Math.max(1, Math.ceil(this.n / MAX_ARROWS));
    const length = (isBothWays ? 0.6 : 1.6) * this.spacing * Math.sqrt(every);
    const ends = [];
    for (let at = 0; at < this.n; at += every) {
      const row = (this.order ? this.order[at] : at) * tensor.width + offset;
      const along = Array.from({ length: 3 }, (_, axis) => (axis < d ? length * tensor.data[row + axis] : 0));
      if (!along.every(Number.isFinite)) continue;
      const place = this.placed.subarray(3 * at, 3 * at + 3);
      ends.push(
        ...along.map((c, axis) => place[axis] - (isBothWays ? c : 0)),
        ...along.map((c, axis) => place[axis] + c),
      );
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(Float32Array.from(ends), 3));
    this.extras.add(new LineSegments(geometry, new LineBasicMaterial({ color: colour })));
    this.draw();
  }

  /** Draws a polyline in the plane. */
  curve(rows, colour) {
    const places = rows.flatMap(([x, y]) => [x - this.middle[0], y - this.middle[1], 0]);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(Float32Array.from(places), 3));
    this.extras.add(new Line(geometry, new LineBasicMaterial({ color: colour })));
    this.draw();
  }

  /** Shows a square picture on a plane: pixels of width × width, spanned by two half edges about a centre. */
  section({ pixels, width, centre, along, up }) {
    const texture = new DataTexture(pixels, width, width, RGBAFormat);
    texture.colorSpace = SRGBColorSpace;
    texture.needsUpdate = true;
    const material = new MeshBasicMaterial({ map: texture, side: DoubleSide, transparent: true, opacity: 0.85 });
    const plane = new Mesh(new PlaneGeometry(2, 2), material);
    const [x, y, o] = [along, up, centre].map((vector) => new Vector3(...vector));
    o.sub(new Vector3(...this.middle));
    // In the plane it lies behind the points.
    if (this.dimension === 2) o.z -= 0.02 * this.radius;
    plane.matrixAutoUpdate = false;
    plane.matrix.makeBasis(x, y, new Vector3().crossVectors(x, y).normalize()).setPosition(o);
    this.extras.add(plane);
    this.draw();
  }

  /** Looks at everything, along an axis, or at the plane of a flat cloud. */
  fit(axis) {
    const isFlat = this.dimension === 2;
    const direction = isFlat ? new Vector3(0, 0, 1) : axis ? new Vector3(...axis) : new Vector3(0.35, 0.3, 0.9);
    this.controls.enableRotate = !isFlat;
    this.controls.target.set(0, 0, 0);
    // The controls took this axis once, and keep off its poles.
    this.camera.up.copy(UPRIGHT);
    this.camera.position.copy(direction.normalize().multiplyScalar(2.7 * this.radius));
    this.orthographic.zoom = 1;
    this.resize();
    this.controls.update();
    this.draw();
  }

  /** Chooses parallel or central projection. The view stays. */
  project(isOrthographic) {
    const wanted = isOrthographic || this.dimension === 2 ? this.orthographic : this.perspective;
    if (wanted === this.camera) return;
    wanted.position.copy(this.camera.position);
    wanted.up.copy(this.camera.up);
    this.camera = wanted;
    this.controls.object = wanted;
    this.resize();
    this.controls.update();
  }

  /** Turns the view by angles, in radians. */
  turn(around, over) {
    if (this.dimension === 2) return;
    this.controls.rotateLeft(-around);
    this.controls.rotateUp(-over);
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    const [near, far, half] = [0.005 * this.radius, 30 * this.radius, 1.1 * this.radius];
    const aspect = width / height;
    const [across, up] = aspect > 1 ? [half * aspect, half] : [half, half / aspect];
    Object.assign(this.perspective, { aspect, near, far });
    Object.assign(this.orthographic, { left: -across, right: across, top: up, bottom: -up, near, far });
    for (const camera of [this.perspective, this.orthographic]) camera.updateProjectionMatrix();
    const pixels = 0.5 * height * this.renderer.getPixelRatio();
    this.graph.traverse((/** @type {any} */ { material }) => {
      if (material?.uniforms?.height) material.uniforms.height.value = pixels;
    });
    this.draw();
  }

  background(colour) {
    this.graph.background = new Color(colour);
    this.draw();
  }

  /** Draws in the next frame, once however often it is asked. */
  draw() {
    this.awaited ??= requestAnimationFrame(() => {
      this.awaited = undefined;
      this.render();
    });
  }

  render() {
    if (!this.object) return;
    if (this.order) this.object.geometry.setDrawRange(0, this.isMoving ? MOVING : Infinity);
    this.renderer.render(this.graph, this.camera);
    this.changed();
  }

  /** The nearest point in front at a place on the canvas, in pixels, or undefined. */
  pick(x, y) {
    if (!this.object) return undefined;
    this.camera.updateMatrixWorld();
    const elements = this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse).elements;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const reach = 10;
    /** @type {number | undefined} */
    let found;
    let depth = Infinity;
    for (let at = 0; at < this.n; at++) {
      const [a, b, c] = [this.placed[3 * at], this.placed[3 * at + 1], this.placed[3 * at + 2]];
      const w = elements[3] * a + elements[7] * b + elements[11] * c + elements[15];
      if (w <= 0) continue;
      const across =
        (0.5 + (0.5 * (elements[0] * a + elements[4] * b + elements[8] * c + elements[12])) / w) * width - x;
      if (Math.abs(across) > reach) continue;
      const down =
        (0.5 - (0.5 * (elements[1] * a + elements[5] * b + elements[9] * c + elements[13])) / w) * height - y;
      if (Math.abs(down) > reach) continue;
      const z = (elements[2] * a + elements[6] * b + elements[10] * c + elements[14]) / w;
      // A point a little behind but nearer to the pointer is the one that is meant.
      const score = z + 1e-4 * Math.hypot(across, down);
      if (score < depth) [found, depth] = [at, score];
    }
    return found === undefined ? undefined : this.order ? this.order[found] : found;
  }

  /** Where a point is on the canvas, in pixels. */
  onCanvas(point) {
    const at = 3 * this.placeOf()(point);
    const place = new Vector3(...this.placed.subarray(at, at + 3)).project(this.camera);
    return [(0.5 + 0.5 * place.x) * this.canvas.clientWidth, (0.5 - 0.5 * place.y) * this.canvas.clientHeight];
  }

  /** Length of a pixel where the view is aimed, for the scale bar. */
  pixel() {
    const { clientHeight: height } = this.canvas;
    if (this.camera === this.orthographic) {
      return (this.orthographic.top - this.orthographic.bottom) / this.orthographic.zoom / height;
    }
    const distance = this.camera.position.distanceTo(this.controls.target);
    return (2 * distance * Math.tan((Math.PI * this.perspective.fov) / 360)) / height;
  }

  clear(parent, object) {
    if (!object) return;
    parent.remove(object);
    object.traverse(({ geometry, material }) => {
      geometry?.dispose();
      material?.map?.dispose();
      material?.dispose();
    });
  }
}

/** Lines between points of a geometry. */
function lines(points, cells, colour) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", points.attributes.position);
  geometry.setIndex(new BufferAttribute(Uint32Array.from(cells), 1));
  return new LineSegments(geometry, new LineBasicMaterial({ color: colour }));
}

function middleOf({ data, shape: [n, d] }) {
  const [least, greatest] = [
    [0, 0, 0],
    [0, 0, 0],
  ];
  for (let axis = 0; axis < d; axis++) [least[axis], greatest[axis]] = [Infinity, -Infinity];
  for (let row = 0; row < n; row++) {
    for (let axis = 0; axis < d; axis++) {
      least[axis] = Math.min(least[axis], data[row * d + axis]);
      greatest[axis] = Math.max(greatest[axis], data[row * d + axis]);
    }
  }
  return least.map((x, axis) => 0.5 * (x + greatest[axis]));
}

/** A fixed random order, so that its beginning is a sample of all points. */
function shuffled(n) {
  const order = Uint32Array.from({ length: n }, (_, at) => at);
  const random = uniform(7);
  for (let at = n - 1; at > 0; at--) {
    const other = Math.floor(random() * (at + 1));
    [order[at], order[other]] = [order[other], order[at]];
  }
  return order;
}
