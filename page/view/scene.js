// @ts-check
// The picture: points or a mesh, what is drawn over them, and the view.

import {
  OrthographicCamera,
  PerspectiveCamera,
  Scene as Graph,
  Vector3,
  WebGLRenderer,
} from "../vendor/three/three.module.min.js";
import { OrbitControls } from "../vendor/three/OrbitControls.js";
import { arrange, Body } from "./body.js";
import { levelOf } from "./colours.js";
import { Extras } from "./extras.js";
import { levelPlane } from "./levels.js";
import { colourTexture } from "./material.js";
import { Picker } from "./picker.js";
import { Shading } from "./shading.js";

/** @import { Box, ColourRange } from "../types.d.ts" */

/** Points drawn while the view moves. All are drawn once it stands still. */
const MOVING = 150_000;

/** Points up to which the picture is drawn twice as fine as the screen, and made coarser. */
const FINE = 400_000;

/** Spacings by which a hole between points lies behind those around it. */
const GAP = 4;

/** The longer side of terrain is at least so many times its height. */
const TERRAIN = 5;

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
    this.renderer.autoClear = false;
    this.shading = new Shading(this.renderer);
    /** What is shaded by depth, and what is drawn over it. */
    this.solid = new Graph();
    this.over = new Graph();
    this.extras = new Extras();
    /** The line between two points that are measured. */
    this.ruler = new Extras();
    this.over.add(this.extras.group, this.ruler.group);
    this.perspective = new PerspectiveCamera(40, 1, 0.01, 100);
    this.orthographic = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
    /** @type {PerspectiveCamera | OrthographicCamera} */
    this.camera = this.perspective;
    this.up = new Vector3(0, 1, 0);
    this.controls = this.control();
    this.isMoving = false;
    this.isShaded = true;
    this.dotFactor = 1;
    /** @type {Box | undefined} */
    this.box = undefined;
    this.picker = new Picker();
    /**
     * What is shown.
     * @type {Body | undefined}
     */
    this.body = undefined;
    /** The range that the values in the buffers are relative to. */
    this.base = { low: 0, high: 1 };
    /** Orders to show and to colour. The last one is carried out. */
    this.orders = { show: 0, colour: 0 };
    /**
     * The frame that is waited for.
     * @type {number | undefined}
     */
    this.awaited = undefined;
    new ResizeObserver(() => this.resize()).observe(this.frame);
  }

  get radius() {
    return this.body?.arrangement.radius ?? 1;
  }

  get dimension() {
    return this.body?.arrangement.dimension ?? 3;
  }

  /** Whether the cloud is a part of the ground, whose height is its third coordinate. */
  get isTerrain() {
    if (!this.body || this.dimension === 2) return false;
    const { low, high } = this.body.arrangement;
    const [x, y, z] = low.map((least, axis) => high[axis] - least);
    return Math.max(x, y) > TERRAIN * z && Math.min(x, y) > 1.2 * z;
  }

  /** Makes the controls anew, since they take the upright axis once. */
  control() {
    this.camera.up.copy(this.up);
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.addEventListener("start", () => {
      this.isMoving = true;
    });
    controls.addEventListener("end", () => {
      this.isMoving = false;
      this.draw();
    });
    controls.addEventListener("change", () => this.draw());
    return controls;
  }

  /**
   * Shows points, or a mesh if there are cells. Returns whether it was done: a later order ends an earlier
   * one. Large clouds take a while, in which the page answers.
   */
  async show({ positions, cells, normals, hidesAway }) {
    const order = ++this.orders.show;
    const body = new Body(await arrange(positions, cells !== undefined), cells);
    await body.turn(normals);
    if (order !== this.orders.show) return false;
    if (this.body) {
      this.solid.remove(this.body.object);
      this.body.dispose();
    }
    this.extras.clear();
    this.ruler.clear();
    this.body = body;
    this.body.material.uniforms.hidesAway.value = hidesAway;
    this.solid.add(body.object);
    this.picker.view = "";
    this.cut(undefined);
    this.resize();
    return true;
  }

  /**
   * Colours by a quantity, or not at all.
   *
   * @param {{ values: ArrayLike<number>, deviations?: ArrayLike<number> } | undefined} quantity
   * @param {ColourRange} range
   */
  async colour(quantity, range) {
    const { body } = this;
    if (!body) return;
    const order = ++this.orders.colour;
    const isWanted = () => order === this.orders.colour && body === this.body;
    await body.fill(quantity, range, isWanted);
    if (!isWanted()) return;
    this.base = range;
    body.material.uniforms.isPainted.value = false;
    this.range(range, !quantity);
  }

  /**
   * Colours by red, green and blue.
   *
   * @param {ArrayLike<number>[]} channels
   * @param {ColourRange} range
   */
  async paint(channels, range) {
    const { body } = this;
    if (!body) return;
    const order = ++this.orders.colour;
    await body.paint(channels);
    await body.fill(undefined, range, () => true);
    if (order !== this.orders.colour || body !== this.body) return;
    this.base = range;
    body.material.uniforms.isPainted.value = true;
    this.range(range, false);
  }

  /**
   * Changes how values become colours.
   *
   * @param {ColourRange} range
   * @param {boolean} isPlain
   */
  range(range, isPlain) {
    if (!this.body) return;
    const { uniforms } = this.body.material;
    const [from, to] = [this.base.low, this.base.high].map((end) => levelOf(end, range.isLogarithmic));
    const share = (end) => (levelOf(end, range.isLogarithmic) - from) / (to - from);
    uniforms.low.value = share(range.low);
    uniforms.high.value = share(range.high);
    uniforms.isDiverging.value = range.middle !== undefined;
    uniforms.middle.value = range.middle === undefined ? 0 : share(range.middle);
    uniforms.hide.value = Number.isFinite(range.hide) ? range.hide : 3e38;
    uniforms.full.value = range.full;
    uniforms.hasLines.value = range.hasLines ?? false;
    uniforms.isPlain.value = isPlain ? 1 : 0;
    uniforms.colours.value?.dispose();
    uniforms.colours.value = colourTexture(range);
    this.draw();
  }

  /**
   * Shows what is inside a box alone.
   *
   * @param {Box | undefined} box
   */
  cut(box) {
    this.box = box;
    const middle = this.body?.arrangement.middle ?? [0, 0, 0];
    const endOf = (ends, otherwise) => new Vector3(...middle.map((x, axis) => (ends ? ends[axis] - x : otherwise)));
    const [low, high] = [endOf(box?.low, -1e30), endOf(box?.high, 1e30)];
    for (const graph of [this.solid, this.over]) {
      graph.traverse((/** @type {any} */ { material }) => {
        material?.uniforms?.boxLow?.value.copy(low);
        material?.uniforms?.boxHigh?.value.copy(high);
      });
    }
    this.picker.view = "";
    this.draw();
  }

  /** Shows the levels of u on a plane that two half edges span about a centre. */
  section(levels, width, plane) {
    if (!this.body) return;
    this.extras.place(this.body, levelPlane(levels, width), plane);
    this.draw();
  }

  /** Looks at everything, along an axis, or at the plane of a flat cloud. */
  fit(axis) {
    const isFlat = this.dimension === 2;
    const isUpright = this.up.y === 1;
    const home = isUpright ? new Vector3(0.35, 0.3, 0.9) : new Vector3(0.35, -0.9, 0.45);
    const direction = isFlat ? new Vector3(0, 0, 1) : axis ? new Vector3(...axis) : home;
    this.controls.enableRotate = !isFlat;
    this.controls.target.set(0, 0, 0);
    // A narrow window sees less to the sides.
    const { clientWidth: width, clientHeight: height } = this.frame;
    const distance = (2.7 * this.radius) / Math.min(1, width / height || 1);
    this.camera.position.copy(direction.normalize().multiplyScalar(distance));
    this.orthographic.zoom = 1;
    this.resize();
    this.controls.update();
    this.draw();
  }

  /** Chooses the axis that points up, z or y. The view stays where it does not change. */
  raise(isZ) {
    if ((this.up.z === 1) === isZ) return;
    this.up.set(0, isZ ? 0 : 1, isZ ? 1 : 0);
    this.controls.dispose();
    this.controls = this.control();
    this.fit();
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
    const [near, far, half] = [0.02 * this.radius, 30 * this.radius, 1.1 * this.radius];
    const aspect = width / height;
    const [across, up] = aspect > 1 ? [half * aspect, half] : [half, half / aspect];
    Object.assign(this.perspective, { aspect, near, far });
    Object.assign(this.orthographic, { left: -across, right: across, top: up, bottom: -up, near, far });
    for (const camera of [this.perspective, this.orthographic]) camera.updateProjectionMatrix();
    this.draw();
  }

  background(colour) {
    this.shading.background.set(colour).convertLinearToSRGB();
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
    const { body, renderer } = this;
    if (!body) return;
    const { n, spacing } = body.arrangement;
    const isThinned = this.isMoving && !body.isMesh && n > MOVING;
    body.geometry.setDrawRange(0, isThinned && body.arrangement.order ? MOVING : Infinity);
    // Fewer dots are as much larger.
    body.material.uniforms.size.value = body.dot * this.dotFactor * (isThinned ? Math.sqrt(n / MOVING) : 1);
    const fineness = n <= FINE && !this.isMoving && renderer.getPixelRatio() < 2 ? 2 : 1;
    const half = 0.5 * this.frame.clientHeight * renderer.getPixelRatio();
    setHeight(this.solid, half * fineness);
    setHeight(this.over, half);
    const gap = body.isMesh || this.dimension === 2 ? 0 : GAP * spacing;
    this.shading.draw(this.solid, this.camera, { fineness, gap, isShaded: this.isShaded && this.dimension === 3 });
    renderer.render(this.over, this.camera);
    this.changed();
  }

  /** The nearest point in front at a place on the canvas, in pixels, or undefined. */
  pick(x, y) {
    const { body, camera } = this;
    if (!body) return undefined;
    camera.updateMatrixWorld();
    const elements = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).elements;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const view = { places: body.arrangement.places, elements, width, height, key: `${elements} ${width} ${height}` };
    this.picker.prepare(view, this.seen(body));
    // On a dot, or near it if it is small.
    const reach = Math.min(Math.max((0.5 * body.dot * body.arrangement.spacing) / this.pixel(), 10), 40);
    const place = this.picker.at(x, y, reach);
    return place === undefined ? undefined : body.pointAt(place);
  }

  /**
   * Whether a place can be seen: it is neither cut away nor looks away.
   *
   * @param {Body} body
   */
  seen({ arrangement: { places, middle }, geometry, material }) {
    const { box } = this;
    const normals = geometry.attributes.normal.array;
    const { hidesAway, isFlat } = material.uniforms;
    const looksAway = hidesAway.value && !isFlat.value;
    const eye = this.camera.position;
    const isParallel = this.camera === this.orthographic;
    return (place) => {
      const at = 3 * place;
      for (let axis = 0; box && axis < 3; axis++) {
        const x = places[at + axis] + middle[axis];
        if (x < box.low[axis] || x > box.high[axis]) return false;
      }
      if (!looksAway) return true;
      const from = isParallel ? [0, 0, 0] : [places[at], places[at + 1], places[at + 2]];
      const facing =
        normals[at] * (eye.x - from[0]) + normals[at + 1] * (eye.y - from[1]) + normals[at + 2] * (eye.z - from[2]);
      return facing >= 0;
    };
  }

  /** Where a point is on the canvas, in pixels. */
  onCanvas(point) {
    if (!this.body) return [0, 0];
    const at = 3 * this.body.placeOf()(point);
    return this.placeOnCanvas(this.body.arrangement.places.subarray(at, at + 3));
  }

  /**
   * Where a place is on the canvas, in pixels.
   *
   * @param {ArrayLike<number>} of
   */
  placeOnCanvas(of) {
    const place = new Vector3(of[0], of[1], of[2]).project(this.camera);
    return [(0.5 + 0.5 * place.x) * this.canvas.clientWidth, (0.5 - 0.5 * place.y) * this.canvas.clientHeight];
  }

  /** Directions of the axes on the canvas, to the right and down, with the part that points at the viewer. */
  axes() {
    const inverse = this.camera.quaternion.clone().invert();
    return [0, 1, 2].map((axis) => {
      const { x, y, z } = new Vector3().setComponent(axis, 1).applyQuaternion(inverse);
      return [x, -y, z];
    });
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
}

/** Tells the materials of a graph how many pixels half the picture is high. */
function setHeight(graph, pixels) {
  graph.traverse((/** @type {any} */ { material }) => {
    if (material?.uniforms?.height) material.uniforms.height.value = pixels;
  });
}
