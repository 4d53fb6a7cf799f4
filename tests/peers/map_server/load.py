"""Loads a map as Nav2's map_server does, with PyYAML and Pillow, and tells in JSON what it has: the mode `trinary` of
its documentation.

    load.py MAP_YAML
"""

import json
import sys
from pathlib import Path

import yaml
from PIL import Image

path = Path(sys.argv[1])
with path.open() as file:
    meta = yaml.safe_load(file)
assert meta["mode"] == "trinary"
image = Image.open(path.parent / meta["image"])
assert image.format == "PPM" and image.mode == "L", (image.format, image.mode)
width, height = image.size
cells = {}
counts = {"free": 0, "occupied": 0, "unknown": 0}
for y in range(height):
    for x in range(width):
        # The first row of the image is that of the greatest y.
        shade = image.getpixel((x, height - 1 - y)) / 255.0
        occupancy = shade if meta["negate"] else 1.0 - shade
        if occupancy > meta["occupied_thresh"]:
            state = "occupied"
        elif occupancy < meta["free_thresh"]:
            state = "free"
        else:
            state = "unknown"
        counts[state] += 1
        if state != "unknown":
            cells[f"{x} {y}"] = state
print(json.dumps({
    "width": width,
    "height": height,
    "resolution": meta["resolution"],
    "origin": meta["origin"],
    "counts": counts,
    "cells": cells,
}))
