// The map as it grows: blocks come whole, and those of a tile are drawn at once.

import { BufferAttribute, BufferGeometry } from "three";
import { strideOf } from "./point_set.js";

/** Points that tell how large the map is, at most. */
const SAMPLES = 20_000;
/** Share of the points beyond each end of an axis that do not decide how large the map is, as in the report. */
const OUTLIER_SHARE = 0.005;
/** The parts of the colour of points that came without one, as the others that none was seen of have it: drawn_colour in payload.rs. */
const UNSEEN = 110;

export class LiveMap {
  /** `layer` draws the points. */
  constructor(layer) {
    Object.assign(this, { layer, tiles: new Map(), epoch: null, voxel_m: null, hasColours: false, total: 0, changed: new Set() });
  }

  clear() {
    for (const tile of this.tiles.values()) if (tile.points) this.layer.remove(tile.points);
    this.tiles.clear();
    this.changed.clear();
  }

  /** Takes blocks; `draw` shows them. */
  take({ epoch, voxel_m, block_m, step_m, tileBlocks, hasColours, total, blocks }) {
    if (epoch !== this.epoch) this.clear();
    // What was drawn without colours is drawn again with them.
    if (hasColours !== this.hasColours) for (const name of this.tiles.keys()) this.changed.add(name);
    Object.assign(this, { epoch, voxel_m, total, hasColours });
    for (const { key, count, steps, colours } of blocks) {
      const place = key.map((along) => Math.floor(along / tileBlocks));
      const name = place.join(" ");
      if (!this.tiles.has(name)) {
        const origin_m = place.map((along) => along * tileBlocks * block_m);
        this.tiles.set(name, { origin_m, step_m, blocks: new Map(), points: null });
      }
      const tile = this.tiles.get(name);
      if (count === 0) tile.blocks.delete(key.join(" "));
      else tile.blocks.set(key.join(" "), { count, steps, colours });
      this.changed.add(name);
    }
  }

  /** Draws the tiles that have changed. */
  draw() {
    for (const name of this.changed) {
      const tile = this.tiles.get(name);
      if (tile.points) this.layer.remove(tile.points);
      tile.points = null;
      if (tile.blocks.size === 0) this.tiles.delete(name);
      else tile.points = this.layer.add(...drawable(tile, this.hasColours));
    }
    this.changed.clear();
  }

  /** The corners of the map without its outliers, and the heights of some of its points; null of an empty map. */
  bounds() {
    const every = Math.max(1, Math.ceil(this.layer.count / SAMPLES));
    const axes = [[], [], []];
    let n = 0;
    for (const { origin_m, step_m, blocks } of this.tiles.values()) {
      for (const { count, steps } of blocks.values()) {
        for (let point = 0; point < count; point += 1, n += 1) {
          if (n % every !== 0) continue;
          axes.forEach((values_m, axis) => values_m.push(origin_m[axis] + steps[3 * point + axis] * step_m));
        }
      }
    }
    if (axes[0].length === 0) return null;
    const ends = axes.map((values_m) => {
      values_m.sort((one, other) => one - other);
      const outliers = Math.floor((values_m.length - 1) * OUTLIER_SHARE);
      return [values_m[outliers], values_m.at(-1 - outliers)];
    });
    return { corners_m: [0, 1].map((end) => ends.map((axis) => axis[end])), heights_m: axes[2] };
  }
}

/** A block for the layer with its geometry: all points of a tile, in an order in which every beginning is spread evenly. */
function drawable({ origin_m, step_m, blocks }, hasColours) {
  const count = [...blocks.values()].reduce((sum, block) => sum + block.count, 0);
  const positions = new Uint16Array(4 * count);
  const tints = hasColours ? new Uint8Array(4 * count) : null;
  const stride = strideOf(count);
  let to = 0;
  for (const { count: inBlock, steps, colours } of blocks.values()) {
    for (let point = 0; point < inBlock; point += 1) {
      for (let axis = 0; axis < 3; axis += 1) positions[4 * to + axis] = steps[3 * point + axis];
      if (tints) for (let part = 0; part < 3; part += 1) tints[4 * to + part] = colours ? colours[part][point] : UNSEEN;
      to = (to + stride) % count;
    }
  }
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(positions, 4));
  if (tints) geometry.setAttribute("tint", new BufferAttribute(tints, 4));
  return [{ origin_m, step_m, count }, geometry];
}
