"""Checks what `stillmap demo` left in a folder: the map, the figures, the report.

Reads the files by itself, with nothing of the project, so that a fault of the writer shows here too.
"""

import json
import math
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


# A point of the map, and one that was removed.
WITH_NORMALS = ("x", "y", "z", "nx", "ny", "nz")
PLACES = ("x", "y", "z")


def rows_of_ply(path, names):
    """The vertices of a binary little-endian PLY whose properties are these floats."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines[:2]
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    assert [line for line in lines if line.startswith("property")] == [f"property float {name}" for name in names], lines
    return rows_of(body, names, count)


def rows_of_pcd(path, names):
    """The points of a binary PCD whose fields are these floats."""
    header, _, body = path.read_bytes().partition(b"DATA binary\n")
    fields = dict(line.split(" ", 1) for line in header.decode("ascii").splitlines() if not line.startswith("#"))
    of_pcd = [name.replace("n", "normal_") for name in names]
    assert fields["FIELDS"].split() == of_pcd and fields["TYPE"].split() == ["F"] * len(names), fields
    return rows_of(body, names, int(fields["POINTS"]))


def rows_of(body, names, count):
    row = struct.Struct(f"<{len(names)}f")
    assert len(body) == row.size * count, (len(body), count)
    return list(row.iter_unpack(body))


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

    points = rows_of_ply(out / "map.ply", WITH_NORMALS)
    assert len(points) == summary["map"]["points"] > 1000, len(points)
    assert points == rows_of_pcd(out / "map.pcd", WITH_NORMALS)
    assert all(abs(math.hypot(*point[3:]) - 1) < 1e-3 for point in points), "a normal is not of length 1"
    voxels = {tuple(int(value // MAP_EDGE_M) for value in point[:3]) for point in points}
    assert len(voxels) >= 0.999 * len(points), "the map has several points in a voxel"
    removed = sum(len(rows_of_ply(path, PLACES)) for path in sorted((out / "dynamic").glob("cycle_*.ply")))
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
