// A set of points: blocks of points of 16 bits a coordinate, in an order in which every beginning is spread evenly.

import { Reader, readBlock } from "./payload.js";

/** The golden ratio's part after the point: its multiples are spread evenly. */
const GOLDEN = 0.618033988749895;

/**
 * The blocks of the set `name`: `{origin_m, step_m, count, positions, tints}`. `positions` has x, y, z in steps from the origin, and the
 * moment from which on the point is shown; `tints` has three colours and a class, where the set has them. At most about `most` points
 * are kept.
 */
export async function readPointSet(header, name, most) {
  const set = header.points[name];
  const reader = new Reader(await readBlock(name));
  const total = set.blocks.reduce((sum, block) => sum + block.count, 0);
  const share = Math.min(1, most / Math.max(total, 1));
  return set.blocks.map((block) => readBlockOf(reader, set, block, Math.ceil(block.count * share)));
}

function readBlockOf(reader, set, { origin_m, count }, kept) {
  const read = new Uint16Array(4 * count);
  for (const axis of [0, 1, 2]) reader.differences16(count, read, axis, 4);
  if (set.has.includes("moment")) reader.differences16(count, read, 3, 4);
  const classes = set.has.includes("class") ? reader.take(count) : null;
  const colours = set.has.includes("colour") ? reader.colours(count) : null;

  const positions = new Uint16Array(4 * kept);
  const tints = classes || colours ? new Uint8Array(4 * kept) : null;
  const stride = strideOf(count);
  let from = 0;
  for (let to = 0; to < kept; to += 1) {
    for (let n = 0; n < 4; n += 1) positions[4 * to + n] = read[4 * from + n];
    if (colours) for (let n = 0; n < 3; n += 1) tints[4 * to + n] = colours[n][from];
    if (classes) tints[4 * to + 3] = classes[from];
    from = (from + stride) % count;
  }
  return { origin_m, step_m: set.step_m, count: kept, positions, tints };
}

/** Steps of this length go through all `count` points, and any number of them is spread evenly over the set. */
export function strideOf(count) {
  let stride = Math.max(1, Math.round(count * GOLDEN));
  while (greatestCommonDivisor(stride, count) > 1) stride += 1;
  return stride;
}

function greatestCommonDivisor(one, other) {
  return other === 0 ? one : greatestCommonDivisor(other, one % other);
}
