// The list of layers with their switches.

import { element, grouped } from "./dom.js";

/** A switch of a layer. `layer` has `name`, `colour`, `count` (or none), `note`, `shown`, and `show(visible)`. */
export function layerSwitch(layer, onchange) {
  const input = element("input", {
    type: "checkbox", checked: layer.shown,
    "data-layer": layer.id,
    onchange: () => {
      layer.show(input.checked);
      onchange();
    },
  });
  const key = element("span", { class: "key dots", "aria-hidden": "true" });
  key.style.background = layer.colour;
  const count = layer.count === undefined ? "" : ` (${grouped(layer.count)})`;
  layer.show(layer.shown);
  return element("label", { class: "layer", title: layer.note ?? "" }, input, key, `${layer.name}${count}`);
}

/** The layers in groups `{title, layers}`. */
export function layerList(groups, onchange) {
  return element("div", { class: "layers" }, ...groups.filter(({ layers }) => layers.length > 0).map(({ title, layers }) =>
    element("fieldset", {}, element("legend", {}, title), ...layers.map((layer) => layerSwitch(layer, onchange)))));
}
