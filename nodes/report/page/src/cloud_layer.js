// A layer of points, of which any share can be drawn.

import { BufferAttribute, BufferGeometry, Group, Points } from "three";
import { cloudLook, cloudMaterial } from "./cloud_material.js";

/** Points of one kind. All its blocks share one look; layers of different classes can share their blocks. */
export class CloudLayer {
  constructor(geometries, shared, look) {
    this.look = cloudLook(look);
    this.shared = shared;
    this.group = new Group();
    this.count = 0;
    for (const { block, geometry } of geometries) this.add(block, geometry);
  }

  /** Adds a block; what it returns can be removed. */
  add(block, geometry) {
    const points = new Points(geometry, cloudMaterial(this.shared, this.look, block));
    points.frustumCulled = false;
    points.userData.count = block.count;
    // A geometry that several layers share has the range of the layer that is drawn.
    points.onBeforeRender = () => geometry.setDrawRange(...points.userData.range);
    points.userData.range = [0, block.count];
    this.group.add(points);
    this.count += block.count;
    return points;
  }

  /** Removes a block that no other layer has. */
  remove(points) {
    this.group.remove(points);
    this.count -= points.userData.count;
    points.geometry.dispose();
    points.material.dispose();
  }

  get visible() {
    return this.group.visible;
  }

  set visible(visible) {
    this.group.visible = visible;
  }

  /** Draws from one share of the points to another, 0 to 1, when it is rendered next. */
  setShare(from, to) {
    for (const { userData } of this.group.children) {
      const [first, end] = [from, to].map((share) => Math.floor(share * userData.count));
      userData.range = [first, end - first];
    }
  }
}

/** The blocks of a point set on the graphics card. */
export function geometriesOf(blocks) {
  return blocks.filter((block) => block.count > 0).map((block) => {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(block.positions, 4));
    if (block.tints) geometry.setAttribute("tint", new BufferAttribute(block.tints, 4));
    return { block, geometry };
  });
}
