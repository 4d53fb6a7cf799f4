"""Makes the files of tests/data/trajectory: make_files.py GROUNDTRUTH OUT, with numpy.

GROUNDTRUTH is groundtruth.txt of the TUM sequence freiburg1_rpy. Everything is seeded.
"""

import sys

import numpy as np

SEED = 20
FIRST_S, LAST_S = 1305031229.5, 1305031232.7


def quaternion_product(a, b):
    ax, ay, az, aw = np.moveaxis(np.asarray(a), -1, 0)
    bx, by, bz, bw = np.moveaxis(np.asarray(b), -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def matrix(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def small_turn(vector):
    q = np.append(0.5 * np.asarray(vector), 1.0)
    return q / np.linalg.norm(q)


def indoor(rng, lines, out):
    """The truth of three seconds, and an estimate at 30 Hz: another frame, a scale, a walk and noise."""
    rows = np.array([[float(number) for number in line.split()] for line in lines])
    with open(f"{out}/truth.tum", "w") as file:
        file.write("# timestamp tx ty tz qx qy qz qw\n")
        file.writelines(line + "\n" for line in lines)
    turn = small_turn([0.3, -0.4, 1.2])
    rotation = matrix(turn)
    drift = np.zeros(3)
    estimate = []
    for at in np.arange(FIRST_S + 0.0137, LAST_S - 0.02, 1 / 30):
        stamp = at + rng.uniform(-0.002, 0.002)
        nearest = rows[np.argmin(abs(rows[:, 0] - stamp))]
        drift += rng.normal(0, 0.002, 3)
        position = 0.9 * (rotation @ (nearest[1:4] + drift + rng.normal(0, 0.003, 3))) + [2, -1, 0.5]
        attitude = quaternion_product(turn, nearest[4:8] / np.linalg.norm(nearest[4:8]))
        attitude = quaternion_product(attitude, small_turn(rng.normal(0, 0.01, 3) + 0.3 * drift))
        estimate.append((stamp, position, attitude / np.linalg.norm(attitude)))
    with open(f"{out}/estimate.tum", "w") as file:
        for stamp, position, q in estimate:
            numbers = " ".join(f"{value:.6f}" for value in (*position, *q))
            file.write(f"{stamp:.6f} {numbers}\n")
    # The same truth as EuRoC writes it.
    with open(f"{out}/truth.euroc.csv", "w") as file:
        file.write("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], ")
        file.write("q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\r\n")
        for line in lines:
            stamp, x, y, z, qx, qy, qz, qw = line.split()
            whole, fraction = stamp.split(".")
            file.write(f"{whole}{fraction:0<9},{x},{y},{z},{qw},{qx},{qy},{qz}\r\n")


def road(rng, out):
    """A drive of 240 poses, 2 m apart, in a camera's frame, and an odometry that drifts."""
    truth, estimate = [], []
    at, at_estimate = np.eye(4), np.eye(4)
    for index in range(240):
        truth.append(at.copy())
        estimate.append(at_estimate.copy())
        yaw = 0.03 * np.sin(index / 25) + 0.012
        step = np.eye(4)
        step[:3, :3] = matrix(small_turn([0.002 * np.sin(index / 9), yaw, 0]))
        step[2, 3] = 2.0
        at = at @ step
        noisy = np.eye(4)
        turn = quaternion_product(
            small_turn([0.002 * np.sin(index / 9), yaw, 0]), small_turn(rng.normal(0.0002, 0.001, 3))
        )
        noisy[:3, :3] = matrix(turn)
        noisy[:3, 3] = step[:3, 3] * 1.008 + rng.normal(0, 0.02, 3)
        at_estimate = at_estimate @ noisy
    for name, poses in (("truth", truth), ("estimate", estimate)):
        with open(f"{out}/{name}.kitti", "w") as file:
            for pose in poses:
                file.write(" ".join(f"{value:.9e}" for value in pose[:3].flatten()) + "\n")


def main():
    ground_truth, out = sys.argv[1:]
    lines = [line.strip() for line in open(ground_truth) if not line.startswith("#")]
    lines = [line for line in lines if FIRST_S <= float(line.split()[0]) <= LAST_S]
    rng = np.random.default_rng(SEED)
    indoor(rng, lines, out)
    road(rng, out)


main()
