// The picture on the canvas: clouds first, bit by bit and shaded at their edges; lines and surfaces over them.
//
// A picture of many points is made over several frames: while the view moves, each frame shows an evenly spread share of
// the points, as many as the machine draws in time; when it rests, each frame adds a share until all are there.

import {
  Color, DepthTexture, GLSL3, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, RawShaderMaterial, Scene, UnsignedIntType,
  Vector2, WebGLRenderTarget, WebGLRenderer,
} from "three";

/** The background in both modes of the page: the colours of the points are made for it. */
const BACKGROUND = "#0f141b";
/** A frame of a moving view may take so long: 20 frames a second and 50. */
const SLOW_MS = 45;
const FAST_MS = 22;
/** Points a frame of a moving view: at first, on a phone at first, and the least. */
const POINTS_AT_FIRST = 500_000;
const POINTS_AT_FIRST_ON_PHONE = 150_000;
const LEAST_POINTS = 60_000;
/** Points a frame of a view that rests, at least: a frame may take longer then. */
const POINTS_AT_REST = 500_000;
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
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, isPhone ? 1.5 : 2));
    this.shared = shared;
    this.clouds = new Scene();
    this.overlay = new Scene();
    this.layers = [];
    this.budget = isPhone ? POINTS_AT_FIRST_ON_PHONE : POINTS_AT_FIRST;
    this.share = 0;
    this.frameMs = 0;
    this.lastMoved = null;
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
    if (moved) {
      this.adapt(now_ms);
      this.restart();
    } else {
      this.lastMoved = null;
    }
    this.shared.pxPerM.value = this.target.height / (2 * Math.tan((camera.fov * Math.PI) / 360));
    // A machine that is slow all the same draws no edges meanwhile.
    this.shade.uniforms.strength.value = moved && this.frameMs > SLOW_MS ? 0 : SHADE_STRENGTH;
    if (this.share < 1) this.drawShare(camera, moved ? this.budget : Math.max(this.budget, POINTS_AT_REST));
    this.compose(camera);
  }

  drawShare(camera, points) {
    const { renderer } = this;
    renderer.setRenderTarget(this.target);
    if (this.share === 0) {
      renderer.setClearColor(BACKGROUND, 1);
      renderer.clear();
    }
    const next = Math.min(1, this.share + points / Math.max(this.total, 1));
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

  /** As many points a frame as keep the view's motion smooth. */
  adapt(now_ms) {
    const last = this.lastMoved;
    this.lastMoved = now_ms;
    if (last === null) return;
    const took_ms = now_ms - last;
    this.frameMs = this.frameMs === 0 ? took_ms : 0.7 * this.frameMs + 0.3 * took_ms;
    if (took_ms > SLOW_MS) this.budget = Math.max(LEAST_POINTS, this.budget * 0.7);
    else if (took_ms < FAST_MS && this.budget < this.total) this.budget *= 1.1;
  }
}

function rgbOf(colour) {
  return new Color(colour).convertLinearToSRGB();
}
