// Measures the distance of two points of the map.

import { BufferAttribute, BufferGeometry, Group, Line, LineBasicMaterial, Points, PointsMaterial } from "three";
import { pick } from "./pick.js";

/** A press that moves the pointer farther is no click. */
const CLICK_PX = 5;
const COLOUR = "#ff4fa3";

export class Measure {
  /** `tell` gets the text of the result. */
  constructor(stage, tell) {
    Object.assign(this, { stage, tell, enabled: false, ends: [], group: new Group() });
    stage.picture.overlay.add(this.group);
    let pressed = null;
    stage.canvas.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
    stage.canvas.addEventListener("pointerup", (event) => {
      if (!this.enabled || !pressed) return;
      if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) <= CLICK_PX) this.take(event.clientX, event.clientY);
    });
  }

  enable(enabled) {
    this.enabled = enabled;
    this.ends = [];
    this.draw();
    this.tell(enabled ? "Choose the first point, or press Enter to take the middle of the picture." : "");
  }

  /** Takes the point in the middle of the picture: for the keyboard. */
  takeMiddle() {
    const box = this.stage.canvas.getBoundingClientRect();
    this.take(box.left + box.width / 2, box.top + box.height / 2);
  }

  take(clientX, clientY) {
    const { canvas, picture, camera } = this.stage;
    const box = canvas.getBoundingClientRect();
    const at_m = pick(picture, camera, clientX - box.left, clientY - box.top, box.width, box.height);
    if (at_m) this.ends = [...(this.ends.length === 2 ? [] : this.ends), at_m];
    this.draw();
    this.tell(at_m ? this.text() : "There is no point here.");
  }

  text() {
    const [one, other] = this.ends;
    const place = (at) => `(${at.x.toFixed(2)}, ${at.y.toFixed(2)}, ${at.z.toFixed(2)}) m`;
    if (!other) return `From ${place(one)}. Choose the second point.`;
    const level_m = Math.hypot(other.x - one.x, other.y - one.y);
    return `${one.distanceTo(other).toFixed(3)} m (${level_m.toFixed(3)} m on the level, ${Math.abs(other.z - one.z).toFixed(3)} m in height)`;
  }

  draw() {
    this.group.clear();
    if (this.ends.length > 0) {
      const places = new Float32Array(this.ends.flatMap((end) => end.toArray()));
      const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(places, 3));
      const points = new Points(geometry, new PointsMaterial({ color: COLOUR, size: 10, sizeAttenuation: false, depthTest: false }));
      const line = new Line(geometry, new LineBasicMaterial({ color: COLOUR, depthTest: false }));
      for (const drawn of [points, line]) drawn.frustumCulled = false;
      this.group.add(points, line);
    }
    this.stage.changed();
  }
}
