// The picture on the canvas: clouds first, bit by bit and shaded at their edges; lines and surfaces over them.
//
// A picture of many points is made over several frames: while the view moves, each frame shows an evenly spread share of
// the points, as many as the machine draws in time, the larger the fewer they are; when it rests, each frame adds a share until all are there.

import {
  Color, DepthTexture, GLSL3, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, RawShaderMaterial, Scene, UnsignedIntType,
  Vector2, WebGLRenderTarget, WebGLRenderer,
} from "three";
import { Detail } from "./detail.js";

/** The background in both modes of the page: the colours of the points are made for it. */
const BACKGROUND = "#0f141b";
/** Where points are left out those that are drawn would cover this share of the picture, were they spread evenly; and have no more pixels each. */
const COVERED_SHARE = 0.5;
const MOST_LEAST_PX = 5;
/** Edges are shaded unless frames take so long. */
const SLOW_MS = 45;
/** How dark edges are. */
const SHADE_STRENGTH = 1.1;

const SHADE_VERTEX = `
precision highp float;
in vec3 position;
out vec2 at;
void main() { at = position.xy * 0.5 + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }`;

// Eye-dome lighting (Boucheny 2009): a pixel is the darker, the farther it lies behind its neighbours.
const SHADE_FRAGMENT = `
precision highp float;
uniform sampler2D colours;
uniform highp sampler2D depths;
uniform vec2 pixel;
uniform vec3 background;
uniform float near, far, strength;
in vec2 at;
out vec4 shaded;
float logDepth(vec2 where) {
  float depth = texture(depths, where).r;
  return depth >= 1.0 ? log2(far) : log2(near * far / (far - depth * (far - near)));
}
void main() {
  float depth = texture(depths, at).r;
  gl_FragDepth = depth;
  if (depth >= 1.0) { shaded = vec4(background, 1.0); return; }
  if (strength == 0.0) { shaded = vec4(texture(colours, at).rgb, 1.0); return; }
  float own = logDepth(at);
  float behind = 0.0;
  for (int n = 0; n < 4; n += 1) {
    vec2 towards = n == 0 ? vec2(1, 0) : n == 1 ? vec2(-1, 0) : n == 2 ? vec2(0, 1) : vec2(0, -1);
    behind += max(0.0, own - logDepth(at + towards * pixel * 1.5));
  }
  shaded = vec4(texture(colours, at).rgb * exp(-strength * min(behind, 2.0)), 1.0);
}`;

export class Picture {
  constructor(canvas, isPhone, shared) {
    this.renderer = new WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
    this.renderer.autoClear = false;
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, isPhone ? 1.5 : 2));
    this.shared = shared;
    this.clouds = new Scene();
    this.overlay = new Scene();
    this.layers = [];
    this.detail = new Detail(isPhone);
    this.share = 0;
    this.target = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
    this.target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
    this.shade = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: SHADE_VERTEX, fragmentShader: SHADE_FRAGMENT, depthTest: true, depthWrite: true,
      uniforms: {
        colours: { value: this.target.texture }, depths: { value: this.target.depthTexture }, pixel: { value: new Vector2() },
        background: { value: rgbOf(BACKGROUND) }, near: { value: 0.1 }, far: { value: 100 }, strength: { value: SHADE_STRENGTH },
      },
    });
    this.shade.depthFunc = 1; // always
    this.screen = new Scene().add(new Mesh(new PlaneGeometry(2, 2), this.shade));
    this.screen.children[0].frustumCulled = false;
    this.flat = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  }

  addLayer(layer) {
    this.layers.push(layer);
    this.clouds.add(layer.group);
    this.restart();
  }

  /** All points of the layers that are shown. */
  get total() {
    return this.layers.reduce((sum, layer) => sum + (layer.visible ? layer.count : 0), 0);
  }

  resize(width, height, camera) {
    const ratio = this.renderer.getPixelRatio();
    this.renderer.setSize(width, height, false);
    this.target.setSize(Math.max(1, Math.floor(width * ratio)), Math.max(1, Math.floor(height * ratio)));
    this.shade.uniforms.pixel.value.set(1 / this.target.width, 1 / this.target.height);
    camera.aspect = width / Math.max(height, 1);
    camera.updateProjectionMatrix();
    this.restart();
  }

  /** What was drawn is out of date. */
  restart() {
    this.share = 0;
  }

  get isComplete() {
    return this.share >= 1;
  }

  /** Draws a frame at `now_ms`: the first share of the points if the view `moved`, else one more. */
  draw(camera, moved, now_ms) {
    this.detail.begin(moved, now_ms, this.total);
    const leastPx = moved ? this.leastPx(this.detail.points(true)) : 1;
    // At rest the larger points are not to stay among the others.
    if (moved || this.shared.leastPx.value > leastPx) this.restart();
    this.shared.leastPx.value = leastPx;
    this.shared.pxPerM.value = this.target.height / (2 * Math.tan((camera.fov * Math.PI) / 360));
    // A machine that is slow all the same draws no edges meanwhile.
    this.shade.uniforms.strength.value = moved && this.detail.frame_ms > SLOW_MS ? 0 : SHADE_STRENGTH;
    if (this.share < 1) this.drawShare(camera, this.detail.points(moved));
    this.compose(camera);
    if (!moved && this.isComplete) this.detail.pause();
  }

  drawShare(camera, points) {
    const { renderer } = this;
    renderer.setRenderTarget(this.target);
    if (this.share === 0) {
      renderer.setClearColor(BACKGROUND, 1);
      renderer.clear();
    }
    const { total } = this;
    const next = Math.min(1, this.share + points / Math.max(total, 1));
    this.detail.drew((next - this.share) * total);
    for (const layer of this.layers) layer.setShare(this.share, next);
    renderer.render(this.clouds, camera);
    renderer.setRenderTarget(null);
    this.share = next;
  }

  compose(camera) {
    this.shade.uniforms.near.value = camera.near;
    this.shade.uniforms.far.value = camera.far;
    this.renderer.clear();
    this.renderer.render(this.screen, this.flat);
    this.renderer.render(this.overlay, camera);
  }

  /** The least size of points of which so many are drawn in a frame. */
  leastPx(points) {
    if (points >= this.total) return 1;
    const covering_px = Math.sqrt((COVERED_SHARE * this.target.width * this.target.height) / points);
    return Math.min(Math.max(1, covering_px), MOST_LEAST_PX * this.renderer.getPixelRatio());
  }
}

function rgbOf(colour) {
  return new Color(colour).convertLinearToSRGB();
}
