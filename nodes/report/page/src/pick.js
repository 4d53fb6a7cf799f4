// Which point of the map is under a pixel.

import { Vector3, WebGLRenderTarget } from "three";

/** So many pixels around the pointer are looked at. */
const REACH_PX = 7;

/** The place in the map under the pixel `(x, y)` of a canvas of `width` by `height`; null where there is no point. */
export function pick(picture, camera, x, y, width, height) {
  const size = 2 * REACH_PX + 1;
  const target = new WebGLRenderTarget(size, size);
  const { renderer, shared } = picture;
  const view = camera.clone();
  view.setViewOffset(width, height, x - REACH_PX, y - REACH_PX, size, size);
  const pxPerM = shared.pxPerM.value;
  shared.pxPerM.value = height / (2 * Math.tan((camera.fov * Math.PI) / 360));
  shared.asDepth.value = true;
  for (const layer of picture.layers) layer.setShare(0, 1);
  renderer.setRenderTarget(target);
  renderer.setClearColor("#ffffff", 1);
  renderer.clear();
  renderer.render(picture.clouds, view);
  const pixels = new Uint8Array(4 * size * size);
  renderer.readRenderTargetPixels(target, 0, 0, size, size, pixels);
  renderer.setRenderTarget(null);
  shared.asDepth.value = false;
  shared.pxPerM.value = pxPerM;
  target.dispose();
  return nearestToMiddle(pixels, size, view);
}

function nearestToMiddle(pixels, size, view) {
  let nearest = null;
  for (let row = 0; row < size; row += 1) {
    for (let column = 0; column < size; column += 1) {
      const [r, g, b, a] = pixels.subarray(4 * (row * size + column));
      if (r === 255 && g === 255 && b === 255) continue;
      const depth = r / 255 + g / 255 / 255 + b / 255 / 65025 + a / 255 / 16581375;
      const offset = Math.hypot(row - REACH_PX, column - REACH_PX);
      if (nearest === null || offset < nearest.offset) nearest = { offset, depth, row, column };
    }
  }
  if (nearest === null) return null;
  const onScreen = new Vector3((2 * (nearest.column + 0.5)) / size - 1, (2 * (nearest.row + 0.5)) / size - 1, 2 * nearest.depth - 1);
  return onScreen.unproject(view);
}
