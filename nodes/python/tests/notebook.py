"""Executes a notebook in a folder, and checks that it runs to its end and draws something.

    python3 notebook.py NOTEBOOK FOLDER [PICTURE]
"""

import base64
import pathlib
import sys

import nbclient
import nbformat

# A slow machine's, and not what it takes: a cell that hangs is to end.
LONGEST_S = 600


def main(path, folder, picture=None):
    notebook = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), f"{path} has outputs: clear them"
    nbclient.NotebookClient(notebook, timeout=LONGEST_S, startup_timeout=LONGEST_S, resources={"metadata": {"path": folder}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pictures = [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 1, f"{path} draws {len(pictures)} pictures"
    if picture:
        pathlib.Path(picture).write_bytes(base64.b64decode(pictures[0]))


main(*sys.argv[1:])
