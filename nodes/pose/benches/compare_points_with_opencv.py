"""Corners and matches of a TUM RGB-D sequence beside those of OpenCV's ORB: how long they take, and how good they are.

    pip install opencv-contrib-python-headless numpy
    cargo build --release -p pose --example point_features
    python compare_points_with_opencv.py TARGET_DIR/release/examples/point_features SEQUENCE_DIR OUT_DIR

Time of extracting 1000 corners, by turns, on the same number of threads: the median over all frames, the least, and for
one thread the mean of the processor's time, which other work on the machine disturbs least.

Quality, over pairs of frames 1 and 5 apart. The relative pose of a pair is the one that the matches of both with depth
agree on (RANSAC, then all inliers). With it
  repeated   share of the corners with depth that have a corner of the second frame, of a level at most one
             off, within 2 px of where they should be
  matches    of the same kind for both: ratio 0.8, nearest from both sides
  right      those within 3 px of where they should be, and their share
  error      median distance of the right ones
  cells      squares of 40 px that hold a right one
"""

import glob
import os
import subprocess
import sys
import time

import cv2
import numpy as np

CORNERS = 1000
EVERY = 4
# freiburg1, as the authors of the data set calibrated it.
K = np.array([[517.3, 0, 318.6], [0, 516.5, 255.3], [0, 0, 1.0]])
DISTORTION = np.array([0.2624, -0.9531, -0.0054, 0.0026, 1.1633])
SIZE = (640, 480)

example, sequence, out = sys.argv[1:4]
colour_paths = sorted(glob.glob(sequence + "/rgb/*.png"))
depth_paths = sorted(glob.glob(sequence + "/depth/*.png"))
stamps = np.array([float(os.path.basename(path)[:-4]) for path in depth_paths])
images = [cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in colour_paths]


def ours(folder):
    def read(frame):
        data = np.fromfile(f"{folder}/{frame:03d}.corners", np.uint8).reshape(-1, 52)
        numbers = data[:, :20].copy().view(np.float32).reshape(-1, 5)
        return numbers[:, :2].astype(float), numbers[:, 2], data[:, 20:].copy()

    return read


def opencv(frame):
    corners, descriptors = orb.detectAndCompute(images[frame], None)
    pixels = np.array([corner.pt for corner in corners])
    return pixels, np.array([corner.octave for corner in corners]), descriptors


def match(first, second):
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    back = {pair.queryIdx: pair.trainIdx for pair in matcher.match(second, first)}
    pairs = [
        (best.queryIdx, best.trainIdx)
        for best, next_best in matcher.knnMatch(first, second, k=2)
        if best.distance < 0.8 * next_best.distance and back[best.trainIdx] == best.queryIdx
    ]
    return np.array(pairs, int).reshape(-1, 2)


def points_at(pixels, depth):
    rays = cv2.undistortPoints(pixels.reshape(-1, 1, 2), K, DISTORTION).reshape(-1, 2)
    whole = np.rint(pixels).astype(int)
    z = depth[whole[:, 1].clip(0, SIZE[1] - 1), whole[:, 0].clip(0, SIZE[0] - 1)]
    return np.c_[rays * z[:, None], z], z > 0


def judge(kinds, apart):
    scores = {name: [] for name in kinds}
    for frame in range(0, len(images) - apart, EVERY):
        stamp = float(os.path.basename(colour_paths[frame])[:-4])
        depth = cv2.imread(depth_paths[np.argmin(abs(stamps - stamp))], cv2.IMREAD_UNCHANGED) / 5000.0
        seen, points, pixels = {}, [], []
        for name, read in kinds.items():
            first, second = read(frame), read(frame + apart)
            known, has_depth = points_at(first[0], depth)
            pairs = match(first[2], second[2])
            pairs = pairs[has_depth[pairs[:, 0]]]
            seen[name] = first, second, known, has_depth, pairs
            points.append(known[pairs[:, 0]])
            pixels.append(second[0][pairs[:, 1]])
        points, pixels = np.vstack(points), np.vstack(pixels)
        found, turn, shift, inliers = cv2.solvePnPRansac(
            points, pixels, K, DISTORTION, iterationsCount=1000, reprojectionError=2.5
        )
        if not found or inliers is None:
            continue
        inliers = inliers.ravel()
        turn, shift = cv2.solvePnPRefineLM(points[inliers], pixels[inliers], K, DISTORTION, turn, shift)
        for name, (first, second, known, has_depth, pairs) in seen.items():
            there = cv2.projectPoints(known, turn, shift, K, DISTORTION)[0].reshape(-1, 2)
            inside = has_depth & (there > 20).all(1) & (there < np.array(SIZE) - 20).all(1)
            away = np.linalg.norm(there[inside][:, None] - second[0][None], axis=2)
            other_level = abs(first[1][inside][:, None] - second[1][None]) > 1
            repeated = np.mean(np.where(other_level, np.inf, away).min(1) < 2)
            error = np.linalg.norm(there[pairs[:, 0]] - second[0][pairs[:, 1]], axis=1)
            right = error < 3
            cells = set(map(tuple, (second[0][pairs[right, 1]] // 40).astype(int)))
            row = len(first[0]), repeated, len(pairs), right.sum(), right.mean(), np.median(error[right]), len(cells)
            scores[name].append(row)
    for name, rows in scores.items():
        corners, repeated, matches, right, share, error, cells = np.mean(rows, axis=0)
        print(
            f"{apart} apart  {name:18s} {corners:5.0f} corners  repeated {repeated:.3f}  matches {matches:5.1f}  "
            f"right {right:5.1f} ({share:.3f})  error {error:.2f} px  cells {cells:4.1f}"
        )


orb = cv2.ORB_create(CORNERS)
print(f"OpenCV {cv2.__version__}, {len(images)} frames, times in ms")
for threads in (1, 2):
    cv2.setNumThreads(threads)
    for _ in range(3):
        run = [example, sequence + "/rgb", f"{out}/half", str(threads), "0.5"]
        lines = subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()
        own, matching = (list(map(float, line.split())) for line in lines)
        times, processor = [], []
        for image in images:
            start, processor_start = time.perf_counter(), time.thread_time()
            orb.detectAndCompute(image, None)
            times.append(1e3 * (time.perf_counter() - start))
            processor.append(1e3 * (time.thread_time() - processor_start))
        theirs = np.median(times), min(times), np.mean(processor)
        kinds = ("median", "least", "processor") if threads == 1 else ("median", "least")
        compared = [
            f"{kind} {a:.2f}, OpenCV {b:.2f}, ratio {a / b:.2f}" for kind, a, b in zip(kinds, own, theirs)
        ]
        print(f"{threads} thread(s): {'; '.join(compared)}; matching a pair {matching[0]:.2f}, least {matching[1]:.2f}")
subprocess.run([example, sequence + "/rgb", f"{out}/none", "1", "0"], check=True, capture_output=True)
cv2.setNumThreads(2)
for apart in (1, 5):
    judge({"OpenCV": opencv, "even share 0.5": ours(f"{out}/half"), "even share 0": ours(f"{out}/none")}, apart)
