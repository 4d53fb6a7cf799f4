// Starts the interactive part where the browser can show it. Where it cannot, the page stays as it is: pictures and tables.

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

const place = document.getElementById("viewer");
const header = readHeader();
if (place && header) {
  if (canDraw()) {
    startViewer(place, header).then(
      () => document.documentElement.setAttribute("data-viewer", "ready"),
      (error) => {
        place.textContent = `The 3D view could not be started: ${error.message}`;
        document.documentElement.setAttribute("data-viewer", "failed");
        throw error;
      },
    );
  } else {
    place.textContent = "This browser shows no 3D (WebGL 2); the pictures and tables below show the run.";
    document.documentElement.setAttribute("data-viewer", "none");
  }
}
