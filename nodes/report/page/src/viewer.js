// The interactive part of the page.

import { Quaternion, Vector3 } from "three";
import { CloudLayer, geometriesOf } from "./cloud_layer.js";
import { COLOURING, sharedUniforms } from "./cloud_material.js";
import { COLOURS } from "./colours.js";
import { belowCeiling_m } from "./ceiling.js";
import { linkCharts } from "./charts.js";
import { element, grouped } from "./dom.js";
import { HeightCut } from "./height_cut.js";
import { layerList } from "./layers.js";
import { Measure } from "./measure.js";
import { MeshLayer, readMesh } from "./mesh_layer.js";
import { Moment } from "./moment.js";
import { Overlay } from "./overlay.js";
import { Panels } from "./panels.js";
import { readJson } from "./payload.js";
import { readPointSet } from "./point_set.js";
import { Stage } from "./stage.js";
import { timeLine } from "./time_line.js";
import { settings, toolbar } from "./toolbar.js";
import { Views } from "./views.js";

/** Points that a page keeps, and that it keeps on a phone. */
const MOST_POINTS = 12_000_000;
const MOST_POINTS_ON_PHONE = 1_000_000;
/** Points that tell where the ceiling is. */
const HEIGHT_SAMPLES = 50_000;
/** How large a point is drawn, in distances of neighbouring points: the map without gaps when seen from the side, the others so that they do not hide it. */
export const SIZE_IN_SPACINGS = { map: 1.5, removed: 0.5, kept_out: 0.7 };
/** The key of a layer that is coloured by height. */
export const HEIGHTS_KEY = "linear-gradient(90deg, #4f6bed, #43c59e, #ffd94a)";
const TURN_RAD = Math.PI / 12;
/** The whole map is seen from this much aside. Below this share of its length the mean direction of the rig tells nothing. */
const ASIDE_RAD = 0.5;
const LOOKS_ALIKE = 0.4;

/** Builds the viewer in `place` and resolves when it shows the map. */
export async function startViewer(place, header) {
  const isPhone = matchMedia("(pointer: coarse)").matches;
  const run = await readJson("cycles");
  const most = isPhone ? MOST_POINTS_ON_PHONE : MOST_POINTS;
  const sets = {};
  for (const name of Object.keys(header.points)) sets[name] = geometriesOf(await readPointSet(header, name, most));

  const status = element("p", { class: "status", role: "status" });
  const canvas = sceneCanvas();
  const shared = sharedUniforms(header);
  const stage = new Stage(canvas, header.bounds_m, homeDirection(run), isPhone, shared, () => showStatus(status, stage, header));
  const heightCut = new HeightCut(shared.cut);
  heightCut.begin(belowCeiling_m(someHeights_m(sets.map)));
  const clouds = cloudLayers(header, sets, shared);
  const triangles = header.mesh ? [meshLayer(header.mesh, await readMesh(header.mesh), shared, clouds[0].cloud.look)] : [];
  for (const { cloud } of [...clouds, ...triangles]) stage.picture.addLayer(cloud);
  const moment = run.cycles.length > 0 ? new Moment(run.cycles.map((cycle) => cycle.t_s)) : null;
  const overlay = new Overlay(header, run);
  overlay.cutBy(heightCut);
  for (const group of Object.values(overlay.groups)) stage.picture.overlay.add(group);
  const result = element("p", { class: "result", role: "status" });
  const measure = new Measure(stage, (text) => (result.textContent = text));
  const panels = new Panels(header, run);

  const walkFrom = () => run.cycles[moment?.index ?? 0]?.pose.slice(0, 3) ?? null;
  const side = element("div", { class: "side" },
    layerList(layerGroups(header, [...clouds, ...triangles], overlay), () => stage.changed()),
    settings(stage, heightCut, clouds.map(({ cloud }) => cloud), header.bounds_m, header.points.map.has.includes("colour")));
  const viewer = element("div", { class: "viewer" }, toolbar(stage, measure, walkFrom, header.title),
    element("div", { class: "stage" }, canvas, status, result), side,
    moment ? timeLine(moment, run.cycles) : "", panels.element, help());
  place.replaceChildren(viewer);
  canvas.addEventListener("keydown", (event) => sceneKey(event, stage, measure, moment));
  canvas.addEventListener("webglcontextlost", () => (result.textContent = "The graphics card has dropped the 3D view: load the page again."));
  stage.fit();
  stage.home();
  if (moment) {
    linkCharts(moment);
    follow(moment, run, new Views(header), { clouds, overlay, panels, stage });
  }
}

/** The heights of an even choice of the points of a set. */
function someHeights_m(blocks) {
  const total = blocks.reduce((sum, { block }) => sum + block.count, 0);
  // Each beginning of a block is spread evenly over it.
  return blocks.flatMap(({ block: { origin_m, step_m, count, positions } }) =>
    Array.from({ length: Math.ceil(count * Math.min(1, HEIGHT_SAMPLES / total)) }, (_, n) => origin_m[2] + positions[4 * n + 2] * step_m));
}

/** The canvas of the 3D view. */
export function sceneCanvas() {
  return element("canvas", {
    class: "scene", tabindex: 0, role: "img",
    "aria-label": "The map in 3D. Arrow keys move the view, the keys with [ and ] turn it, plus and minus bring it nearer and farther.",
  });
}

/** The direction in which the rig looks most, a little from its right; a diagonal of the map where it looks around. */
function homeDirection({ cycles }) {
  const sum = new Vector3();
  for (const { pose } of cycles) sum.add(new Vector3(1, 0, 0).applyQuaternion(new Quaternion(...pose.slice(3))));
  sum.setZ(0);
  if (sum.length() < LOOKS_ALIKE * cycles.length || cycles.length === 0) return new Vector3(0.6, 0.8, 0);
  return sum.normalize().applyAxisAngle(new Vector3(0, 0, 1), ASIDE_RAD);
}

/** Shows each moment in everything. */
function follow(moment, run, views, { clouds, overlay, panels, stage }) {
  let shown = null;
  moment.listen(async () => {
    const { index } = moment;
    if (shown === index) return;
    shown = index;
    const viewIndex = run.cycles.findLastIndex((cycle, n) => n <= index && cycle.view !== null);
    const view = viewIndex < 0 ? null : await views.at(run.cycles[viewIndex].view);
    if (shown !== index) return;
    for (const { cloud, followsTime } of clouds) if (followsTime) cloud.look.moment.value = index === moment.last ? 65535 : index;
    overlay.show(index, view, view ? viewIndex : null);
    panels.show(index, view, view ? viewIndex : null);
    stage.canvas.dataset.moment = index;
    stage.changed();
  });
}

function cloudLayers(header, sets, shared) {
  const layer = (set, look) => new CloudLayer(sets[set], shared, { sizeM: header.points[set].spacing_m * SIZE_IN_SPACINGS[set], ...look });
  const hasColour = header.points.map.has.includes("colour");
  const layers = [{
    id: "map", name: "static map", colour: HEIGHTS_KEY, shown: true, followsTime: true,
    cloud: layer("map", { colouring: hasColour ? COLOURING.own : COLOURING.height }), count: header.points.map.total,
  }];
  if (sets.removed) {
    layers.push({
      id: "removed", name: "removed as moving", colour: COLOURS.moving, shown: true, followsTime: true, count: header.points.removed.total,
      cloud: layer("removed", { colouring: COLOURING.flat, colour: COLOURS.moving }),
      note: "Points that were classified as moving, of all cycles until the moment.",
    });
  }
  if (sets.kept_out) {
    header.causes.forEach((cause, onlyClass) => {
      if (cause.voxels === 0) return;
      layers.push({
        id: `kept-out-${cause.id}`, name: cause.name, colour: cause.colour, shown: false, followsTime: false, isKeptOut: true, moved: cause.moved,
        count: cause.voxels, note: cause.meaning, cloud: layer("kept_out", { colouring: COLOURING.flat, colour: cause.colour, onlyClass }),
      });
    });
  }
  return layers;
}

/** The layer of the triangles, in the colours of the map's points. Where the page has fewer than the map it says so. */
function meshLayer(mesh, geometry, shared, look) {
  const fewer = mesh.triangles < mesh.total ? `, made coarser from ${grouped(mesh.total)}` : "";
  return {
    id: "mesh", name: `triangles: ${grouped(mesh.triangles)}${fewer}`, colour: HEIGHTS_KEY, shown: false,
    note: "The surface of the map at the end of the run, from the side from which it was seen.", cloud: new MeshLayer(geometry, shared, look),
  };
}

export function layerGroups(header, clouds, overlay) {
  const asLayer = (entry) => ({ ...entry, show: (visible) => (entry.cloud.visible = visible) });
  const of = (id, name, colour) => ({ id, name, colour, shown: true, show: (visible) => (overlay.groups[id].visible = visible) });
  const keptOut = clouds.filter(({ isKeptOut }) => isKeptOut);
  return [
    { title: "Map", layers: clouds.filter(({ isKeptOut }) => !isKeptOut).map(asLayer) },
    {
      title: "At the moment",
      layers: [
        of("path", "path of the rig", COLOURS.path), ...(header.camera ? [of("frustum", "camera", COLOURS.frustum)] : []),
        of("scan", "scan", COLOURS.scan), of("cloud", "cloud: static, moving", `linear-gradient(90deg, ${COLOURS.fixed} 50%, ${COLOURS.moving} 50%)`),
        of("zones", "dynamic zones", COLOURS.zone), of("tracks", "tracks", "#56b4e9"),
      ],
    },
    { title: "Not in the map: moved", layers: keptOut.filter(({ moved }) => moved).map(asLayer) },
    { title: "Not in the map: did not move", layers: keptOut.filter(({ moved }) => !moved).map(asLayer) },
  ];
}

export function showStatus(status, { picture, mode }, header) {
  const { total } = picture;
  const drawn = Math.round(Math.min(1, picture.share) * total);
  const part = picture.isComplete ? `${grouped(total)} points` : `${grouped(drawn)} of ${grouped(total)} points`;
  const map = header.points.map;
  const kept = map.blocks.reduce((sum, block) => sum + block.count, 0);
  const thinned = kept < map.total ? `; the page carries ${grouped(kept)} of the map's ${grouped(map.total)}` : "";
  status.textContent = `${part}${thinned}${mode === "walk" ? "; walking" : ""}`;
  status.dataset.drawn = drawn;
  status.dataset.total = total;
  status.dataset.frameMs = picture.detail.frame_ms.toFixed(1);
}

export function sceneKey(event, stage, measure, moment) {
  const actions = {
    BracketLeft: () => stage.turn(TURN_RAD),
    BracketRight: () => stage.turn(-TURN_RAD),
    Equal: () => zoom(stage, 0.85),
    NumpadAdd: () => zoom(stage, 0.85),
    Minus: () => zoom(stage, 1 / 0.85),
    NumpadSubtract: () => zoom(stage, 1 / 0.85),
    Home: () => stage.home(),
    Space: () => moment?.toggle(),
    Comma: () => moment?.set(moment.index - 1),
    Period: () => moment?.set(moment.index + 1),
    Enter: () => measure.enabled && measure.takeMiddle(),
    Escape: () => stage.setMode("orbit"),
  };
  if (!actions[event.code] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  actions[event.code]();
}

function zoom(stage, factor) {
  const { camera, orbit } = stage;
  camera.position.sub(orbit.target).multiplyScalar(factor).add(orbit.target);
  stage.wake(true);
}

export function help(hasTime = true) {
  const keys = [
    ["drag, or [ ]", "turn"], ["right button, two fingers, or arrow keys", "move"], ["wheel, pinch, or + −", "nearer, farther"],
    ["Walk: drag", "look"], ["W A S D, arrow keys, or two fingers", "go; Q and E down and up, shift faster"], ...(hasTime ? [["space", "play"], [", .", "one cycle back, on"]] : []),
    ["Home", "whole map"], ["Esc", "stop walking"],
  ];
  return element("details", { class: "help" }, element("summary", {}, "Keys and gestures"),
    element("dl", {}, ...keys.map(([key, text]) => element("div", {}, element("dt", {}, key), element("dd", {}, text)))));
}
