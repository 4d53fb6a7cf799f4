"""How long line segments take beside OpenCV's: EDLines, and the fast line detector.

    pip install opencv-contrib-python-headless numpy
    cargo build --release -p pose --example line_features
    python compare_lines_with_opencv.py TARGET_DIR/release/examples/line_features SEQUENCE_DIR

By turns, on the same images (SEQUENCE_DIR/rgb/*.png) and the same number of threads: the median over all frames, the
least, and for one thread the mean of the processor's time, which other work on the machine disturbs least. How good the
segments are, the example york_urban says.
"""

import glob
import subprocess
import sys
import time

import cv2
import numpy as np

example, sequence = sys.argv[1:3]
images = [cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in sorted(glob.glob(sequence + "/rgb/*.png"))]


def edge_drawing():
    detector = cv2.ximgproc.createEdgeDrawing()

    def detect(image):
        detector.detectEdges(image)
        return detector.detectLines()

    return detect


def timed(detect):
    detect(images[0])
    passed, processor, counts, lengths = [], [], [], []
    for image in images:
        start, processor_start = time.perf_counter(), time.thread_time()
        lines = detect(image)
        passed.append(1e3 * (time.perf_counter() - start))
        processor.append(1e3 * (time.thread_time() - processor_start))
        lines = np.zeros((0, 4)) if lines is None else np.asarray(lines).reshape(-1, 4)
        counts.append(len(lines))
        lengths.append(np.hypot(*(lines[:, 2:] - lines[:, :2]).T).sum())
    return (np.median(passed), min(passed), np.mean(processor)), (np.mean(counts), sum(lengths) / max(1, sum(counts)))


print(f"OpenCV {cv2.__version__}, {len(images)} frames, times in ms")
kinds = ("median", "least", "processor")
for threads in (1, 2):
    cv2.setNumThreads(threads)
    peers = {
        "EDLines": edge_drawing(),
        "fast line detector": cv2.ximgproc.createFastLineDetector().detect,
    }
    for _ in range(3):
        run = [example, sequence + "/rgb", str(threads)]
        output = subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()
        own, (count, length) = (tuple(map(float, line.split())) for line in output)
        print(f"{threads} thread(s): {count:.0f} segments of {length:.0f} px")
        for name, detect in peers.items():
            theirs, (count, length) = timed(detect)
            shown = kinds if threads == 1 else kinds[:2]
            compared = [f"{kind} {a:.2f}, theirs {b:.2f}, ratio {a / b:.2f}" for kind, a, b in zip(shown, own, theirs)]
            print(f"    {name} ({count:.0f} of {length:.0f} px): {'; '.join(compared)}")
