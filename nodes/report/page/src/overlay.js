// What is drawn over the points: where the rig went, what it sees now, what moves.

import {
  BoxGeometry, BufferAttribute, BufferGeometry, Color, DoubleSide, EdgesGeometry, Group, Line, LineBasicMaterial, LineSegments, Matrix4, Mesh,
  MeshBasicMaterial, Points, PointsMaterial, Quaternion, Vector3,
} from "three";
import { COLOURS, trackColour } from "./colours.js";

/** A zone whose distance is not known is drawn as far as this; one whose distance is known this far beyond it. */
const REACH_M = 4;
const BEYOND_M = 0.3;
/** How far the camera's pyramid is drawn. */
const FRUSTUM_M = 1.2;
/** Steps of a zone's arc. */
const ARC_STEP_RAD = 0.06;
/** The box that marks a track: about a person. */
const MARK_M = [0.5, 0.5, 1.2];

/** Groups by the names of their layers; `show(cycle, view)` sets all of them to a moment. */
export class Overlay {
  constructor(header, run) {
    this.header = header;
    this.run = run;
    this.groups = Object.fromEntries(["path", "frustum", "zones", "scan", "cloud", "tracks"].map((name) => [name, new Group()]));
    this.path = this.line(run.cycles.map((cycle) => cycle.pose.slice(0, 3)), COLOURS.path);
    this.groups.path.add(this.path);
    this.frustum = this.makeFrustum();
    this.groups.frustum.add(this.frustum);
    this.scan = pointsOf(COLOURS.scan, 5);
    this.cloud = { fixed: pointsOf(COLOURS.fixed, 2), moving: pointsOf(COLOURS.moving, 5) };
    this.groups.scan.add(this.scan);
    this.groups.cloud.add(this.cloud.fixed, this.cloud.moving);
  }

  /** Of the cloud, too, what the heights cut off is not drawn. */
  cutBy({ planes }) {
    for (const points of Object.values(this.cloud)) points.material.clippingPlanes = planes;
  }

  /** Another camera, or another place of it in the rig. */
  setRig(header) {
    this.header = header;
    clear(this.groups.frustum);
    this.frustum = this.makeFrustum();
    this.groups.frustum.add(this.frustum);
  }

  /** Where the rig went, as a list of places. */
  setPath(places_m) {
    clear(this.groups.path);
    this.path = this.line(places_m, COLOURS.path);
    this.groups.path.add(this.path);
  }

  /** The lines, surfaces and points at cycle number `index` of the run, with what the sensors saw at cycle `viewIndex`. */
  show(index, view, viewIndex) {
    const cycle = this.run.cycles[index];
    this.path.geometry.setDrawRange(0, index + 1);
    const rig = poseMatrix(cycle.pose);
    setMatrix(this.frustum, rig);
    this.showZones(cycle, rig);
    this.showTracks(index);
    this.showView(view, viewIndex);
  }

  showView(view, viewIndex) {
    const rig = viewIndex === null ? null : poseMatrix(this.run.cycles[viewIndex].pose);
    for (const points of [this.scan, this.cloud.fixed, this.cloud.moving]) points.visible = view !== null;
    if (view === null) return;
    const { points_m, count, dynamic } = view.cloud;
    setPoints(this.cloud.fixed, points_m.subarray(0, 3 * (count - dynamic)), rig);
    setPoints(this.cloud.moving, points_m.subarray(3 * (count - dynamic)), rig);
    this.scan.visible = view.scan !== null;
    if (view.scan) setPoints(this.scan, view.scan, rig.clone().multiply(poseMatrix(this.header.rig_from_lidar)));
  }

  showZones(cycle, rig) {
    clear(this.groups.zones);
    const height_m = this.header.rig_from_lidar?.[2] ?? 0;
    for (const zone of cycle.zones) {
      const colour = zone.held > 0 ? COLOURS.held : COLOURS.zone;
      const material = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.28, side: DoubleSide, depthWrite: false });
      const wedge = new Mesh(wedgeGeometry(zone, height_m), material);
      setMatrix(wedge, rig);
      this.groups.zones.add(wedge);
    }
  }

  showTracks(index) {
    clear(this.groups.tracks);
    const trails = new Map();
    this.run.cycles.slice(0, index + 1).forEach((cycle) => {
      for (const [id, ...at_m] of cycle.tracks) {
        if (!trails.has(id)) trails.set(id, []);
        trails.get(id).push(at_m);
      }
    });
    for (const [id, trail] of trails) if (trail.length > 1) this.groups.tracks.add(this.line(trail, trackColour(id)));
    for (const [id, ...at_m] of this.run.cycles[index].tracks) {
      const box = new LineSegments(new EdgesGeometry(new BoxGeometry(...MARK_M)), new LineBasicMaterial({ color: trackColour(id) }));
      box.position.set(...at_m);
      this.groups.tracks.add(box);
    }
  }

  line(places_m, colour) {
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(places_m.flat()), 3));
    const line = new Line(geometry, new LineBasicMaterial({ color: colour }));
    line.frustumCulled = false;
    return line;
  }

  makeFrustum() {
    const { camera } = this.header;
    const ends = camera ? camera.corners.map((corner) => new Vector3(...corner).multiplyScalar(FRUSTUM_M)) : [];
    const from = new Vector3(...(camera?.at_m ?? [0, 0, 0]));
    const segments = ends.flatMap((end, n) => {
      const [corner, next] = [end, ends[(n + 1) % ends.length]].map((to) => to.clone().add(from));
      return [from, corner, corner, next];
    });
    // The rig's axes, x y z in red, green and blue.
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const colours = [...segments.map(() => new Color(COLOURS.frustum)), ...axes.flatMap((axis) => [new Color(...axis), new Color(...axis)])];
    segments.push(...axes.flatMap((axis) => [new Vector3(), new Vector3(...axis).multiplyScalar(0.3)]));
    const geometry = new BufferGeometry().setFromPoints(segments);
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours.flatMap((c) => [c.r, c.g, c.b])), 3));
    const lines = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
    lines.frustumCulled = false;
    return lines;
  }
}

function wedgeGeometry({ from_rad, to_rad, far_m }, height_m) {
  const far = far_m ? far_m + BEYOND_M : REACH_M;
  const steps = Math.max(1, Math.ceil((to_rad - from_rad) / ARC_STEP_RAD));
  const corners = [];
  for (let step = 0; step <= steps; step += 1) {
    const azimuth = from_rad + ((to_rad - from_rad) * step) / steps;
    for (const radius of [0, far]) corners.push(radius * Math.cos(azimuth), radius * Math.sin(azimuth), height_m);
  }
  const faces = [];
  for (let step = 0; step < steps; step += 1) faces.push(2 * step, 2 * step + 1, 2 * step + 2, 2 * step + 1, 2 * step + 3, 2 * step + 2);
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(corners), 3));
  geometry.setIndex(faces);
  return geometry;
}

function pointsOf(colour, size) {
  const points = new Points(new BufferGeometry(), new PointsMaterial({ color: colour, size, sizeAttenuation: false }));
  points.frustumCulled = false;
  return points;
}

function setPoints(points, places_m, matrix) {
  points.geometry.dispose();
  points.geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(places_m, 3));
  points.visible = places_m.length > 0;
  setMatrix(points, matrix);
}

function setMatrix(object, matrix) {
  object.matrixAutoUpdate = false;
  object.matrix.copy(matrix);
  object.matrixWorldNeedsUpdate = true;
}

/** The matrix of a pose `[x, y, z, qx, qy, qz, qw]`. */
export function poseMatrix([x, y, z, qx, qy, qz, qw]) {
  return new Matrix4().compose(new Vector3(x, y, z), new Quaternion(qx, qy, qz, qw), new Vector3(1, 1, 1));
}

function clear(group) {
  for (const child of [...group.children]) {
    child.geometry.dispose();
    child.material.dispose();
    group.remove(child);
  }
}
