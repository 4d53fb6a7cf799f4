"""A peer on Zenoh by others: the package zenoh-ros2-sdk, whose keys, tokens, attachments and hashes are its own code.

    python3 zenoh_ros2.py target/debug/stillmap

It lists the graph, hears diagnostics and lines of the log from before, publishes scans and calls a service.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ["ROS_DOMAIN_ID"] = "7"
# It looks for definitions that it lacks in repositories on the network: none is to be asked.
os.environ["GIT_ALLOW_PROTOCOL"] = "none"

import numpy
import zenoh_ros2_sdk as sdk
from zenoh_peer import Router, running_node, wait_for
from zenoh_ros2_sdk.discovery import get_topic_info, get_topic_names_and_types
from zenoh_ros2_sdk.logger import get_logger
from zenoh_ros2_sdk.message_registry import get_registry
from zenoh_ros2_sdk.qos import QosDurability, QosProfile

SCANS = 20
DEFINITIONS = Path(__file__).parent.parent / "msgs"


def definitions(folder):
    """The folders that the package wants: PACKAGE/msg/NAME.msg and PACKAGE/srv/NAME.srv."""
    for kind in ("msg", "srv"):
        for package in (DEFINITIONS / kind).iterdir():
            (folder / package.name).mkdir(exist_ok=True)
            (folder / package.name / kind).symlink_to(package.resolve())
    return str(folder)


def check(port):
    topics = lambda: dict(get_topic_names_and_types(router_port=port))
    wait_for("the input", lambda: topics().get("/scan") == ["sensor_msgs/msg/LaserScan"])
    info = get_topic_info("/diagnostics", router_port=port, verbose=True)
    reports, lines = [], []
    heard = sdk.ROS2Subscriber("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", reports.append, router_port=port)
    assert [one.type_hash for one in info.publishers] == [heard.type_hash], info
    assert info.publishers[0].node_name == "detection", info
    print(f"graph: {len(topics())} topics")

    latched = QosProfile(durability=QosDurability.TRANSIENT_LOCAL)
    sdk.ROS2Subscriber("/rosout", "rcl_interfaces/msg/Log", lines.append, router_port=port, qos=latched)
    wait_for("diagnostics", lambda: reports)
    wait_for("a line of the log from before", lambda: lines)
    assert lines[0].name == "detection", lines[0]

    scans = sdk.ROS2Publisher("/scan", "sensor_msgs/msg/LaserScan", router_port=port)
    types = scans.session_mgr.store.types
    header, stamp = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    floats = lambda count: numpy.full(count, 2.0, dtype="float32")
    value = lambda name: [one.value for report in reports[-3:] for status in report.status for one in status.values if one.key == name]
    wait_for("the match", lambda: "1" in value("publishers /scan"))
    for _ in range(SCANS):
        seconds, nanoseconds = divmod(time.time_ns(), 10**9)
        scans.publish(
            header=header(stamp=stamp(sec=seconds, nanosec=nanoseconds), frame_id="laser"),
            angle_min=-3.1, angle_max=3.1, angle_increment=6.2 / 359, time_increment=0.0, scan_time=0.1,
            range_min=0.1, range_max=10.0, ranges=floats(360), intensities=floats(0),
        )  # fmt: skip
        time.sleep(0.02)
    wait_for("its scans in the report", lambda: str(SCANS) in value("received /scan"))
    print(f"topics: diagnostics, lines of the log from before; {SCANS} scans heard")

    client = sdk.ROS2ServiceClient("/detection/get_parameter_types", "rcl_interfaces/srv/GetParameterTypes", router_port=port)
    response = client.call(names=["use_sim_time"])
    assert list(response.types) == [1], response
    print("service: the type of a parameter", flush=True)


def main(program):
    router = Router()
    port = router.port
    get_logger("cache").disabled = True
    environment = dict(os.environ, RMW_IMPLEMENTATION="rmw_zenoh_cpp")
    environment["ZENOH_CONFIG_OVERRIDE"] = f'connect/endpoints=["tcp/127.0.0.1:{port}"]'
    with tempfile.TemporaryDirectory() as folder:
        get_registry(definitions(Path(folder)))
        try:
            with running_node(program, "detection", Path(folder), environment):
                check(port)
        finally:
            router.kill()


main(sys.argv[1])
# Its session ends with the process, not before its threads.
os._exit(0)
