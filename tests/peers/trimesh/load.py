"""Loads files of triangles with trimesh, and prints a line of JSON for each: its size, its edges by how many triangles they have,
its bounds, and how many vertices are not black."""

import json
import sys

import numpy
import trimesh

for path in sys.argv[1:]:
    scene = trimesh.load_scene(path, process=False)
    (mesh,) = scene.geometry.values()
    _, counts = numpy.unique(numpy.sort(mesh.edges, axis=1), axis=0, return_counts=True)
    colours = getattr(mesh.visual, "vertex_attributes", {}).get("color")
    if colours is None:
        colours = getattr(mesh.visual, "vertex_colors", numpy.zeros((0, 4)))
    print(json.dumps({
        "vertices": len(mesh.vertices),
        "triangles": len(mesh.faces),
        "inner": int((counts == 2).sum()),
        "border": int((counts == 1).sum()),
        "wrong": int((counts > 2).sum()),
        "is_turned_one_way": bool(mesh.is_winding_consistent),
        "least": scene.bounds[0].tolist(),
        "most": scene.bounds[1].tolist(),
        "coloured": int((numpy.asarray(colours)[:, :3] > 0).any(axis=1).sum()),
    }))
