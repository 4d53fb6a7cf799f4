// Starts the interactive part where the browser can show it. Where it cannot, the page stays as it is: pictures and tables.

import { startLive } from "./live.js";
import { readHeader } from "./payload.js";
import { startViewer } from "./viewer.js";

function canDraw() {
  if (typeof DecompressionStream === "undefined") return false;
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return context !== null;
  } catch {
    return false;
  }
}

/** The pages with a 3D view: where it is, its header, what starts it, and what is shown without it. */
const PAGES = [
  { id: "viewer", name: "scene", start: startViewer, without: "the pictures and tables below show the run." },
  { id: "live", name: "live", start: startLive, without: "there is nothing else to show." },
];

for (const { id, name, start, without } of PAGES) {
  const place = document.getElementById(id);
  const header = readHeader(name);
  if (!place || !header) continue;
  const tell = (state) => document.documentElement.setAttribute("data-viewer", state);
  if (canDraw()) {
    start(place, header).then(
      () => tell("ready"),
      (error) => {
        place.textContent = `The 3D view could not be started: ${error.message}`;
        tell("failed");
        throw error;
      },
    );
  } else {
    place.textContent = `This browser shows no 3D (WebGL 2); ${without}`;
    tell("none");
  }
}
