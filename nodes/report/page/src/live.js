// The live view: the map as it grows, the latest cycle, the state of the nodes.

import { Vector3 } from "three";
import { belowCeiling_m } from "./ceiling.js";
import { CloudLayer } from "./cloud_layer.js";
import { COLOURING, sharedUniforms } from "./cloud_material.js";
import { element, grouped } from "./dom.js";
import { HeightCut } from "./height_cut.js";
import { layerList } from "./layers.js";
import { Connection } from "./live_connection.js";
import { commands, Nodes, parameters } from "./live_controls.js";
import { LiveMap } from "./live_map.js";
import { LiveMesh } from "./live_mesh.js";
import { KINDS, openMessage, readMap, readMoment, readStatus, readTriangles } from "./live_messages.js";
import { Measure } from "./measure.js";
import { Overlay } from "./overlay.js";
import { Panels } from "./panels.js";
import { Stage } from "./stage.js";
import { settings, toolbar } from "./toolbar.js";
import { help, HEIGHTS_KEY, layerGroups, sceneCanvas, sceneKey, SIZE_IN_SPACINGS } from "./viewer.js";

/** Before there is a map: a room. */
const FIRST_BOUNDS_M = [[-3, -3, 0], [3, 3, 2.5]];
const FIRST_SPACING_M = 0.05;
/** Cycles whose tracks leave a trail: half a minute of a scanner. */
const TRAIL_CYCLES = 200;
/** Places of the path that are kept; then every other one goes. */
const PATH_PLACES = 4_000;
/** The picture of the map is made anew once in this time while it changes. */
const DRAW_MS = 200;
/** How far the map's bounds must move until the whole map is shown anew. */
const GROWN_M = 0.4;
/** The heights that can be cut reach so far beyond the map: it grows. */
const BEYOND_M = 2;

const STATES = {
  connecting: "connecting", connected: "connected",
  lost: "no connection: the program has ended or is not reached, or it has another token by now; trying again", resting: "resting: nobody looks",
};

/** Builds the live view in `place`. */
export async function startLive(place, header) {
  const isPhone = matchMedia("(pointer: coarse)").matches;
  const live = { ...header, bounds_m: FIRST_BOUNDS_M, heights_m: [0, 2.5], camera: null, rig_from_lidar: [0, 0, 0, 0, 0, 0, 1], map_unit: "points" };
  const run = { cycles: [] };
  const path = [];
  const shared = sharedUniforms(live);
  const heightCut = new HeightCut(shared.cut);
  const canvas = sceneCanvas();
  const status = element("p", { class: "status", role: "status" });
  const result = element("p", { class: "result", role: "status" });
  const stage = new Stage(canvas, live.bounds_m, new Vector3(0.6, 0.8, 0), isPhone, shared, () => {});
  const layer = new CloudLayer([], shared, { sizeM: FIRST_SPACING_M * SIZE_IN_SPACINGS.map, colouring: COLOURING.height });
  stage.picture.addLayer(layer);
  const map = new LiveMap(layer);
  const mesh = new LiveMesh(shared, layer.look, (isWanted) => {
    connection.say(isWanted ? "mesh on" : "mesh off");
    drawMap();
  });
  stage.picture.addLayer(mesh);
  const overlay = new Overlay(live, run);
  overlay.cutBy(heightCut);
  for (const group of Object.values(overlay.groups)) stage.picture.overlay.add(group);
  const panels = new Panels(live, run);
  const measure = new Measure(stage, (text) => (result.textContent = text));
  const nodes = new Nodes();

  // The view follows the growing map until somebody turns it.
  let isFollowing = true;
  stage.orbit.addEventListener("start", () => (isFollowing = false));
  canvas.addEventListener("keydown", (event) => {
    isFollowing = event.code === "Home";
    sceneKey(event, stage, measure, null);
  });
  canvas.addEventListener("webglcontextlost", () => (result.textContent = "The graphics card has dropped the 3D view: load the page again."));

  const showBounds = () => {
    const { corners_m: ofMap, heights_m } = map.bounds() ?? {};
    if (!ofMap) return;
    shared.heights.value.set(ofMap[0][2], ofMap[1][2]);
    const beforeCut_m = heightCut.belowCeiling_m;
    heightCut.begin(belowCeiling_m(heights_m));
    // The rig is to be in view, too.
    const ends = [Math.min, Math.max];
    const bounds_m = ofMap.map((corner, end) => corner.map((value_m, axis) => path.reduce((so_far, at) => ends[end](so_far, at[axis]), value_m)));
    const moved_m = Math.max(...[0, 1].flatMap((end) => [0, 1, 2].map((axis) => Math.abs(bounds_m[end][axis] - live.bounds_m[end][axis]))));
    if (moved_m < GROWN_M) {
      if (heightCut.belowCeiling_m !== beforeCut_m) showSettings();
      return;
    }
    live.bounds_m = bounds_m;
    stage.setBounds(bounds_m);
    if (isFollowing) stage.home();
    showSettings();
  };
  const settingsPlace = element("div");
  const showSettings = () => {
    const reach_m = [live.bounds_m[0].with(2, live.bounds_m[0][2] - BEYOND_M), live.bounds_m[1].with(2, live.bounds_m[1][2] + BEYOND_M)];
    // Whoever has set something goes on with it.
    if (settingsPlace.contains(document.activeElement) || heightCut.isByHand) return;
    layer.look.sizeM.value = (map.voxel_m ?? FIRST_SPACING_M) * SIZE_IN_SPACINGS.map;
    layer.look.colouring.value = map.hasColours ? COLOURING.own : COLOURING.height;
    settingsPlace.replaceChildren(settings(stage, heightCut, [layer], reach_m, map.hasColours));
  };

  let drawing = null;
  const drawMap = () => {
    drawing ??= setTimeout(() => {
      drawing = null;
      map.draw();
      mesh.draw();
      showBounds();
      const unit = map.voxel_m ? `, voxels of ${(1000 * map.voxel_m).toFixed(0)} mm` : "";
      const shown = layer.count < map.total ? `${grouped(layer.count)} of ${grouped(map.total)}` : grouped(layer.count);
      const refused = mesh.refused > 0 ? ` (${grouped(mesh.refused)} more have no room)` : "";
      const triangles = mesh.visible ? `, ${grouped(mesh.total)} triangles${refused}` : "";
      status.textContent = `${shown} points${unit}${triangles}`;
      Object.assign(status.dataset, { shown: layer.count, total: map.total, triangles: mesh.total });
      stage.changed();
    }, DRAW_MS);
  };

  let isFresh = true;
  const take = async (bytes) => {
    const { kind, reader } = await openMessage(bytes);
    if (kind === KINDS.map) {
      const message = readMap(reader);
      const isOther = message.voxel_m !== map.voxel_m || message.hasColours !== map.hasColours;
      if (isFresh) map.clear();
      isFresh = false;
      map.take(message);
      if (isOther) showSettings();
      drawMap();
    } else if (kind === KINDS.mesh) {
      mesh.take(readTriangles(reader));
      drawMap();
    } else if (kind === KINDS.moment) {
      showMoment(readMoment(reader, live));
    } else if (kind === KINDS.status) {
      const state = readStatus(reader);
      nodes.show(state);
      controls.show(state);
    }
  };

  let rig = null;
  let begun_s = null;
  const showMoment = ({ cycle, view }) => {
    if (JSON.stringify(cycle.rig) !== rig) {
      rig = JSON.stringify(cycle.rig);
      Object.assign(live, cycle.rig);
      overlay.setRig(live);
    }
    // A bag that begins again, or another run: what was before is of another time.
    if (begun_s === null || cycle.t_s < begun_s + (run.cycles.at(-1)?.t_s ?? 0)) {
      run.cycles.length = path.length = 0;
      begun_s = cycle.t_s;
    }
    // Of the first cycle that the page has seen.
    cycle.t_s -= begun_s;
    run.cycles.push(cycle);
    if (run.cycles.length > TRAIL_CYCLES) run.cycles.shift();
    path.push(cycle.pose.slice(0, 3));
    if (path.length > PATH_PLACES) path.splice(0, path.length, ...path.filter((_, n) => n % 2 === 0));
    overlay.setPath(path);
    const index = run.cycles.length - 1;
    overlay.show(index, view, index);
    overlay.path.geometry.setDrawRange(0, path.length);
    panels.show(index, view, index);
    canvas.dataset.moment = cycle.index;
    stage.changed();
  };

  const told = document.getElementById("connection");
  const connection = new Connection({
    take,
    opened: () => {
      isFresh = true;
      mesh.clear();
      if (mesh.visible) connection.say("mesh on");
    },
    tell: (state) => {
      told.textContent = STATES[state];
      told.dataset.state = state;
    },
  });
  const controls = commands(connection);
  const groups = layerGroups({ camera: true }, [
    { id: "map", name: "static map", colour: HEIGHTS_KEY, shown: true, cloud: layer },
    { id: "mesh", name: "triangles", colour: HEIGHTS_KEY, shown: false, cloud: mesh,
      note: "The surface of the map, from the side from which it was seen; of the method free_space. It is sent while this is switched on." },
  ], overlay);
  const walkFrom = () => run.cycles.at(-1)?.pose.slice(0, 3) ?? null;
  const viewer = element("div", { class: "viewer" }, toolbar(stage, measure, walkFrom, "live view"),
    element("div", { class: "stage" }, canvas, status, result),
    element("div", { class: "side" }, layerList(groups, () => stage.changed()), settingsPlace),
    controls.element, panels.element, help(false));
  place.replaceChildren(viewer, nodes.element, parameters(connection));
  showSettings();
  stage.fit();
  stage.home();
}
