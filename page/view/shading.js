// @ts-check
// Shading by depth, and the filling of holes between points: what is drawn goes to a texture first.

import {
  AlwaysDepth,
  Color,
  DepthTexture,
  LinearFilter,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PlaneGeometry,
  Scene as Graph,
  ShaderMaterial,
  UnsignedIntType,
  Vector2,
  WebGLRenderTarget,
} from "../vendor/three/three.module.min.js";

/** How dark a place is that lies behind its neighbours. */
const STRENGTH = 0.35;

const VERTEX = `
  varying vec2 place;
  void main() {
    place = uv;
    gl_Position = vec4(position.xy, 0.0, 1.0);
  }
`;

/**
 * Eye-dome lighting (Boucheny 2009): a pixel is darker the farther it lies behind those around it. A pixel
 * that nearly all pixels around it lie in front of, by more than `gap`, is a hole between points, and takes
 * their colour.
 */
const FRAGMENT = `
  uniform sampler2D colour, depths;
  uniform vec2 pixel;
  uniform vec3 background;
  uniform float near, far, gap, strength;
  uniform bool isParallel;
  varying vec2 place;

  float distanceAt(vec2 at) {
    float depth = texture2D(depths, at).r;
    return isParallel ? near + depth * (far - near) : near * far / (far - depth * (far - near));
  }

  void main() {
    float here = distanceAt(place);
    gl_FragDepth = texture2D(depths, place).r;
    bool isEmpty = gl_FragDepth >= 1.0;
    vec3 seen = isEmpty ? background : texture2D(colour, place).rgb;
    float darkness = 0.0, before = 0.0, nearest = 1.0;
    vec3 around = vec3(0.0);
    for (int k = 0; k < 8; k++) {
      float angle = 0.7853982 * float(k);
      vec2 beside = place + vec2(cos(angle), sin(angle)) * pixel;
      darkness += max(0.0, log2(here / distanceAt(beside)));
      vec2 wider = place + 2.0 * vec2(cos(angle), sin(angle)) * pixel;
      if (distanceAt(wider) < here - gap) {
        before += 1.0;
        around += texture2D(colour, wider).rgb;
        nearest = min(nearest, texture2D(depths, wider).r);
      }
    }
    if (gap > 0.0 && before >= 7.0) {
      seen = around / before;
      gl_FragDepth = nearest;
      isEmpty = false;
      darkness = 0.0;
    }
    float light = isEmpty ? 1.0 : exp2(-strength * 40.0 * darkness / 8.0);
    gl_FragColor = vec4(seen * max(light, 0.25), 1.0);
  }
`;

export class Shading {
  /** @param {import("../vendor/three/three.module.min.js").WebGLRenderer} renderer */
  constructor(renderer) {
    this.renderer = renderer;
    this.background = new Color();
    this.target = new WebGLRenderTarget(1, 1, { minFilter: LinearFilter, magFilter: LinearFilter });
    this.target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
    this.target.depthTexture.minFilter = NearestFilter;
    this.target.depthTexture.magFilter = NearestFilter;
    const uniforms = {
      colour: { value: this.target.texture },
      depths: { value: this.target.depthTexture },
      pixel: { value: new Vector2() },
      background: { value: this.background },
      near: { value: 0.1 },
      far: { value: 100 },
      gap: { value: 0 },
      strength: { value: STRENGTH },
      isParallel: { value: false },
    };
    // Whatever the canvas showed before is replaced, with its depths.
    const depth = { depthFunc: AlwaysDepth };
    this.material = new ShaderMaterial({ uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT, ...depth });
    this.square = new Mesh(new PlaneGeometry(2, 2), this.material);
    this.square.frustumCulled = false;
    this.graph = new Graph();
    this.graph.add(this.square);
    this.still = new OrthographicCamera();
  }

  /**
   * Draws a graph, shaded, on the canvas, with its depths.
   *
   * @param {import("../vendor/three/three.module.min.js").Object3D} graph
   * @param {import("../vendor/three/three.module.min.js").OrthographicCamera |
   *   import("../vendor/three/three.module.min.js").PerspectiveCamera} camera
   * @param {{ fineness: number, gap: number, isShaded: boolean }} options pixels of the texture for one of
   *   the canvas along each side, the depth of a hole (0: none is filled), whether depth shades
   */
  draw(graph, camera, { fineness, gap, isShaded }) {
    const { renderer, target } = this;
    const size = renderer.getDrawingBufferSize(new Vector2());
    target.setSize(fineness * size.x, fineness * size.y);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0, 0);
    renderer.clear();
    renderer.render(graph, camera);
    renderer.setRenderTarget(null);
    const { uniforms } = this.material;
    uniforms.pixel.value.set(1 / size.x, 1 / size.y).multiplyScalar(Math.max(1, renderer.getPixelRatio()));
    uniforms.near.value = camera.near;
    uniforms.far.value = camera.far;
    uniforms.isParallel.value = "isParallelCamera" in camera;
    uniforms.gap.value = gap;
    uniforms.strength.value = isShaded ? STRENGTH : 0;
    renderer.render(this.graph, this.still);
  }
}
