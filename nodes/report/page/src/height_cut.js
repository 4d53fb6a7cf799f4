// The heights between which the map is shown. It begins below a ceiling, until somebody moves a slider.

import { Plane, Vector3 } from "three";
import { element, slider } from "./dom.js";

/** Slider steps of the cut heights. */
const STEP_M = 0.05;

export class HeightCut {
  /** `uniform` is what the shaders take. */
  constructor(uniform) {
    this.uniform = uniform;
    this.isByHand = false;
    this.belowCeiling_m = null;
    /** The same for materials of three.js: what is on their outer side is not drawn. */
    this.planes = [new Plane(new Vector3(0, 0, 1)), new Plane(new Vector3(0, 0, -1))];
    this.set({});
  }

  set({ low_m = this.uniform.value.x, high_m = this.uniform.value.y }) {
    this.uniform.value.set(low_m, high_m);
    this.planes[0].constant = -low_m;
    this.planes[1].constant = high_m;
  }

  /** Shows what is below this height; all where there is no ceiling, null. Whoever has set a height goes on with it. */
  begin(belowCeiling_m) {
    if (this.isByHand) return;
    this.belowCeiling_m = belowCeiling_m;
    this.set({ high_m: belowCeiling_m ?? 1e6 });
  }

  /** The sliders, from the lowest to the highest of `bounds`. */
  sliders(bounds, changed) {
    const [low, high] = [Math.floor(bounds[0][2] / STEP_M) * STEP_M, Math.ceil(bounds[1][2] / STEP_M) * STEP_M];
    const take = (end) => (value) => {
      this.isByHand = true;
      this.set({ [end]: value });
      changed();
    };
    const metres = (value) => `${value.toFixed(2)} m`;
    const heights = { min: low, max: high, step: STEP_M };
    const isCut = this.belowCeiling_m !== null;
    return [
      slider("Not below", { ...heights, value: low }, take("low_m"), metres),
      slider("Not above", { ...heights, value: isCut ? this.belowCeiling_m : high }, take("high_m"), metres),
      isCut ? element("p", { class: "note" }, "The ceiling is cut off: raise the last one to see it.") : "",
    ];
  }
}
