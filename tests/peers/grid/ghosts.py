"""Builds occupancy grids of the scans of a simulated bag, and of other bags' scans with the same poses, and tells in JSON how many
of the occupied cells are ghosts: no static surface is near them. Two grids, foreign to the suite: `log_odds` of Moravec and Elfes
(1985), and `share`, where a cell is occupied when a tenth of at least two beams through it end there, the rule of Karto and
slam_toolbox. They read the bags with `rosbags`, and know poses and scans alone.

    ghosts.py TRUTH_BAG [NAME=BAG]...
"""

import json
import sys
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

CELL_M = 0.05
# Log odds of a cell that a beam ends in, of one that it passes, and beyond which a cell is occupied.
HIT, MISS, BOUND, OCCUPIED = 0.85, -0.4, 3.5, 0.62
# The defaults of Karto: min_pass_through and occupancy_threshold.
LEAST_BEAMS, LEAST_SHARE = 2, 0.1
# A cell so near to one that static returns alone have made occupied is no ghost.
NEAR_CELLS = 2
SIDE = 640
# The scanner on the rig of the scene.
SCANNER = "/scan"


def stamp(header):
    return header.stamp.sec + 1e-9 * header.stamp.nanosec


def read(path, topic):
    with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        connections = [one for one in reader.connections if one.topic == topic]
        for connection, _, data in reader.messages(connections=connections):
            yield reader.deserialize(data, connection.msgtype)


def yaw(q):
    return np.arctan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


class Poses:
    def __init__(self, path):
        poses = list(read(path, "/pose"))
        self.times = np.array([stamp(one.header) for one in poses])
        self.values = np.array([[one.pose.position.x, one.pose.position.y, yaw(one.pose.orientation)] for one in poses])

    def at(self, time):
        return [np.interp(time, self.times, self.values[:, axis]) for axis in range(3)]


def grids_of(scans, poses, keep=None):
    """The occupied cells of both grids after each tenth scan and after the last; `keep` says of the beams of each which are looked at."""
    odds, hits, beams = (np.zeros((SIDE, SIDE)) for _ in range(3))
    for index, scan in enumerate(scans):
        x, y, heading = poses.at(stamp(scan.header))
        ranges = np.array(scan.ranges, dtype=float)
        angles = heading + scan.angle_min + np.arange(len(ranges)) * scan.angle_increment
        real = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
        if keep is not None:
            real &= keep[index]
        seen, ended = np.zeros((SIDE, SIDE), bool), np.zeros((SIDE, SIDE), bool)
        lengths, angles = ranges[real], angles[real]
        # Half a cell apart along all beams at once, a row a beam, as far as the cell before its end.
        along = np.arange(0, lengths.max(initial=0), 0.5 * CELL_M)
        is_before = along[None, :] < (lengths - CELL_M)[:, None]
        row, column = cells(x + np.outer(np.cos(angles), along), y + np.outer(np.sin(angles), along))
        seen[row[is_before], column[is_before]] = True
        ends = cells(x + lengths * np.cos(angles), y + lengths * np.sin(angles))
        ended[ends] = True
        # Each cell that a beam passes once.
        passed = is_before.copy()
        passed[:, 1:] &= (row[:, 1:] != row[:, :-1]) | (column[:, 1:] != column[:, :-1])
        for of in (beams, hits):
            np.add.at(of, ends, 1)
        np.add.at(beams, (row[passed], column[passed]), 1)
        odds[seen & ~ended] += MISS
        odds[ended] += HIT
        np.clip(odds, -BOUND, BOUND, out=odds)
        if index % 10 == 9 or index == len(scans) - 1:
            is_occupied = (beams >= LEAST_BEAMS) & (hits > LEAST_SHARE * beams)
            yield {"log_odds": odds > OCCUPIED, "share": is_occupied}


def cells(x, y):
    column = np.clip((np.asarray(x) / CELL_M + SIDE / 2).astype(int), 0, SIDE - 1)
    row = np.clip((np.asarray(y) / CELL_M + SIDE / 2).astype(int), 0, SIDE - 1)
    return row, column


def grown(mask, steps):
    for _ in range(steps):
        mask = mask | np.roll(mask, 1, 0) | np.roll(mask, -1, 0) | np.roll(mask, 1, 1) | np.roll(mask, -1, 1)
    return mask


def main(truth, others):
    poses = Poses(truth)
    raw, labels = list(read(truth, SCANNER)), list(read(truth, "/truth/scan_labels"))
    moving = [np.array(one.intensities) > 0 for one in labels]
    *_, static = grids_of(raw, poses, [~one for one in moving])
    near = {grid: grown(cells, NEAR_CELLS) for grid, cells in static.items()}
    told = {}
    for name, path in [("raw", truth), *others]:
        scans = list(read(path, SCANNER))
        moments = list(grids_of(scans, poses))
        about = told[name] = {"scans": len(scans)}
        for grid, cells_ in static.items():
            ghosts = [int((one[grid] & ~near[grid]).sum()) for one in moments]
            all_cells = [int(one[grid].sum()) for one in moments]
            about |= {
                # At the end, and over the moments of the drive, with the share of all occupied cells.
                f"{grid}/ghost_cells": ghosts[-1],
                f"{grid}/ghost_cells_most": max(ghosts),
                f"{grid}/ghost_cells_mean": sum(ghosts) / len(ghosts),
                f"{grid}/ghost_share_mean": sum(ghosts) / sum(all_cells),
                f"{grid}/occupied_cells": all_cells[-1],
                f"{grid}/static_cells": int(cells_.sum()),
                f"{grid}/static_cells_lost": int((cells_ & ~grown(moments[-1][grid], 1)).sum()),
            }
        kept_bits = [np.array(a.ranges).view(np.uint32) == np.array(b.ranges).view(np.uint32) for a, b in zip(raw, scans)]
        returns = [np.isfinite(np.array(one.ranges)) for one in raw]
        of = lambda which: [(int((~kept & which(m) & back).sum()), int((which(m) & back).sum()))
                            for kept, m, back in zip(kept_bits, moving, returns)]
        moving_out, static_out = of(lambda m: m), of(lambda m: ~m)
        about |= {
            "moving_beams": sum(all_ for _, all_ in moving_out),
            "moving_beams_removed": sum(out for out, _ in moving_out),
            "static_beams": sum(all_ for _, all_ in static_out),
            "static_beams_removed": sum(out for out, _ in static_out),
        }
    print(json.dumps(told))


if __name__ == "__main__":
    main(sys.argv[1], [argument.split("=", 1) for argument in sys.argv[2:]])
