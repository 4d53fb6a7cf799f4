// The tools of the view.

import { button, choice, element, slider } from "./dom.js";

/** The buttons above the view. */
export function toolbar(stage, measure, walkFrom, name) {
  const walk = button("Walk", () => {
    stage.setMode(stage.mode === "walk" ? "orbit" : "walk", walkFrom());
    walk.setAttribute("aria-pressed", stage.mode === "walk");
    stage.canvas.focus();
  }, { "aria-pressed": "false" });
  const measuring = button("Measure", () => {
    measure.enable(!measure.enabled);
    measuring.setAttribute("aria-pressed", measure.enabled);
    if (measure.enabled) stage.canvas.focus();
  }, { "aria-pressed": "false" });
  const view = (text, change) => button(text, () => {
    change();
    walk.setAttribute("aria-pressed", "false");
  });
  return element("div", { class: "tools", role: "toolbar", "aria-label": "View" },
    view("Whole map", () => stage.home()), view("From above", () => stage.above()), walk, measuring,
    button("Picture", () => savePicture(stage, name)),
    button("Full screen", () => (document.fullscreenElement ? document.exitFullscreen() : stage.canvas.closest(".viewer").requestFullscreen())));
}

function savePicture(stage, name) {
  stage.canvas.toBlob((blob) => {
    const address = URL.createObjectURL(blob);
    element("a", { href: address, download: `${name.replace(/[^\w.-]+/g, "_").slice(0, 60)}.png` }).click();
    URL.revokeObjectURL(address);
  });
}

/** Colours, size of the points, heights. */
export function settings(stage, heightCut, layers, bounds, hasColour) {
  const changed = () => stage.changed();
  const spacings = layers.map((layer) => layer.look.sizeM.value);
  const resize = (factor) => {
    layers.forEach((layer, n) => (layer.look.sizeM.value = spacings[n] * factor));
    changed();
  };
  const colour = (value) => {
    layers[0].look.colouring.value = Number(value);
    changed();
  };
  return element("fieldset", { class: "settings" }, element("legend", {}, "Points"),
    hasColour ? choice("Colour", [["2", "as seen"], ["0", "by height"]], "2", colour) : "",
    slider("Size", { min: 0.25, max: 4, step: 0.25, value: 1 }, resize, (value) => `${value} ×`),
    ...heightCut.sliders(bounds, changed));
}
