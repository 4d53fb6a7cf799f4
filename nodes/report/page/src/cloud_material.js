// How points are drawn: where, how large, in which colour.

import { Color, GLSL3, RawShaderMaterial, Vector2, Vector3 } from "three";

/** The colour of a height, for the shaders of points and triangles. */
export const HEIGHT_COLOUR = `
uniform vec2 heights;
uniform vec3 ramp[5];
vec3 heightColour(float z) {
  float at = clamp((z - heights.x) / max(heights.y - heights.x, 1e-3), 0.0, 1.0) * 4.0;
  int low = min(int(at), 3);
  return mix(ramp[low], ramp[low + 1], at - float(low));
}`;

/** A depth as the four channels of a pixel; `pick.js` reads it. */
export const PACKED_DEPTH = `
vec4 packed(float value) {
  vec4 digits = fract(clamp(value, 0.0, 0.9999999) * vec4(1.0, 255.0, 65025.0, 16581375.0));
  return digits - digits.yzww * vec4(1.0 / 255.0, 1.0 / 255.0, 1.0 / 255.0, 0.0);
}`;

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 origin;
uniform float stepM, moment, sizeM, pxPerM, leastPx;
uniform vec2 cut;
uniform vec3 flatColour;
uniform int colouring, onlyClass;
in vec4 position;
in vec4 tint;
out vec3 colour;
out float depth;
const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);
${HEIGHT_COLOUR}

void main() {
  vec3 inMap = origin + position.xyz * stepM;
  bool hidden = position.w > moment || inMap.z < cut.x || inMap.z > cut.y || (onlyClass >= 0 && int(tint.w) != onlyClass);
  vec4 inView = modelViewMatrix * vec4(inMap, 1.0);
  gl_Position = hidden ? NOWHERE : projectionMatrix * inView;
  gl_PointSize = clamp(sizeM * pxPerM / max(-inView.z, 1e-3), leastPx, 40.0);
  colour = colouring == 0 ? heightColour(inMap.z) : colouring == 1 ? flatColour : tint.rgb / 255.0;
  depth = gl_Position.z / gl_Position.w * 0.5 + 0.5;
}`;

const FRAGMENT = `
precision highp float;
uniform bool asDepth;
in vec3 colour;
in float depth;
out vec4 pixel;
${PACKED_DEPTH}

void main() {
  vec2 fromMiddle = gl_PointCoord - 0.5;
  if (dot(fromMiddle, fromMiddle) > 0.25) discard;
  pixel = asDepth ? packed(depth) : vec4(colour, 1.0);
}`;

/** The ways to colour points, by the shader's number. */
export const COLOURING = { height: 0, flat: 1, own: 2 };

/** What all clouds of the page share: changed in one place, drawn everywhere. */
export function sharedUniforms(header) {
  return {
    cut: { value: new Vector2(-1e6, 1e6) },
    heights: { value: new Vector2(...header.heights_m) },
    ramp: { value: header.height_colours.map(([r, g, b]) => new Vector3(r / 255, g / 255, b / 255)) },
    pxPerM: { value: 1 },
    leastPx: { value: 1 },
    asDepth: { value: false },
  };
}

/** A material of one block of points. `look` is what the layer shares: colouring, size, moment, class. */
export function cloudMaterial(shared, look, block) {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      ...shared,
      ...look,
      origin: { value: new Vector3(...block.origin_m) },
      stepM: { value: block.step_m },
    },
  });
}

/** The look of a layer. */
export function cloudLook({ colouring, colour = "#ffffff", sizeM, onlyClass = -1 }) {
  const { r, g, b } = new Color(colour).convertLinearToSRGB();
  return {
    colouring: { value: colouring },
    flatColour: { value: new Vector3(r, g, b) },
    sizeM: { value: sizeM },
    moment: { value: 65535 },
    onlyClass: { value: onlyClass },
  };
}
