"""Checks what `stillmap demo` left in a folder: the map, the figures, the report.

Reads the files by itself, with nothing of the project, so that a fault of the writer shows here too.
"""

import json
import pathlib
import struct
import sys

# Bounds on the demo, well below what it reaches: they catch a broken pipeline, not a noisy machine.
LEAST_CYCLES = 60
LEAST_CYCLES_REMOVED = 0.95  # of the cycles in which an object is in view
LEAST_REMOVED = 0.95  # of an object's true points
LEAST_KEPT = 0.99  # of the voxels in which the true static scene was seen in three cycles or more
MOST_LEFT = 0.01  # of the voxels that only objects touched
MOST_REPORT_BYTES = 6_000_000
MAP_EDGE_M = 0.02  # the default of map_edge_m


def points_of_ply(path):
    """The points of a binary little-endian PLY of float x y z."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines[:2]
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    assert [line for line in lines if line.startswith("property")] == [f"property float {axis}" for axis in "xyz"]
    assert len(body) == 12 * count, (len(body), count)
    return list(struct.iter_unpack("<3f", body))


def points_of_pcd(path):
    """The points of a binary PCD of float x y z."""
    header, _, body = path.read_bytes().partition(b"DATA binary\n")
    fields = dict(line.split(" ", 1) for line in header.decode("ascii").splitlines() if not line.startswith("#"))
    assert fields["FIELDS"] == "x y z" and fields["TYPE"] == "F F F", fields
    count = int(fields["POINTS"])
    assert len(body) == 12 * count, (len(body), count)
    return list(struct.iter_unpack("<3f", body))


def main(folder):
    out = pathlib.Path(folder)
    summary = json.loads((out / "summary.json").read_text())
    truth = summary["truth"]
    assert summary["cycles"]["total"] >= LEAST_CYCLES, summary["cycles"]
    assert summary["drops"] == [], summary["drops"]
    assert truth["cycles_scored"] == summary["cycles"]["total"], truth["cycles_scored"]
    assert {one["name"] for one in truth["objects"]} == {"robot", "person"}, truth["objects"]
    for one in truth["objects"]:
        assert one["cycles_in_view"] > 0, one["name"]
        cycles, removed = one["cycles_removed"] / one["cycles_in_view"], one["points"]["share"]
        print(f"{one['name']}: removed in {cycles:.3f} of its cycles, {removed:.3f} of its points")
        assert cycles >= LEAST_CYCLES_REMOVED, (one["name"], cycles)
        assert removed >= LEAST_REMOVED, (one["name"], removed)
    kept = truth["map"]["static_confirmed"]["kept_share_of_unfiltered"]
    left = truth["map"]["object_only_left"] / truth["map"]["object_only_without_removal"]
    print(f"static scene kept {kept:.4f}; voxels of objects left {left:.4f}")
    assert kept >= LEAST_KEPT and left <= MOST_LEFT, (kept, left)

    points = points_of_ply(out / "map.ply")
    assert len(points) == summary["map"]["points"] > 1000, len(points)
    assert points == points_of_pcd(out / "map.pcd")
    voxels = {tuple(int(value // MAP_EDGE_M) for value in point) for point in points}
    assert len(voxels) >= 0.999 * len(points), "the map has several points in a voxel"
    removed = sum(len(points_of_ply(path)) for path in sorted((out / "dynamic").glob("cycle_*.ply")))
    assert removed > 0
    report = (out / "report.html").read_text()
    script = report.rindex("<script>")
    # With the colon: the letters alone may be part of the data in base64.
    addresses = [report[:script].replace("http://www.w3.org", "").count(scheme) for scheme in ("http:", "https:")]
    assert "data:image/png;base64," in report and addresses == [0, 0], addresses
    assert "Content-Security-Policy" in report and "default-src 'none'" in report
    assert len(report) < MOST_REPORT_BYTES, len(report)
    print(f"map of {len(points)} points; {removed} points removed; report of {len(report)} bytes")


main(*sys.argv[1:])
