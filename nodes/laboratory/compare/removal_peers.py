"""What moves, removed from the clouds of a simulated bag: by `stillmap run`, by DUFOMap, and by a map of log-odds.

    pip install dufomap mcap mcap-ros2-support numpy
    stillmap simulate --scene B -o B.mcap && stillmap run B.mcap --out B
    python removal_peers.py B.mcap B

The clouds are those of the cycles: of each scan the depth image that is nearest in time, each pixel from 0.3 m to 8 m a
point, at the pose of the bag. The truth is /truth/labels. All are scored by the rules of `stillmap run`
(`truth` of summary.json), in voxels of 8 cm:
- removed: of the points of what moves, those that are removed;
- kept: of the voxels that static points touch in at least three cycles, those with a point of the map within 8 cm of the
  mean of these points;
- ghosts: voxels that only what moves touched, and in which the map has a point.

DUFOMap sees all clouds before it labels any. The map of log-odds has the constants of OctoMap, and a ray for each voxel that
a cloud hits; its points are the centres of the voxels that are occupied in the end. Times are of a cloud:
theirs CPU time on one processor, that of `stillmap run` the median of a whole cycle, as its report has it.
"""

import argparse
import json
import os
import time
from pathlib import Path

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("bag")
parser.add_argument("run", help="the folder that `stillmap run` has written of this bag")
options = parser.parse_args()
os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:1]))
os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from dufomap import dufomap
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

EDGE_M = 0.08
NEAR_M, FAR_M = 0.3, 8.0
# A scan takes no image that is farther away in time: `max_cloud_offset_s` of detection.
MOST_APART_S = 0.1
CONFIRMING_CYCLES = 3
# OctoMap's: the log-odds of 0.7 and 0.4, clamped to those of 0.12 and 0.97.
HIT, MISS, LEAST, MOST = (float(np.log(p / (1 - p))) for p in (0.7, 0.4, 0.12, 0.97))
# From the optical frame (x right, y down, z forward) to the rig (x forward, y left, z up).
RIG_FROM_CAMERA = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def pixels(image):
    kinds = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
    rows = np.frombuffer(image.data, np.uint8).reshape(image.height, image.step)
    of_row = rows[:, : image.width * np.dtype(kinds[image.encoding]).itemsize]
    return np.ascontiguousarray(of_row).view(kinds[image.encoding])


def read(path):
    scans, depths, labels, poses, camera = [], {}, {}, [], None
    topics = ["/scan", "/camera/depth/image_raw", "/camera/depth/camera_info", "/pose", "/truth/labels"]
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(topics=topics):
            stamp_s = seconds(message.header.stamp)
            if channel.topic == "/scan":
                scans.append(stamp_s)
            elif channel.topic == "/pose":
                p, q = message.pose.position, message.pose.orientation
                poses.append([stamp_s, p.x, p.y, p.z, q.w, q.x, q.y, q.z])
            elif channel.topic.endswith("camera_info"):
                camera = np.array(message.k).reshape(3, 3)
            elif channel.topic == "/truth/labels":
                labels[stamp_s] = pixels(message)
            else:
                depth = pixels(message)
                depths[stamp_s] = depth if depth.dtype == np.float32 else depth.astype(np.float32) / 1000
    return scans, depths, labels, np.array(poses), camera


def pose_at(poses, stamp_s):
    """Position and unit quaternion (w, x, y, z), interpolated."""
    after = int(np.clip(np.searchsorted(poses[:, 0], stamp_s), 1, len(poses) - 1))
    (before_s, *a), (after_s, *b) = poses[after - 1], poses[after]
    share = np.clip((stamp_s - before_s) / (after_s - before_s), 0, 1)
    a, b = np.array(a), np.array(b)
    if a[3:] @ b[3:] < 0:
        b[3:] *= -1
    both = (1 - share) * a + share * b
    return both[:3], both[3:] / np.linalg.norm(both[3:])


def rotation(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def clouds_of(path):
    """Of each cycle: the points in the rig, the pose (4 x 4) of the rig, and which points are of what moves."""
    scans, depths, labels, poses, camera = read(path)
    stamps = np.array(sorted(depths))
    cycles = []
    for scan_s in scans:
        stamp_s = float(stamps[np.argmin(np.abs(stamps - scan_s))])
        is_in_time = abs(stamp_s - scan_s) <= MOST_APART_S and poses[0, 0] <= stamp_s <= poses[-1, 0]
        if not is_in_time or stamp_s not in labels:
            continue
        depth = depths[stamp_s]
        row, column = np.nonzero(np.isfinite(depth) & (depth >= NEAR_M) & (depth <= FAR_M))
        z = depth[row, column].astype(np.float64)
        optical = np.stack([(column - camera[0, 2]) / camera[0, 0] * z, (row - camera[1, 2]) / camera[1, 1] * z, z], 1)
        pose = np.eye(4)
        pose[:3, 3], turn = pose_at(poses, stamp_s)
        pose[:3, :3] = rotation(turn)
        cycles.append((optical @ RIG_FROM_CAMERA.T, pose, labels[stamp_s][row, column] != 0))
    return cycles


def in_map(points, pose):
    return points @ pose[:3, :3].T + pose[:3, 3]


def keys(points):
    """The voxel of each point as one number."""
    cell = np.floor(points / EDGE_M).astype(np.int64) + (1 << 20)
    return (cell[:, 0] << 42) | (cell[:, 1] << 21) | cell[:, 2]


def neighbours():
    steps = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), -1).reshape(-1, 3)
    return [int((x << 42) + (y << 21) + z) for x, y, z in steps.tolist()]


class Truth:
    def __init__(self, cycles):
        object_keys, found, sums = [], {}, {}
        for points, pose, moves in cycles:
            world = in_map(points, pose)
            of_points = keys(world)
            object_keys.append(np.unique(of_points[moves]))
            touched, index, count = np.unique(of_points[~moves], return_inverse=True, return_counts=True)
            total = np.stack([np.bincount(index, world[~moves][:, axis], len(touched)) for axis in range(3)], 1)
            for key, number, sum_m in zip(touched.tolist(), count, total):
                found[key] = found.get(key, 0) + 1
                before = sums.get(key)
                sums[key] = (sum_m, number) if before is None else (before[0] + sum_m, before[1] + number)
        self.object_only = np.setdiff1d(np.unique(np.concatenate(object_keys)), np.array(list(found)))
        self.means = np.array([sums[key][0] / sums[key][1] for key, n in found.items() if n >= CONFIRMING_CYCLES])

    def score(self, points):
        """Ghosts, and the share of the static voxels that are kept, of a map's points."""
        of_points = keys(points)
        order = np.argsort(of_points, kind="stable")
        points, of_points = points[order], of_points[order]
        ghosts = int(np.isin(self.object_only, of_points).sum())
        kept = np.zeros(len(self.means), bool)
        own = keys(self.means)
        for step in neighbours():
            first = np.searchsorted(of_points, own + step, "left")
            end = np.searchsorted(of_points, own + step, "right")
            for index in np.nonzero((end > first) & ~kept)[0]:
                apart = points[first[index]:end[index]] - self.means[index]
                kept[index] = bool((np.einsum("ij,ij->i", apart, apart) <= EDGE_M**2).any())
        return ghosts, float(kept.mean())


def tell(name, removed, static_removed, truth, points, ms):
    ghosts, kept = truth.score(points)
    print(f"| {name} | {100 * removed:.1f} % | {100 * static_removed:.2f} % | {100 * kept:.1f} % | "
          f"{ghosts:,} of {len(truth.object_only):,} | {ms:.0f} ms |", flush=True)


def by_dufomap(cycles, truth, edge_m):
    # Its defaults: hits widened by 0.2 m, unknown space by 2 voxels.
    theirs = dufomap(edge_m, 0.2, 2, num_threads=1)
    start = time.process_time()
    for points, pose, _ in cycles:
        theirs.run(points.astype(np.float32), pose)
    theirs.oncePropagateCluster(if_propagate=True, if_cluster=False)
    labels = [np.asarray(theirs.segment(points.astype(np.float32), pose)) != 0 for points, pose, _ in cycles]
    ms = 1e3 * (time.process_time() - start) / len(cycles)
    moves = np.concatenate([moves for *_, moves in cycles])
    removed = np.concatenate(labels)
    world = np.concatenate([in_map(points, pose)[~gone] for (points, pose, _), gone in zip(cycles, labels)])
    tell(f"DUFOMap, {100 * edge_m:.0f} cm", removed[moves].mean(), removed[~moves].mean(), truth, world, ms)


def by_log_odds(cycles, truth):
    corners = np.concatenate([in_map(points, pose)[:: max(1, len(points) // 2000)] for points, pose, _ in cycles]
                             + [pose[None, :3, 3] for _, pose, _ in cycles])
    least = np.floor(corners.min(0) / EDGE_M).astype(int) - 8
    size = np.ceil(corners.max(0) / EDGE_M).astype(int) + 8 - least
    odds = np.zeros(size, np.float32)
    known = np.zeros(size, bool)
    flat, flat_known = odds.ravel(), known.ravel()

    def cells(points):
        cell = np.floor(points / EDGE_M).astype(int) - least
        inside = ((cell >= 0) & (cell < size)).all(1)
        return np.ravel_multi_index(cell[inside].T, size)

    start = time.process_time()
    for points, pose, _ in cycles:
        hit = np.unique(cells(in_map(points, pose)))
        centres = (np.stack(np.unravel_index(hit, size), 1) + least + 0.5) * EDGE_M
        ray = centres - pose[:3, 3]
        length = np.linalg.norm(ray, axis=1)
        # Samples a quarter of an edge apart, up to the voxel that is hit.
        count = np.maximum(length / (EDGE_M / 4), 1).astype(int)
        owner = np.repeat(np.arange(len(ray)), count)
        along = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        passed = np.unique(cells(pose[:3, 3] + ray[owner] * (along / count[owner])[:, None]))
        passed = np.setdiff1d(passed, hit, assume_unique=True)
        flat[hit] += HIT
        flat[passed] += MISS
        flat_known[hit] = True
        for touched in (hit, passed):
            flat[touched] = np.clip(flat[touched], LEAST, MOST)
    ms = 1e3 * (time.process_time() - start) / len(cycles)
    occupied = np.nonzero((flat > 0) & flat_known)[0]
    centres = (np.stack(np.unravel_index(occupied, size), 1) + least + 0.5) * EDGE_M
    moves = np.concatenate([moves for *_, moves in cycles])
    removed = ~np.isin(np.concatenate([keys(in_map(points, pose)) for points, pose, _ in cycles]), keys(centres))
    tell("log-odds, 8 cm", removed[moves].mean(), removed[~moves].mean(), truth, centres, ms)


def by_stillmap(truth, folder):
    summary = json.loads((folder / "summary.json").read_text())
    with open(folder / "map.ply", "rb") as file:
        header = []
        while not header or header[-1] != "end_header":
            header.append(file.readline().decode().strip())
        number = next(int(line.split()[-1]) for line in header if line.startswith("element vertex"))
        sizes = {"float": "<f4", "double": "<f8", "uchar": "u1"}
        fields = [line.split() for line in header if line.startswith("property")]
        vertices = np.fromfile(file, [(name, sizes[kind]) for _, kind, name in fields], number)
    points = np.stack([vertices[axis].astype(np.float64) for axis in "xyz"], 1)
    of = summary["truth"]
    said = of["map"]
    for theirs, ours in [(said["object_only"], truth.object_only), (said["static_confirmed"]["voxels"], truth.means)]:
        # Rounding alone moves a point to the next voxel.
        if abs(theirs - len(ours)) > 0.001 * theirs:
            raise SystemExit(f"{folder} is of other clouds: {theirs} voxels there, {len(ours)} here")
    ms = summary["timing"]["cycle"]["median_ms"]
    tell("stillmap", of["object_points"]["share"], of["static_points"]["share"], truth, points, ms)


cycles = clouds_of(options.bag)
truth = Truth(cycles)
print(f"{options.bag}: {len(cycles)} clouds, {np.mean([len(points) for points, *_ in cycles]):,.0f} points each")
print("| method | removed | static removed | kept | ghosts | time |\n|---|---|---|---|---|---|")
by_stillmap(truth, Path(options.run))
by_dufomap(cycles, truth, 0.1)
by_dufomap(cycles, truth, 0.08)
by_log_odds(cycles, truth)
