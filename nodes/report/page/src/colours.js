// The colours of what is drawn on a dark ground. Tracks have those of Okabe and Ito, which the colour-blind tell apart.

export const COLOURS = {
  path: "#ffffff",
  frustum: "#f0e442",
  zone: "#c39bff",
  held: "#8f7bb0",
  scan: "#5fdcae",
  fixed: "#9fb4cc",
  moving: "#ff7a2d",
  grid: "#2c3644",
  soft: "#9aa7b8",
};

const TRACKS = ["#56b4e9", "#f0e442", "#cc79a7", "#009e73", "#e69f00", "#d55e00", "#7fa8ff"];

/** The colour of a track. */
export function trackColour(id) {
  return TRACKS[id % TRACKS.length];
}
