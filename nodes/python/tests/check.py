"""Checks the package against what `stillmap run` left: the same bag gives the same map, masks and clouds.

Run with the package on the path: python3 check.py FOLDER. The folder has room.mcap, in which a platform turns and a person passes it, with
colours, and what `stillmap run room.mcap --out room` has written. The program's files are read with nothing of the project.
"""

import contextlib
import pathlib
import signal
import sys
import tempfile
import threading
import unittest
from importlib import metadata

import numpy as np

import stillmap

FOLDER = pathlib.Path(sys.argv.pop())
BAG, WRITTEN = FOLDER / "room.mcap", FOLDER / "room"
# The reduced cloud's points are means over voxels in the rig's frame; they go through one rotation of single precision.
ROUNDING_M = 1e-5


def vertices(path):
    """The vertices of a binary little-endian PLY, which has nothing else: by the names of their properties."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    lines = [line.split() for line in header.decode("ascii").splitlines()]
    kinds = {"float": "<f4", "uchar": "u1"}
    dtype = np.dtype([(name, kinds[kind]) for first, kind, name in (line for line in lines if line[0] == "property")])
    table = np.frombuffer(body, dtype)
    assert [["element", "vertex", str(len(table))]] == [line for line in lines if line[0] == "element"]
    return table


def columns(table, names):
    """Some of the properties, as the columns of an array."""
    return np.stack([table[name] for name in names], axis=1)


@contextlib.contextmanager
def counting():
    """A list that another thread appends to."""
    counted, done = [], threading.Event()

    def count():
        while not done.is_set():
            counted.append(None)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        yield counted
    finally:
        done.set()
        thread.join()


class TheMap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_ = stillmap.run(BAG)
        cls.cycles = list(cls.run_)
        cls.map = cls.run_.map()

    def test_is_that_of_the_program(self):
        self.assertEqual(self.run_.problems, [])
        written = vertices(WRITTEN / "map.ply")
        np.testing.assert_array_equal(self.map.points, columns(written, "xyz"))
        np.testing.assert_array_equal(self.map.colours, columns(written, ("red", "green", "blue")))
        self.assertEqual(len(self.map), len(self.map.points))
        self.assertEqual(self.map.points.dtype, np.float32)
        np.testing.assert_allclose(np.linalg.norm(self.map.normals, axis=1), 1, atol=1e-5)

    def test_is_read_and_saved(self):
        read = stillmap.read_map(WRITTEN / "map.ply")
        np.testing.assert_array_equal(read.points, self.map.points)
        np.testing.assert_array_equal(read.normals, self.map.normals)
        with tempfile.TemporaryDirectory() as folder:
            for name in ("map.ply", "map.pcd"):
                path = pathlib.Path(folder) / name
                self.map.save(path)
                again = stillmap.read_map(str(path))
                np.testing.assert_array_equal(again.points, self.map.points)
                np.testing.assert_array_equal(again.normals, self.map.normals)
                with self.assertRaisesRegex(FileExistsError, "already exists"):
                    self.map.save(path)
                self.map.save(path, overwrite=True)
            # What the program wrote is written again, byte for byte: its views are kept.
            path = pathlib.Path(folder) / "again.ply"
            read.save(path)
            self.assertEqual(path.read_bytes(), (WRITTEN / "map.ply").read_bytes())
            with self.assertRaisesRegex(stillmap.Error, r"\.ply or \.pcd"):
                self.map.save(pathlib.Path(folder) / "map.png")

    def test_is_of_arrays(self):
        points = [[0, 0, 0], [1, 2, 3]]
        colours = np.array([[1, 2, 3], [4, 5, 6]], np.uint8)
        made = stillmap.Map(points, colours=colours)
        np.testing.assert_array_equal(made.points, points)
        np.testing.assert_array_equal(made.colours, colours)
        np.testing.assert_array_equal(stillmap.Map(points, colours=colours.tolist()).colours, colours)
        # Regression: colours from 0 to 1, as Open3D has them, became black without a word, and 300 became 44.
        for wrong in (colours / 255, colours.astype(np.int32) * 100, -colours.astype(np.int32), colours > 2):
            with self.assertRaisesRegex(ValueError, "integers from 0 to 255"):
                stillmap.Map(points, colours=wrong)
        # An attribute is one object, and changes of it are the caller's own.
        self.assertIs(made.points, made.points)
        with self.assertRaisesRegex(ValueError, "N x 3"):
            stillmap.Map([[0, 0]])
        with self.assertRaisesRegex(ValueError, "1 normals are given for 2 points"):
            stillmap.Map(points, normals=[[0, 0, 1]])

    def test_cycles_have_what_moves(self):
        clouds = (WRITTEN / "dynamic").glob("cycle_*.ply")
        removed = {int(path.stem.split("_")[1]): columns(vertices(path), "xyz") for path in clouds}
        self.assertGreater(len(removed), 10)
        self.assertEqual([cycle.index for cycle in self.cycles], list(range(len(self.cycles))))
        for cycle in self.cycles:
            self.assertEqual(cycle.depth.dtype, np.float32)
            self.assertEqual(cycle.moving.dtype, np.bool_)
            self.assertEqual(cycle.depth.shape, cycle.moving.shape)
            self.assertEqual(cycle.colours.shape, (*cycle.depth.shape, 3))
            self.assertIs(cycle.depth, cycle.depth)
            self.assertAlmostEqual(cycle.stamp_s, cycle.stamp_ns / 1e9, places=6)
            self.assertEqual(cycle.map_frame, "map")
            in_rig = removed.get(cycle.index, np.empty((0, 3)))
            in_map = in_rig @ cycle.map_from_rig[:3, :3].T + cycle.map_from_rig[:3, 3]
            np.testing.assert_allclose(cycle.dynamic_points, in_map, atol=ROUNDING_M)
        self.assertGreater(np.abs(self.cycles[-1].map_from_rig - np.eye(4)).max(), 0.1)
        moving = [cycle for cycle in self.cycles if cycle.tracks and cycle.moving.any()]
        self.assertGreater(len(moving), 10)
        self.assertTrue(any(cycle.zones for cycle in moving))
        track = moving[0].tracks[0]
        self.assertEqual(track.position_m.shape, (3,))
        np.testing.assert_array_equal(track.covariance, track.covariance.T)

    def test_other_method_has_no_pixels(self):
        run = stillmap.run(BAG, method="rec_hv")
        cycle = next(run)
        self.assertEqual((cycle.depth, cycle.moving, cycle.camera_matrix), (None, None, None))
        self.assertGreater(len(cycle.static_points), 100)
        self.assertIsNone(run.map().colours)

    def test_pixels_that_do_not_move_are_on_the_map(self):
        """Back-projected by the camera's matrix and its pose, as a user would: frames, units and masks fit together."""
        cycle = self.cycles[-1]
        rows, columns = np.nonzero(np.isfinite(cycle.depth) & ~cycle.moving & (cycle.depth < 3))
        picked = np.linspace(0, len(rows) - 1, 60).astype(int)
        depth = cycle.depth[rows, columns][picked]
        pixels = np.stack([columns[picked], rows[picked], np.ones(len(depth))])
        in_camera = np.linalg.inv(cycle.camera_matrix) @ pixels * depth
        in_map = cycle.map_from_camera @ np.vstack([in_camera, np.ones(len(depth))])
        apart = np.linalg.norm(in_map[:3].T[:, None] - self.map.points[None], axis=2).min(axis=1)
        self.assertLess(np.median(apart), 0.02)


class TheBag(unittest.TestCase):
    def test_says_what_it_holds(self):
        bag = stillmap.Bag(BAG)
        topics = {topic.name: topic for topic in bag.topics}
        scan = topics["/scan"]
        self.assertEqual(scan.type_name, "sensor_msgs/msg/LaserScan")
        self.assertEqual(bag.problems, [])
        self.assertEqual(bag.message_count, sum(topic.message_count for topic in bag.topics))
        messages = list(bag.messages(["/scan"]))
        self.assertEqual(len(messages), scan.message_count)
        self.assertEqual({message.topic for message in messages}, {"/scan"})
        self.assertTrue(all(message.data[:4] == b"\0\1\0\0" for message in messages))
        self.assertIn("room.mcap", repr(bag))


class Trajectories(unittest.TestCase):
    def test_is_scored(self):
        times = np.arange(20.0)
        reference = np.zeros((20, 8))
        reference[:, 0], reference[:, 1], reference[:, 2], reference[:, 7] = times, times, np.sin(times), 1
        estimate = reference.copy()
        estimate[:, 1:3] += [0.5, -0.25]
        off = stillmap.evaluate_trajectory(estimate, reference, align="none")
        self.assertAlmostEqual(off["absolute"]["translation_m"]["rmse"], np.hypot(0.5, 0.25), places=6)
        aligned = stillmap.evaluate_trajectory(estimate, reference)
        self.assertLess(aligned["absolute"]["translation_m"]["rmse"], 1e-6)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "estimate.txt"
            np.savetxt(path, estimate)
            self.assertEqual(stillmap.evaluate_trajectory(path, reference), aligned)
        with self.assertRaisesRegex(ValueError, "8"):
            stillmap.evaluate_trajectory(estimate[:, :7], reference)
        with self.assertRaisesRegex(ValueError, "sim3"):
            stillmap.evaluate_trajectory(estimate, reference, align="sim2")
        with self.assertRaisesRegex(stillmap.Error, "match"):
            stillmap.evaluate_trajectory(estimate, reference, offset_s=100.0)


class ThePackage(unittest.TestCase):
    def test_says_its_version_and_has_its_licence(self):
        self.assertEqual(metadata.version("stillmap"), stillmap.__version__)
        licences = [path for path in metadata.files("stillmap") if path.name == "LICENSE"]
        self.assertIn("Apache License", licences[0].read_text())

    def test_says_what_everything_is(self):
        for name in set(stillmap.__all__) - {"__version__"}:
            self.assertTrue(getattr(stillmap, name).__doc__, name)


class Failures(unittest.TestCase):
    def test_are_exceptions_with_the_words_of_the_program(self):
        for call in (stillmap.Bag, stillmap.run, stillmap.map_of, stillmap.read_map):
            with self.assertRaisesRegex(FileNotFoundError, "none.mcap|none.ply"):
                call("none.ply" if call is stillmap.read_map else "none.mcap")
        with self.assertRaisesRegex(FileNotFoundError, "none.yaml"):
            stillmap.run(BAG, params_files=["none.yaml"])
        with self.assertRaises(stillmap.Error):
            stillmap.Bag(__file__)
        with tempfile.NamedTemporaryFile(suffix=".pcap") as capture:
            capture.write(bytes([0xD4, 0xC3, 0xB2, 0xA1, 2, 0]))
            capture.flush()
            with self.assertRaisesRegex(stillmap.Error, "`stillmap import velodyne "):
                stillmap.Bag(capture.name)
        with self.assertRaisesRegex(stillmap.Error, "no topic /nothing"):
            stillmap.run(BAG, scan="/nothing")
        with self.assertRaisesRegex(stillmap.Error, "road map"):
            stillmap.run(BAG, pose="lidar")
        with self.assertRaisesRegex(ValueError, "free_space"):
            stillmap.run(BAG, method="magic")
        with self.assertRaisesRegex(stillmap.Error, "map_edge_m"):
            stillmap.run(BAG, map_edge_m=-1.0)
        with self.assertRaisesRegex(stillmap.Error, "no saved map"):
            stillmap.read_map(__file__)

    def test_a_bag_that_breaks_off_is_a_warning_and_no_failure(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "half.mcap"
            whole = BAG.read_bytes()
            path.write_bytes(whole[: len(whole) // 2])
            with self.assertWarns(UserWarning):
                part = stillmap.map_of(path)
            with self.assertWarns(UserWarning), counting() as counted:
                coarse = stillmap.map_of(str(path), map_edge_m=0.05)
            self.assertGreater(len(part), 2 * len(coarse))
            # Other threads run meanwhile.
            self.assertGreater(len(counted), 1000)

    def test_ctrl_c_ends_a_run(self):
        # A shell that starts this in the background has it ignored.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        run = stillmap.run(BAG)
        next(run)
        threading.Timer(0.2, signal.raise_signal, [signal.SIGINT]).start()
        with self.assertRaises(KeyboardInterrupt):
            while True:
                run.finish()
        # It goes on where it was.
        self.assertGreater(next(run).index, 0)


unittest.main()
