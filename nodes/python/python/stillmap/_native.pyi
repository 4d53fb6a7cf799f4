import os
from collections.abc import Iterator, Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "__version__",
    "Bag",
    "Cycle",
    "Error",
    "Map",
    "Message",
    "Messages",
    "Run",
    "Topic",
    "Track",
    "Zone",
    "read_map",
    "run",
    "score_trajectories",
]

__version__: str

_Path = str | os.PathLike[str]

class Error(Exception):
    """A job could not be done. The text says what was wrong and, on a second line, what to do."""

@final
class Bag:
    """A recording: MCAP, sqlite3 or ROS 1, or a rosbag2 folder."""

    def __new__(cls, path: _Path) -> Bag: ...
    @property
    def path(self) -> os.PathLike[str]: ...
    @property
    def topics(self) -> list[Topic]:
        """The topics, by name."""
    @property
    def message_count(self) -> int: ...
    @property
    def start_s(self) -> float | None:
        """When the first message was recorded, in seconds since the epoch; None for a bag without messages."""
    @property
    def duration_s(self) -> float: ...
    @property
    def problems(self) -> list[str]:
        """The parts of the bag that cannot be read."""
    def messages(self, topics: Sequence[str] | None = None) -> Messages:
        """The messages of these topics, or of all, in the order in which they were recorded."""

@final
class Topic:
    """A topic of a bag."""

    @property
    def name(self) -> str: ...
    @property
    def type_name(self) -> str:
        """As sensor_msgs/msg/LaserScan; empty if the bag has none."""
    @property
    def message_count(self) -> int: ...
    @property
    def rate_hz(self) -> float | None:
        """None for fewer than two messages."""

@final
class Messages(Iterator[Message]):
    """An iterator of the messages of a bag."""

    def __iter__(self) -> Messages: ...
    def __next__(self) -> Message: ...

@final
class Message:
    """A message of a bag."""

    @property
    def topic(self) -> str: ...
    @property
    def type_name(self) -> str: ...
    @property
    def log_time_ns(self) -> int:
        """When it was recorded, in nanoseconds since the epoch."""
    @property
    def data(self) -> bytes:
        """The message in CDR, with the 4 bytes of its encapsulation."""

@final
class Cycle:
    """One cycle: a scan, the depth image beside it, and what moves in both."""

    @property
    def index(self) -> int:
        """The number of the cycle, from 0."""
    @property
    def stamp_s(self) -> float:
        """When the depth image, or cloud, was measured, in seconds of the bag's clock."""
    @property
    def stamp_ns(self) -> int:
        """The same in nanoseconds, exactly."""
    @property
    def scan_stamp_s(self) -> float:
        """When the scan was measured, in seconds of the bag's clock."""
    @property
    def depth(self) -> NDArray[np.float32] | None:
        """H x W, metres along the camera's z axis, NaN where nothing was measured. None with the method rec_hv."""
    @property
    def moving(self) -> NDArray[np.bool_] | None:
        """H x W: whether a pixel shows something that moves, or may. None with the method rec_hv."""
    @property
    def colours(self) -> NDArray[np.uint8] | None:
        """H x W x 3: red, green, blue of the depth image's pixels, 0, 0, 0 where the colour camera does not see it."""
    @property
    def camera_matrix(self) -> NDArray[np.float64] | None:
        """3 x 3: the matrix K of the depth camera, pixels. None with the method rec_hv."""
    @property
    def camera_distortion(self) -> NDArray[np.float64] | None:
        """Of the lens, in the order of CameraInfo; none at all for a rectified image."""
    @property
    def static_points(self) -> NDArray[np.float32]:
        """N x 3, metres, in the frame of the map: the static points of the reduced cloud."""
    @property
    def dynamic_points(self) -> NDArray[np.float32]:
        """N x 3, metres, in the frame of the map: the points that move, of the reduced cloud."""
    @property
    def map_from_rig(self) -> NDArray[np.float64]:
        """4 x 4: the pose of the rig in the map, as it was in this cycle, before corrections of later ones."""
    @property
    def map_from_camera(self) -> NDArray[np.float64]:
        """4 x 4: the pose of the camera (z forward) in the map, as `map_from_rig`."""
    @property
    def map_frame(self) -> str: ...
    @property
    def tracks(self) -> list[Track]:
        """The objects that move."""
    @property
    def zones(self) -> list[Zone]:
        """The directions in which the scan moves."""

@final
class Track:
    """An object that moves, as a cycle knows it."""

    @property
    def id(self) -> int:
        """The object's number, of no other object of the run."""
    @property
    def position_m(self) -> NDArray[np.float64]:
        """3: its centre, in the frame of the map."""
    @property
    def velocity_m_per_s(self) -> NDArray[np.float64]:
        """3: in the frame of the map."""
    @property
    def extent_m(self) -> NDArray[np.float64]:
        """3: its edge lengths along the axes of the map."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """6 x 6: of position and velocity, in m and m/s."""
    @property
    def age_s(self) -> float:
        """Since it was first seen."""
    @property
    def unseen_cycles(self) -> int:
        """Cycles since it was last seen; 0 when this cycle saw it."""

@final
class Zone:
    """A wedge of directions around the rig's z axis in which something moves, from the x axis towards the y axis."""

    @property
    def azimuth_min_rad(self) -> float:
        """The right-hand bound, from -pi to pi."""
    @property
    def azimuth_max_rad(self) -> float:
        """The left-hand bound; above pi where the zone crosses the rear."""
    @property
    def nearest_m(self) -> float | None:
        """The distance of the nearest return that moves; None where the method does not know it."""
    @property
    def farthest_m(self) -> float | None:
        """The distance of the farthest return that moves; None where the method does not know it."""
    @property
    def held_cycles(self) -> int:
        """Cycles since it was measured; 0 when it was in this one."""

@final
class Run(Iterator[Cycle]):
    """A bag on its way through the pipeline: an iterator of its cycles."""

    def __iter__(self) -> Run: ...
    def __next__(self) -> Cycle: ...
    def finish(self) -> Map:
        """Processes what is left of the bag, and returns the map."""
    def map(self) -> Map:
        """The map so far; at the end of the bag the one that `stillmap run` writes."""
    @property
    def note(self) -> str | None:
        """Where the poses come from, where it is not a topic of PoseStamped."""
    @property
    def problems(self) -> list[str]:
        """What was lost of the input, and what is wrong with it. Complete at the end of the bag, and before it empty."""

def run(
    bag: _Path,
    *,
    method: str | None = None,
    map_edge_m: float | None = None,
    pose: str | None = None,
    scan: str | None = None,
    depth: str | None = None,
    camera_info: str | None = None,
    points: str | None = None,
    params_files: Sequence[_Path] = ...,
    colour: bool = True,
) -> Run:
    """Opens a bag and returns an iterator of its cycles.

    `method` is "free_space" (the default) or "rec_hv", `map_edge_m` the edge of the map's voxels. `scan`, `depth`, `camera_info`,
    `points` and `pose` name topics where the bag has several; `pose` may be "tf" or "visual". `params_files` are parameter files of
    ROS 2 for the nodes, later ones override earlier ones. Without `colour` the map has no colours.
    """

@final
class Map:
    """The static map of a place: points, and where they are known their normals and colours."""

    def __new__(
        cls, points: ArrayLike, normals: ArrayLike | None = None, colours: ArrayLike | None = None
    ) -> Map:
        """Of points N x 3, metres, with unit normals N x 3, and colours N x 3: red, green, blue, integers from 0 to 255."""
    def __len__(self) -> int: ...
    @property
    def points(self) -> NDArray[np.float32]:
        """N x 3, metres, in the frame of the map."""
    @property
    def normals(self) -> NDArray[np.float32] | None:
        """N x 3, of length 1, towards where the points were seen from. None where they are not known."""
    @property
    def colours(self) -> NDArray[np.uint8] | None:
        """N x 3: red, green, blue, and 0, 0, 0 where none was seen. None where they are not known."""
    def save(self, path: _Path, *, overwrite: bool = False) -> None:
        """Writes the map to a .ply or .pcd file. `overwrite` replaces one that is there."""

def read_map(path: _Path) -> Map:
    """Reads a map: a .ply, .pcd or octomap .bt file."""

def score_trajectories(
    estimate: _Path | ArrayLike,
    reference: _Path | ArrayLike,
    align: str,
    max_difference_s: float,
    offset_s: float,
) -> str: ...
