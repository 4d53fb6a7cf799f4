// Walking through the map: drag to look, keys or two fingers to go.

import { Euler, Vector3 } from "three";

/** A slow human pace indoors, and with the shift key held. */
const SPEED_M_PER_S = 1.4;
const FAST = 3;
const LOOK_RAD_PER_PX = 0.004;
const GO_M_PER_PX = 0.012;
const KEYS = {
  KeyW: [0, 1, 0], ArrowUp: [0, 1, 0], KeyS: [0, -1, 0], ArrowDown: [0, -1, 0], KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0],
  KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyE: [0, 0, 1], PageUp: [0, 0, 1], KeyQ: [0, 0, -1], PageDown: [0, 0, -1],
};

export class Walk {
  /** `onchange` is called when there is something to draw. */
  constructor(camera, canvas, onchange) {
    Object.assign(this, { camera, onchange, enabled: false, held: new Set(), fast: false, pointers: new Map() });
    canvas.addEventListener("keydown", (event) => this.key(event, true));
    canvas.addEventListener("keyup", (event) => this.key(event, false));
    canvas.addEventListener("blur", () => this.held.clear());
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.enabled) return;
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, event);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("pointermove", (event) => this.drag(event));
  }

  /** Starts at a place, looking towards another one on a level. */
  start(from_m, towards_m) {
    this.enabled = true;
    this.camera.position.copy(from_m);
    this.camera.lookAt(towards_m.x, towards_m.y, from_m.z);
    this.onchange();
  }

  stop() {
    this.enabled = false;
    this.held.clear();
    this.pointers.clear();
  }

  key(event, pressed) {
    this.fast = event.shiftKey;
    if (!this.enabled || !KEYS[event.code] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (pressed) this.held.add(event.code);
    else this.held.delete(event.code);
    this.onchange();
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!this.enabled || !before) return;
    const [right_px, down_px] = [event.clientX - before.clientX, event.clientY - before.clientY];
    this.pointers.set(event.pointerId, event);
    if (this.pointers.size > 1) this.go(right_px * GO_M_PER_PX * 0.5, -down_px * GO_M_PER_PX, 0);
    else this.look(right_px, down_px);
    this.onchange();
  }

  look(right_px, down_px) {
    // About the map's upright axis first, then up or down.
    const turn = new Euler().setFromQuaternion(this.camera.quaternion, "ZXY");
    turn.z -= right_px * LOOK_RAD_PER_PX;
    turn.x = Math.min(Math.PI - 0.05, Math.max(0.05, turn.x - down_px * LOOK_RAD_PER_PX));
    turn.y = 0;
    this.camera.quaternion.setFromEuler(turn);
  }

  go(right_m, ahead_m, up_m) {
    const ahead = this.camera.getWorldDirection(new Vector3()).setZ(0).normalize();
    const right = new Vector3(ahead.y, -ahead.x, 0);
    this.camera.position.addScaledVector(ahead, ahead_m).addScaledVector(right, right_m);
    this.camera.position.z += up_m;
  }

  /** Goes on for `passed_s`; returns whether a key is held. */
  step(passed_s) {
    if (!this.enabled || this.held.size === 0) return false;
    const length_m = SPEED_M_PER_S * (this.fast ? FAST : 1) * Math.min(passed_s, 0.1);
    for (const code of this.held) this.go(...KEYS[code].map((share) => share * length_m));
    return true;
  }
}
