// The live view's map, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";
import { LiveMap } from "../src/live_map.js";

/** A layer that keeps what is drawn. */
function keeping() {
  const drawn = new Set();
  return { drawn, add: (block, geometry) => (drawn.add(geometry), geometry), remove: (geometry) => drawn.delete(geometry) };
}

// Regression: what came before the first coloured cloud was black for good, where the report has gray.
test("points that came before the first colours are gray", () => {
  const layer = keeping();
  const map = new LiveMap(layer);
  const message = { epoch: 1, voxel_m: 0.02, block_m: 0.32, step_m: 0.001, tileBlocks: 4, total: 2 };
  const block = (x, colours) => ({ key: [x, 0, 0], count: 1, steps: [1, 2, 3], colours });
  map.take({ ...message, hasColours: false, blocks: [block(0, null), block(8, null)] });
  map.draw();
  assert.deepEqual([...layer.drawn].map((geometry) => geometry.hasAttribute("tint")), [false, false]);
  map.take({ ...message, hasColours: true, blocks: [block(8, [[10], [20], [30]])] });
  map.draw();
  const tints = [...layer.drawn].map((geometry) => [...geometry.getAttribute("tint").array.slice(0, 3)]);
  assert.deepEqual(tints.sort(), [[10, 20, 30], [110, 110, 110]].sort());
});
