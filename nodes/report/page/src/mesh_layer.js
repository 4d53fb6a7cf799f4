// The map as triangles: a layer beside those of points.

import { BufferAttribute, BufferGeometry, GLSL3, Group, Mesh, RawShaderMaterial } from "three";
import { HEIGHT_COLOUR, PACKED_DEPTH } from "./cloud_material.js";
import { Reader, readBlock } from "./payload.js";

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
in vec3 tint;
out vec3 own, inView;
out float height, depth;
void main() {
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * at;
  own = tint;
  inView = at.xyz;
  height = position.z;
  depth = gl_Position.z / gl_Position.w * 0.5 + 0.5;
}`;

// The light is at the eye: a side that is seen aslant is darker.
const FRAGMENT = `
precision highp float;
uniform bool asDepth;
uniform vec2 cut;
uniform int colouring;
in vec3 own, inView;
in float height, depth;
out vec4 pixel;
${HEIGHT_COLOUR}
${PACKED_DEPTH}
void main() {
  if (height < cut.x || height > cut.y) discard;
  vec3 normal = normalize(cross(dFdx(inView), dFdy(inView)));
  float light = 0.35 + 0.65 * abs(dot(normal, normalize(inView)));
  vec3 colour = colouring == 0 ? heightColour(height) : own;
  pixel = asDepth ? packed(depth) : vec4(colour * light, 1.0);
}`;

/** The triangles that the page carries: corners in steps from an origin, and three of them a triangle. */
export async function readMesh({ vertices, triangles, origin_m, step_m, has_colours }) {
  const reader = new Reader(await readBlock("mesh"));
  const steps = new Uint16Array(3 * vertices);
  for (const axis of [0, 1, 2]) reader.differences16(vertices, steps, axis, 3);
  const positions = Float32Array.from(steps, (step, n) => origin_m[n % 3] + step * step_m);
  const tints = new Uint8Array(3 * vertices).fill(255);
  if (has_colours) reader.colours(vertices).forEach((values, part) => values.forEach((value, n) => (tints[3 * n + part] = value)));
  // The least corner of a triangle as the difference to that of the one before it, the others as that to the least.
  const corners = new Uint32Array(3 * triangles);
  let least = 0;
  for (let n = 0; n < triangles; n += 1) corners[3 * n] = least += reader.varint();
  for (const other of [1, 2]) for (let n = 0; n < triangles; n += 1) corners[3 * n + other] = corners[3 * n] + reader.varint();
  const geometry = new BufferGeometry().setIndex(new BufferAttribute(corners, 1));
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("tint", new BufferAttribute(tints, 3, true));
  return geometry;
}

/** What draws triangles in the colours of the points of `look`. */
export function meshMaterial(shared, look) {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: { ...shared, colouring: look.colouring },
  });
}

/**
 * Triangles in the colours of the points of `look`, seen from the side from which the camera saw them: no ceiling hides a room. A picture
 * of many points takes several frames: triangles are drawn in the first.
 */
export class MeshLayer {
  constructor(geometry, shared, look) {
    this.mesh = new Mesh(geometry, meshMaterial(shared, look));
    this.mesh.frustumCulled = false;
    this.group = new Group().add(this.mesh);
    // Of points.
    this.count = 0;
  }

  get visible() {
    return this.group.visible;
  }

  set visible(visible) {
    this.group.visible = visible;
  }

  setShare(from) {
    this.mesh.visible = from === 0;
  }
}
