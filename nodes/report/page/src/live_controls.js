// What can be asked of the nodes, and what they say of themselves.

import { button, element, grouped } from "./dom.js";

/** What DiagnosticStatus calls its levels, with the style of each. */
const LEVELS = [["ok", "good"], ["warning", "warn"], ["error", "bad"], ["stale", "bad"]];
/** A node that is not heard for longer has gone: it reports once a second. */
const GONE_S = 5;

/** The buttons that call the services of the nodes; `show` gets the state. */
export function commands(connection) {
  const result = element("p", { class: "command-result", role: "status" });
  const run = (text, command, question) => button(text, async (event) => {
    if (question && !confirm(question)) return;
    const pressed = event.currentTarget;
    pressed.disabled = true;
    result.textContent = `${text} ...`;
    result.className = "command-result";
    try {
      result.textContent = await connection.ask(typeof command === "function" ? command() : command);
    } catch (error) {
      result.textContent = error.message;
      result.classList.add("bad");
    }
    pressed.disabled = false;
  });
  let isPaused = false;
  const pause = run("Pause detection", () => ({ do: isPaused ? "resume" : "pause" }));
  pause.title = "Deactivates the node detection (lifecycle): no more cycles, and the map stays as it is";
  const show = ({ nodes, detection }) => {
    const node = nodes.find(({ name }) => name === detection);
    const state = node?.figures.find(([key]) => key === "state")?.[1];
    isPaused = state !== undefined && state !== "active";
    pause.textContent = isPaused ? "Resume detection" : "Pause detection";
  };
  const bar = element("div", { class: "time-line", role: "group", "aria-label": "Commands" },
    run("Save map", { do: "save_map" }), run("Empty map", { do: "reset" }, "Empty the map? What is not saved is lost."), pause, result);
  return { element: bar, show };
}

/** The nodes with their state, rates and losses. */
export class Nodes {
  constructor() {
    this.body = element("tbody");
    this.details = new Map();
    this.figures = element("div", { class: "figures" });
    const head = ["node", "state", "says", "cycles / s", "dropped, lost"];
    this.element = element("section", { "aria-labelledby": "nodes" }, element("h2", { id: "nodes" }, "Nodes"),
      element("div", { class: "scroll", tabindex: "0" }, element("table", { class: "nodes" },
        element("thead", {}, element("tr", {}, ...head.map((text, n) => element("th", { scope: "col", class: n < 3 ? "text" : "" }, text)))), this.body)),
      this.figures);
  }

  show({ nodes }) {
    this.body.replaceChildren(...nodes.map((node) => {
      const [level, style] = node.age_s > GONE_S ? [`silent for ${node.age_s} s`, "bad"] : LEVELS[node.level] ?? LEVELS[2];
      const figure = (key) => node.figures.find(([name]) => name === key)?.[1] ?? "";
      const lost = node.figures.filter(([key]) => /^(dropped:|lost|malformed) /.test(key)).reduce((sum, [, value]) => sum + (Number(value) || 0), 0);
      return element("tr", {}, element("th", { scope: "row" }, node.name), element("td", { class: `text ${style}` }, level),
        element("td", { class: "text says" }, node.message), element("td", {}, figure("cycles per second")), element("td", {}, grouped(lost)));
    }));
    const names = new Set(nodes.map(({ name }) => name));
    for (const [name, { details }] of this.details) if (!names.has(name)) details.remove(), this.details.delete(name);
    for (const node of nodes) this.showFigures(node);
  }

  showFigures({ name, figures }) {
    if (!this.details.has(name)) {
      const body = element("tbody");
      const details = element("details", {}, element("summary", {}, `All figures of ${name}`), element("div", { class: "scroll", tabindex: "0" }, element("table", {}, body)));
      this.details.set(name, { details, body });
      this.figures.append(details);
    }
    const { details, body } = this.details.get(name);
    if (!details.open && body.childElementCount > 0) return;
    body.replaceChildren(...figures.map(([key, value]) =>
      element("tr", {}, element("th", { scope: "row" }, key), element("td", { class: "text" }, value))));
  }
}

/** The parameters of the nodes, read when they are asked for. */
export function parameters(connection) {
  const list = element("div");
  const note = element("p", { class: "note", role: "status" });
  const load = button("Read the parameters", async () => {
    load.disabled = true;
    note.textContent = "Reading ...";
    try {
      const nodes = await connection.ask({ do: "parameters" });
      list.replaceChildren(...nodes.map((node) => ofNode(node, connection, note)));
      note.textContent = "";
    } catch (error) {
      note.textContent = error.message;
    }
    load.disabled = false;
  });
  return element("section", { "aria-labelledby": "parameters" }, element("h2", { id: "parameters" }, "Parameters"),
    element("div", { class: "viewer-buttons" }, load), note, list);
}

function ofNode({ node, parameters: declared, error }, connection, note) {
  if (error) return element("p", { class: "note" }, `${node}: ${error}`);
  const rows = declared.map((one) => element("tr", {}, element("th", { scope: "row" }, one.name),
    element("td", {}, one.fixed ? shown(one.value) : entry(node, one, connection, note)),
    element("td", { class: "text about" }, one.accepted ? `${one.about} (${one.accepted})` : one.about)));
  return element("details", { class: "parameters" }, element("summary", {}, node),
    element("div", { class: "scroll", tabindex: "0" }, element("table", {}, element("tbody", {}, ...rows))));
}

function shown(value) {
  return typeof value === "string" ? value || "\u201c\u201d" : JSON.stringify(value);
}

/** A value that can be changed: text as it is, all else as JSON. */
function entry(node, { name, value }, connection, note) {
  const isText = typeof value === "string";
  const input = element("input", { type: "text", value: isText ? value : JSON.stringify(value), "aria-label": `${node} ${name}`, spellcheck: "false" });
  const set = async (event) => {
    event.preventDefault();
    try {
      const wanted = isText ? input.value : JSON.parse(input.value);
      note.textContent = await connection.ask({ do: "set", node, name, value: wanted });
    } catch (error) {
      note.textContent = `${node}: ${name}: ${error.message}`;
    }
  };
  return element("form", { class: "entry", onsubmit: set }, input, element("button", { type: "submit" }, "Set"));
}
