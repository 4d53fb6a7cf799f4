"""GICP of two scans, ours beside small_gicp's: how long each takes in the same run, and how far they are apart.

    pip install small-gicp numpy
    cargo build --release -p lidar-odometry --example register_pair
    python small_gicp_pair.py TARGET_DIR/release/examples/register_pair TARGET.bin SOURCE.bin [--truth FILE]

A time is the whole pair: thinning out at 0.25 m, trees, planes of 10 neighbours and alignment, of clouds that are in
memory. Both run by turns on the same number of processors; medians. The truth is a file of 16 numbers, the pose of the
source in the target's frame.
"""

import argparse
import json
import os
import statistics
import subprocess
import time

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("example")
parser.add_argument("target")
parser.add_argument("source")
parser.add_argument("--truth")
parser.add_argument("--threads", type=int, default=1)
parser.add_argument("--rounds", type=int, default=9)
parser.add_argument("--methods", default="generalised,voxelised_generalised,point_to_plane")
options = parser.parse_args()
# Before small_gicp starts its threads.
os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[: options.threads]))
os.environ["OMP_NUM_THREADS"] = str(options.threads)

import numpy as np
import small_gicp

KINDS = {"generalised": "GICP", "voxelised_generalised": "VGICP", "point_to_plane": "PLANE_ICP"}
# Each of our runs does so many after one another, of which the first is not counted.
REPEATS = 4


def cloud(path):
    return np.fromfile(path, dtype=np.float32).reshape(-1, 4)[:, :3].astype(np.float64)


def apart(a, b):
    between = np.linalg.inv(a) @ b
    angle = np.arccos(np.clip((np.trace(between[:3, :3]) - 1) / 2, -1, 1))
    return f"{1e3 * np.linalg.norm(between[:3, 3]):.1f} mm {np.degrees(angle):.4f} deg"


def theirs(kind):
    start = time.perf_counter()
    result = small_gicp.align(target, source, registration_type=KINDS[kind], downsampling_resolution=0.25,
                              num_threads=options.threads)
    return 1e3 * (time.perf_counter() - start), result


def ours(kind):
    command = [options.example, options.target, options.source, f"method={kind}", f"threads={options.threads}",
               f"repeats={REPEATS}"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    runs = [json.loads(line) for line in lines][1:]
    return [run["ms"] for run in runs], [run["prepare_ms"] for run in runs], runs[-1]


target, source = cloud(options.target), cloud(options.source)
truth = np.loadtxt(options.truth).reshape(4, 4) if options.truth else None
print(f"{len(target)} and {len(source)} points, {options.threads} thread(s), medians of {options.rounds} rounds")
for kind in options.methods.split(","):
    times, own_times, own_prepare = [], [], []
    theirs(kind)
    for _ in range(options.rounds):
        milliseconds, result = theirs(kind)
        times.append(milliseconds)
        milliseconds, prepare, own = ours(kind)
        own_times += milliseconds
        own_prepare += prepare
    pose = np.array(own["pose"]).reshape(4, 4)
    median, own_median = statistics.median(times), statistics.median(own_times)
    print(f"{kind}: ours {own_median:.1f} ms (of it preparation {statistics.median(own_prepare):.1f}), "
          f"{own['iterations']} steps, {own['points']} points; small_gicp {median:.1f} ms, {result.iterations} steps; "
          f"ours / theirs {own_median / median:.2f}")
    print(f"    apart {apart(result.T_target_source, pose)}")
    if truth is not None:
        print(f"    from the truth: ours {apart(truth, pose)}, small_gicp {apart(truth, result.T_target_source)}")
