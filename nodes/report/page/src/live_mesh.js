// The triangles of the map as they come, while the layer is shown: blocks come whole, and those of a tile are drawn at once.

import { BufferAttribute, BufferGeometry, Group, Mesh } from "three";
import { meshMaterial } from "./mesh_layer.js";

/** Blocks along the edge of a tile: 2.6 m at 2 cm. */
const TILE_BLOCKS = 16;
/** A corner without a colour is white. */
const WHITE = 255;

export class LiveMesh {
  /** `wanted` is told whether triangles are asked for: while the layer is shown. */
  constructor(shared, look, wanted) {
    Object.assign(this, { material: meshMaterial(shared, look), wanted, group: new Group(), tiles: new Map(), changed: new Set(), total: 0, refused: 0 });
    this.group.visible = false;
    // Of points.
    this.count = 0;
  }

  get visible() {
    return this.group.visible;
  }

  set visible(visible) {
    if (visible === this.group.visible) return;
    this.group.visible = visible;
    this.clear();
    this.wanted(visible);
  }

  /** A picture of many points takes several frames: triangles are drawn in the first. */
  setShare(from) {
    for (const mesh of this.group.children) mesh.visible = from === 0;
  }

  clear() {
    for (const { mesh } of this.tiles.values()) this.remove(mesh);
    this.tiles.clear();
    this.changed.clear();
    this.total = this.refused = 0;
  }

  remove(mesh) {
    if (!mesh) return;
    this.group.remove(mesh);
    mesh.geometry.dispose();
  }

  /** Takes blocks; `draw` shows them. */
  take({ isFirst, total, refused, blocks }) {
    // Those that were on their way when the layer was switched off.
    if (!this.visible) return;
    if (isFirst) this.clear();
    Object.assign(this, { total, refused });
    for (const block of blocks) {
      const name = block.key.map((along) => Math.floor(along / TILE_BLOCKS)).join(" ");
      if (!this.tiles.has(name)) this.tiles.set(name, { blocks: new Map(), mesh: null });
      const tile = this.tiles.get(name);
      if (block.count === 0) tile.blocks.delete(block.key.join(" "));
      else tile.blocks.set(block.key.join(" "), block);
      this.changed.add(name);
    }
  }

  /** Draws the tiles that have changed. */
  draw() {
    for (const name of this.changed) {
      const tile = this.tiles.get(name);
      this.remove(tile.mesh);
      tile.mesh = null;
      if (tile.blocks.size === 0) this.tiles.delete(name);
      else this.group.add((tile.mesh = new Mesh(geometryOf([...tile.blocks.values()]), this.material)));
    }
    this.changed.clear();
  }
}

function geometryOf(blocks) {
  const corners = blocks.reduce((sum, { count }) => sum + count, 0);
  const positions = new Float32Array(3 * corners);
  const tints = new Uint8Array(3 * corners).fill(WHITE);
  let first = 0;
  for (const { count, origin_m, step_m, steps, colours } of blocks) {
    for (let n = 0; n < 3 * count; n += 1) positions[3 * first + n] = origin_m[n % 3] + steps[n] * step_m;
    colours?.forEach((values, part) => values.forEach((value, n) => (tints[3 * (first + n) + part] = value)));
    first += count;
  }
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("tint", new BufferAttribute(tints, 3, true));
  // Only tiles in view are drawn.
  geometry.computeBoundingSphere();
  return geometry;
}
