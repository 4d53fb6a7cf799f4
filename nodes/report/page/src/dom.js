// Elements of the page. Text goes in as text: nothing that a recording names becomes markup.

/** An element with attributes (or properties that start with `on`) and children: elements or texts. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== undefined) made.setAttribute(key, String(value));
  }
  made.append(...children);
  return made;
}

/** A button with a text and what it does. */
export function button(text, onclick, attributes = {}) {
  return element("button", { type: "button", onclick, ...attributes }, text);
}

/** A slider with its name; `onchange` gets the number. */
export function slider(name, { min, max, step, value }, onchange, text = (number) => String(number)) {
  const shown = element("output", {}, text(value));
  const input = element("input", {
    type: "range", min, max, step, value,
    oninput: () => {
      shown.textContent = text(input.valueAsNumber);
      onchange(input.valueAsNumber);
    },
  });
  return element("label", { class: "slider" }, element("span", {}, name), input, shown);
}

/** A choice of one of several values `[value, text]`; `onchange` gets the value. */
export function choice(name, values, chosen, onchange) {
  const select = element("select", { onchange: () => onchange(select.value) },
    ...values.map(([value, text]) => element("option", { value, selected: value === chosen }, text)));
  return element("label", { class: "choice" }, element("span", {}, name), select);
}

/** A number with a comma between its thousands, as the rest of the page has it. */
export function grouped(number) {
  return Math.round(number).toLocaleString("en");
}

/** A colour of the page's style, such as `--accent`, as it is in the current mode. */
export function pageColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
