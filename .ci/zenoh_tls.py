"""Certificates and access control on Zenoh, with the files that nodes/node-shell/README.md shows.

    python3 zenoh_tls.py target/debug/stillmap

Who has a certificate of the robot reads and publishes, a viewer reads, and nobody else gets a session.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import zenoh
from zenoh_peer import DOMAIN, HEADER, Router, attachment, free_port, running_node, topic_key, wait_for

PAGE = Path(__file__).parent.parent / "nodes" / "node-shell" / "README.md"
NEW_KEY = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
NOISE_S = 1.0


def openssl(*arguments):
    subprocess.run(["openssl", *arguments], check=True, capture_output=True)


def authority(name, at):
    openssl("req", "-x509", *NEW_KEY, "-subj", f"/CN={name}", "-keyout", f"{at}.key", "-out", f"{at}.pem")


def certificate(name, folder):
    """Of the robot's authority."""
    at = folder / name
    extensions = folder / "extensions"
    extensions.write_text("subjectAltName=DNS:localhost\nbasicConstraints=CA:FALSE\n")
    openssl("req", *NEW_KEY, "-subj", f"/CN={name}", "-keyout", f"{at}.key", "-out", f"{at}.csr")
    openssl(
        "x509", "-req", "-in", f"{at}.csr", "-CA", f"{folder}/ca.pem", "-CAkey", f"{folder}/ca.key", "-CAcreateserial",
        "-extfile", str(extensions), "-out", f"{at}.pem",
    )  # fmt: skip


def configurations(folder, port):
    """Those of the page, for these files: of the router and of each one else."""
    router, node = (text.replace(":7447", f":{port}") for text in re.findall("```json5\n(.*?)```", PAGE.read_text(), re.S))
    impatient = "endpoints: [\"tls/", "timeout_ms: 3000, endpoints: [\"tls/"
    own = re.compile(r"enable_mtls: true, (.*?), connect_private_key.*?\.pem\"", re.S)
    texts = {"router": router, "nobody": own.sub(r"\1", node).replace(*impatient)}
    for name in ("robot", "viewer", "stranger"):
        texts[name] = node.replace("/etc/robot/robot.", f"/etc/robot/{name}.").replace(*impatient)
    for name, text in texts.items():
        (folder / f"{name}.json5").write_text(text.replace("/etc/robot/", f"{folder}/"))


def open_as(name, folder):
    return zenoh.open(zenoh.Config.from_file(str(folder / f"{name}.json5")))


def check(folder):
    cloud = topic_key("/static_cloud", "sensor_msgs/msg/PointCloud2")
    robot, heard = open_as("robot", folder), []
    watch = robot.declare_subscriber(cloud, lambda sample: heard.append(sample.payload.to_bytes()[4:].decode()))
    viewer, reports, tokens = open_as("viewer", folder), [], []
    diagnostics = topic_key("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    read = viewer.declare_subscriber(diagnostics, lambda _: reports.append(1))
    graph = viewer.liveliness().declare_subscriber(f"@ros2_lv/{DOMAIN}/**", lambda _: tokens.append(1), history=True)
    wait_for("what the viewer reads", lambda: reports and tokens)
    late = lambda: [reply for reply in viewer.get(f"{DOMAIN}/rosout/**/@adv/**?_anyke") if reply.ok]
    wait_for("a line of the log from before", late)
    viewer.put(cloud, HEADER + b"viewer", attachment=attachment(1))
    time.sleep(NOISE_S)
    second = open_as("robot", folder)
    wait_for("what a robot says", lambda: second.put(cloud, HEADER + b"robot", attachment=attachment(1)) or heard)
    assert set(heard) == {"robot"}, heard
    for name in ("nobody", "stranger"):
        try:
            open_as(name, folder)
        except zenoh.ZError:
            continue
        raise SystemExit(f"{name} has a session")
    del watch, read, graph
    print("certificates: the robot reads and publishes, a viewer reads, others get no session", flush=True)


def main(program):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        authority("the robot's authority", folder / "ca")
        authority("robot", folder / "stranger")
        for owner in ("router", "robot", "viewer"):
            certificate(owner, folder)
        port = free_port()
        configurations(folder, port)
        router = Router(port, str(folder / "router.json5"))
        environment = dict(os.environ, ROS_DOMAIN_ID=str(DOMAIN), RMW_IMPLEMENTATION="rmw_zenoh_cpp")
        environment["ZENOH_SESSION_CONFIG_URI"] = str(folder / "robot.json5")
        try:
            with running_node(program, "reconstruction", folder, environment):
                check(folder)
        finally:
            router.kill()


main(sys.argv[1])
# Sessions end with the process, not before their threads.
os._exit(0)
