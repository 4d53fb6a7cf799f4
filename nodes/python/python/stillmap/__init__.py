"""The static 3D map of a place in which people and robots move.

    import stillmap

    for cycle in stillmap.run("room.mcap"):
        print(cycle.stamp_s, cycle.moving.sum(), cycle.tracks)
    room = stillmap.map_of("room.mcap")

A bag goes through the nodes detection, segmentation and reconstruction in this process, without a network; the map is that of
`stillmap run`. Lengths are metres, times seconds, points rows of an N x 3 array. `a_from_b` is a 4 x 4 matrix that takes points of the
frame b into the frame a. What could not be done is an `Error`.
"""

from __future__ import annotations

import json
import os
import warnings
from typing import TYPE_CHECKING, Any, TypedDict

from ._native import (
    Bag,
    Cycle,
    Error,
    Map,
    Message,
    Messages,
    Run,
    Topic,
    Track,
    Zone,
    __version__,
    read_map,
    run,
    score_trajectories,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Unpack

__all__ = [
    "Bag",
    "Cycle",
    "Error",
    "Map",
    "Message",
    "Messages",
    "Run",
    "RunOptions",
    "Topic",
    "Track",
    "Zone",
    "__version__",
    "evaluate_trajectory",
    "map_of",
    "read_map",
    "run",
]


class RunOptions(TypedDict, total=False):
    """The keywords of `run`."""

    method: str | None
    map_edge_m: float | None
    pose: str | None
    scan: str | None
    depth: str | None
    camera_info: str | None
    points: str | None
    params_files: list[str | os.PathLike[str]]
    colour: bool


def map_of(bag: str | os.PathLike[str], **options: Unpack[RunOptions]) -> Map:
    """The static map of a bag, with the keywords of `run`. What was lost of the input is a warning."""
    whole = run(bag, **options)
    found = whole.finish()
    for problem in whole.problems:
        warnings.warn(problem, stacklevel=2)
    return found


def evaluate_trajectory(
    estimate: str | os.PathLike[str] | ArrayLike,
    reference: str | os.PathLike[str] | ArrayLike,
    *,
    align: str = "se3",
    max_difference_s: float = 0.01,
    offset_s: float = 0.0,
) -> dict[str, Any]:
    """The errors of an estimated trajectory: the figures of `stillmap eval trajectory --json`.

    Both are files (TUM, KITTI or EuRoC, recognised by their content), or N x 8 arrays of seconds, x, y, z, qx, qy, qz, qw.
    `align` is "none", "origin", "yaw", "se3" or "sim3". Poses are of one moment when their stamps differ by `max_difference_s` at
    most; `offset_s` is added to those of the estimate. For example `["absolute"]["translation_m"]["rmse"]` is the absolute error.
    """
    score: dict[str, Any] = json.loads(score_trajectories(estimate, reference, align, max_difference_s, offset_s))
    return score
