// Camera, controls and the loop of frames. Frames are drawn when something has changed, and not otherwise: the canvas has `data-rests` where
// the picture is whole and of what the page was told last.

import { Box3, Matrix4, PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Picture } from "./picture.js";
import { Walk } from "./walk.js";

/** How much of the view the box around the map fills. */
const FILLED_SHARE = 0.95;
/** The whole map is looked at with this slope: 33 degrees downwards. */
const HOME_SLOPE = 0.65;
/** A standing person's eyes above the floor. */
const EYE_M = 1.6;
const FIELD_OF_VIEW_DEG = 55;

export class Stage {
  /**
   * `bounds` are those of the map: `[[x, y, z], [x, y, z]]` in metres. `towards` is the direction, on a level, in which the whole map is
   * looked at.
   */
  constructor(canvas, bounds, towards, isPhone, shared, onframe) {
    this.towards = towards;
    this.canvas = canvas;
    this.onframe = onframe;
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.05, 1);
    this.camera.up.set(0, 0, 1);
    this.picture = new Picture(canvas, isPhone, shared);
    this.orbit = new OrbitControls(this.camera, canvas);
    Object.assign(this.orbit, { enableDamping: true, dampingFactor: 0.12, minDistance: 0.1, screenSpacePanning: true });
    this.setBounds(bounds);
    this.orbit.listenToKeyEvents(canvas);
    this.orbit.keyPanSpeed = 20;
    this.orbit.addEventListener("change", () => this.wake(true));
    this.walk = new Walk(this.camera, canvas, () => this.wake(true));
    this.moved = false;
    this.frame = null;
    this.last_ms = null;
    this.home();
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  /** The map has these bounds now; the view stays. */
  setBounds(bounds) {
    this.box = new Box3(new Vector3(...bounds[0]), new Vector3(...bounds[1]));
    this.size_m = Math.max(1, this.box.getSize(new Vector3()).length());
    this.camera.far = 12 * this.size_m;
    this.camera.updateProjectionMatrix();
    this.orbit.maxDistance = 6 * this.size_m;
  }

  get mode() {
    return this.walk.enabled ? "walk" : "orbit";
  }

  /** Looks at the middle of the map from where all of it is in view, `from` being the direction from there. */
  showAll(from) {
    this.setMode("orbit");
    const middle = this.box.getCenter(new Vector3());
    const half = this.box.getSize(new Vector3()).multiplyScalar(0.5);
    const up = FILLED_SHARE * Math.tan((this.camera.fov * Math.PI) / 360);
    const axes = new Matrix4().lookAt(from, new Vector3(), this.camera.up).invert();
    let distance_m = 0;
    for (let corner = 0; corner < 8; corner += 1) {
      const { x, y, z } = half.clone().multiply(new Vector3(...[1, 2, 4].map((bit) => (corner & bit ? 1 : -1)))).applyMatrix4(axes);
      distance_m = Math.max(distance_m, z + Math.abs(y) / up, z + Math.abs(x) / (up * this.camera.aspect));
    }
    this.orbit.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(from.clone().normalize(), distance_m);
    this.orbit.update();
    this.wake(true);
  }

  /** The view of the whole map, from above and behind. */
  home() {
    this.showAll(this.towards.clone().negate().setZ(HOME_SLOPE));
  }

  /** The view from straight above. */
  above() {
    this.showAll(new Vector3(0, -0.0001, 1));
  }

  /** Turns about the upright axis by an angle. */
  turn(angle_rad) {
    this.setMode("orbit");
    const offset = this.camera.position.clone().sub(this.orbit.target).applyAxisAngle(new Vector3(0, 0, 1), angle_rad);
    this.camera.position.copy(this.orbit.target).add(offset);
    this.orbit.update();
    this.wake(true);
  }

  /** Orbit, or walk from `from_m`, looking to the middle of the map. */
  setMode(mode, from_m = null) {
    if (mode === this.mode) return;
    if (mode === "walk") {
      this.orbit.enabled = false;
      const middle = this.box.getCenter(new Vector3());
      const eye_m = from_m ? new Vector3(...from_m) : new Vector3(middle.x, middle.y, this.box.min.z + EYE_M);
      const ahead = eye_m.distanceTo(middle) > 0.5 ? middle : new Vector3(eye_m.x + 1, eye_m.y, eye_m.z);
      this.walk.start(eye_m, ahead);
    } else {
      this.walk.stop();
      this.orbit.enabled = true;
      this.orbit.target.copy(this.camera.getWorldDirection(new Vector3()).multiplyScalar(2).add(this.camera.position));
      this.orbit.update();
    }
  }

  fit() {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0) return;
    this.picture.resize(clientWidth, clientHeight, this.camera);
    this.wake(false);
  }

  /** Something is to be drawn anew. */
  changed() {
    this.picture.restart();
    this.wake(false);
  }

  wake(moved) {
    this.moved ||= moved;
    delete this.canvas.dataset.rests;
    this.frame ??= requestAnimationFrame((now_ms) => this.draw(now_ms));
  }

  draw(now_ms) {
    this.frame = null;
    const passed_s = this.last_ms === null ? 0 : (now_ms - this.last_ms) / 1000;
    this.last_ms = now_ms;
    const { moved } = this;
    this.moved = false;
    if (this.orbit.enabled) this.orbit.update();
    const walks = this.walk.step(passed_s);
    this.picture.draw(this.camera, moved || walks, now_ms);
    this.onframe(moved || walks);
    if (walks || this.moved || !this.picture.isComplete) this.wake(walks);
    else {
      this.last_ms = null;
      this.canvas.dataset.rests = "";
    }
  }
}
