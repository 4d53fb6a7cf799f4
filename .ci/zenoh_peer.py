"""A peer of the nodes on Zenoh that has none of their code: topics, services, parameters, life cycle, graph, hashes, and a whole run.

    python3 zenoh_peer.py target/debug/stillmap

The keys, tokens and attachments are those of rmw_zenoh. The router is zenohd where it is installed (ZENOHD, or in the PATH or in cargo's
folder) with config/zenoh/router.json5, or one of the Python package.
"""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from importlib.metadata import version as version_of
from pathlib import Path

import zenoh
import zenoh.ext
from rosbags.typesys import Stores, get_typestore

DOMAIN = 7
ROUTER_CONFIG = Path(__file__).parent.parent / "config" / "zenoh" / "router.json5"
PATIENCE_S = 60.0
HEADER = b"\0\1\0\0"
TYPES = get_typestore(Stores.ROS2_JAZZY)
# By rosidl of ROS 2 Jazzy: rosbags has no services.
SERVICE_HASHES = {
    "rcl_interfaces/srv/GetParameters": "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
    "rcl_interfaces/srv/SetParameters": "56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
    "rcl_interfaces/srv/ListParameters": "3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
}


def dds_type(name):
    package, kind, message = name.split("/")
    return f"{package}::{kind}::dds_::{message}_"


def ros_type(name):
    return name.replace("::dds_::", "::").rstrip("_").replace("::", "/")


def topic_key(topic, type_name):
    return f"{DOMAIN}{topic}/{dds_type(type_name)}/{TYPES.hash_rihs01(type_name)}"


def text(value):
    value = value.encode() + b"\0"
    return struct.pack("<I", len(value)) + value


def attachment(number):
    return struct.pack("<qqB16s", number, time.time_ns(), 16, b"the foreign peer")


def wait_for(what, look):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        found = look()
        if found:
            return found
        time.sleep(0.05)
    raise SystemExit(f"waited in vain: {what}")


class Peer:
    """A session of its own, and the tokens that it sees."""

    def __init__(self, port):
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("timestamping/enabled", "true")
        self.session = zenoh.open(config)
        self.tokens = set()
        liveliness = self.session.liveliness()
        self.follower = liveliness.declare_subscriber(f"@ros2_lv/{DOMAIN}/**", self._token, history=True)

    def _token(self, sample):
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self.tokens.add(key)
        else:
            self.tokens.discard(key)

    def announce(self, kind, number, name, type_name, hash, qos="::,10:,:,:,,"):
        """The token of an end of its own."""
        node = f"@ros2_lv/{DOMAIN}/{self.session.info.zid()}/0/{number}/{kind}/%/%/foreign"
        return self.session.liveliness().declare_token(f"{node}/{name.replace('/', '%')}/{dds_type(type_name)}/{hash}/{qos}")

    def ends(self, kind):
        """Name, type and hash of all ends of a kind."""
        parts = [token.split("/") for token in list(self.tokens)]
        return {(part[9].replace("%", "/"), ros_type(part[10]), part[11]) for part in parts if part[5] == kind}

    def nodes(self):
        parts = [token.split("/") for token in list(self.tokens)]
        return {part[7].replace("%", "/").rstrip("/") + "/" + part[8] for part in parts if part[5] == "NN"}

    def call(self, service, type_name, body):
        """The body of the response."""
        has = lambda: [hash for name, kind, hash in self.ends("SS") if (name, kind) == (service, type_name)]
        hash = wait_for(service, has)[0]
        replies = self.session.get(
            f"{DOMAIN}{service}/{dds_type(type_name)}/{hash}",
            payload=HEADER + body,
            attachment=attachment(1),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=PATIENCE_S,
        )
        for reply in replies:
            number, _, length, sender = struct.unpack("<qqB16s", reply.ok.attachment.to_bytes())
            assert (number, length, sender) == (1, 16, b"the foreign peer")
            response = reply.ok.payload.to_bytes()
            assert response[:4] == HEADER
            return response[4:]
        raise SystemExit(f"{service} did not answer")


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def zenohd():
    """The program, or None."""
    own = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo")) / "bin" / "zenohd"
    return os.environ.get("ZENOHD") or shutil.which("zenohd") or (str(own) if own.is_file() else None)


class Router:
    """`config` is a file, which has the port."""

    def __init__(self, port=None, config=None):
        self.port = port or free_port()
        self.config = config
        self.start()
        print(f"router: {self.name}", flush=True)

    def start(self):
        program = zenohd()
        if program:
            listen = [] if self.config else ["--listen", f"tcp/127.0.0.1:{self.port}"]
            command = [program, "--config", self.config or str(ROUTER_CONFIG), *listen]
            says = subprocess.run([program, "--version"], capture_output=True, text=True).stdout
            self.name = re.search(r"zenohd v[\d.]+|$", says).group() or program
        else:
            command = [sys.executable, __file__, "--router", self.config or str(self.port)]
            self.name = f"that of eclipse-zenoh {version_of('eclipse-zenoh')}"
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        def is_open():
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", self.port)) == 0

        wait_for("the router", is_open)

    def kill(self):
        self.process.kill()
        self.process.wait()


def run_router(port_or_config):
    if port_or_config.isdigit():
        config = zenoh.Config()
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port_or_config}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
    else:
        config = zenoh.Config.from_file(port_or_config)
    with zenoh.open(config):
        threading.Event().wait()


class Suite:
    """The program in an environment of its own."""

    def __init__(self, program, port, folder):
        self.program = program
        self.folder = folder
        self.environment = dict(os.environ, ROS_DOMAIN_ID=str(DOMAIN), RMW_IMPLEMENTATION="rmw_zenoh_cpp")
        self.environment["ZENOH_CONFIG_OVERRIDE"] = (
            f'connect/endpoints=["tcp/127.0.0.1:{port}"];connect/retry={{period_init_ms:200,period_max_ms:500}}'
        )

    def start(self, *arguments):
        log = open(self.folder / f"{arguments[0]}.log", "w")
        return subprocess.Popen([self.program, *arguments], env=self.environment, stdout=log, stderr=log)

    def run(self, *arguments, **more):
        environment = dict(self.environment, **more)
        done = subprocess.run([self.program, *arguments], env=environment, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{arguments}: {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done


def end(process):
    process.send_signal(signal.SIGINT)
    code = process.wait(PATIENCE_S)
    assert code == 0, code


@contextlib.contextmanager
def running_node(program, name, folder, environment):
    """A node that has to end well; what it logged is printed where it, or what is checked meanwhile, fails."""
    with open(folder / f"{name}.log", "w+") as log:
        node = subprocess.Popen([program, "node", name], env=environment, stdout=log, stderr=log)
        try:
            yield
            end(node)
        except BaseException:
            log.seek(0)
            print(log.read()[-3000:], file=sys.stderr)
            raise
        finally:
            node.kill()


def check_graph(peer):
    """Names, and hashes as ROS 2 has them."""
    wait_for("the node", lambda: "/reconstruction" in peer.nodes())
    standard = {}
    wait_for("its ends", lambda: ("/static_map", "sensor_msgs/msg/PointCloud2") in {one[:2] for one in peer.ends("MP")})
    wait_for("its services", lambda: any(one[0].endswith("/get_state") for one in peer.ends("SS")))
    for name, kind, hash in peer.ends("MP") | peer.ends("MS"):
        assert hash.startswith("RIHS01_") and len(hash) == 71, (name, kind, hash)
        if kind in TYPES.types:
            assert hash == TYPES.hash_rihs01(kind), (name, kind, hash)
            standard[kind] = hash
    assert len(standard) >= 4, standard
    services = {kind: hash for _, kind, hash in peer.ends("SS")}
    for kind, hash in SERVICE_HASHES.items():
        assert services[kind] == f"RIHS01_{hash}", kind
    return f"{len(standard)} types of messages and {len(SERVICE_HASHES)} of services have the hashes of ROS 2"


def check_parameters(peer):
    names = peer.call("/reconstruction/list_parameters", "rcl_interfaces/srv/ListParameters", struct.pack("<IIQ", 0, 0, 0))
    count = struct.unpack_from("<I", names)[0]
    assert count > 5, count
    body = struct.pack("<I", 1) + text("use_sim_time")
    value = peer.call("/reconstruction/get_parameters", "rcl_interfaces/srv/GetParameters", body)
    assert struct.unpack_from("<IB?", value) == (1, 1, False), value
    return f"{count} parameters listed, one read"


def check_lifecycle(peer):
    state = lambda: peer.call("/reconstruction/get_state", "lifecycle_msgs/srv/GetState", b"\0")[0]
    assert state() == 3
    change = lambda number: peer.call(
        "/reconstruction/change_state", "lifecycle_msgs/srv/ChangeState", struct.pack("<B3x", number) + text("")
    )[0]
    # Deactivate, and activate again.
    assert change(4) == 1 and state() == 2
    assert change(3) == 1 and state() == 3
    return "inactive and active again"


def check_topics(peer, suite):
    """From the suite to the peer and back."""
    reports = []
    key = topic_key("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    heard = peer.session.declare_subscriber(key, lambda sample: reports.append(sample))
    wait_for("diagnostics", lambda: len(reports) >= 2)
    for report in reports[:2]:
        message = TYPES.deserialize_cdr(report.payload.to_bytes(), "diagnostic_msgs/msg/DiagnosticArray")
        assert message.status[0].name == "/reconstruction", message
    numbers = [struct.unpack("<qqB16s", one.attachment.to_bytes())[0] for one in reports[:2]]
    assert numbers[1] == numbers[0] + 1, numbers
    heard.undeclare()

    # A latched topic, to one who comes late.
    lines = []
    history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=10)
    key = topic_key("/rosout", "rcl_interfaces/msg/Log")
    late = zenoh.ext.declare_advanced_subscriber(
        peer.session, key, lambda sample: lines.append(sample), history=history, subscriber_detection=True
    )
    wait_for("lines of the log from before", lambda: lines)
    line = TYPES.deserialize_cdr(lines[0].payload.to_bytes(), "rcl_interfaces/msg/Log")
    assert line.name == "reconstruction", line
    late.undeclare()

    # Back: recorded as it was sent, that of a latched topic from before too.
    string = lambda value: HEADER + text(value)
    kind = ("std_msgs/msg/String", TYPES.hash_rihs01("std_msgs/msg/String"))
    latched = zenoh.ext.declare_advanced_publisher(
        peer.session,
        topic_key("/foreign/latched", "std_msgs/msg/String"),
        cache=zenoh.ext.CacheConfig(1),
        publisher_detection=True,
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=0.5),
    )
    latched.put(string("from before"), attachment=attachment(1))
    plain = peer.session.declare_publisher(topic_key("/foreign/plain", "std_msgs/msg/String"))
    tokens = [
        peer.announce("MP", 1, "/foreign/latched", *kind, ":1:,1:,:,:,,"),
        peer.announce("MP", 2, "/foreign/plain", *kind),
    ]
    bag = suite.folder / "foreign.mcap"
    recorder = suite.start("record", "-o", str(bag), "--topics", "/foreign/latched,/foreign/plain")
    wait_for("the recorder", lambda: {"/foreign/plain", "/foreign/latched"} <= {one[0] for one in peer.ends("MS")})
    time.sleep(1.0)
    for number in range(1, 21):
        plain.put(string(f"number {number}"), attachment=attachment(number))
        time.sleep(0.01)
    time.sleep(1.0)
    end(recorder)
    for token in tokens:
        token.undeclare()
    facts = json.loads(suite.run("info", "--json", str(bag)).stdout)
    counts = {topic["topic"]: topic["message_count"] for topic in facts["topics"]}
    assert counts == {"/foreign/latched": 1, "/foreign/plain": 20}, counts
    return "diagnostics, late lines of the log; 20 messages and a latched one recorded"


def check_unknown_type(peer, suite):
    """One that the suite does not define is recorded with its hash, and played by it."""
    kind = ("other_msgs/msg/Thing", "RIHS01_" + "ab" * 32)
    key = f"{DOMAIN}/foreign/thing/{dds_type(kind[0])}/{kind[1]}"
    sent = [HEADER + struct.pack("<I", number) for number in range(10)]
    bag = suite.folder / "thing.mcap"
    token = peer.announce("MP", 3, "/foreign/thing", *kind)
    recorder = suite.start("record", "-o", str(bag), "--topics", "/foreign/thing")
    wait_for("the recorder", lambda: "/foreign/thing" in {one[0] for one in peer.ends("MS")})
    time.sleep(1.0)
    for number, message in enumerate(sent, 1):
        peer.session.put(key, message, attachment=attachment(number))
    # Those of rmw_zenoh before 0.2.4, the second of which was taken for a number and a time.
    for number in (15, 16):
        peer.session.put(key, sent[0], attachment=b"\x0fsequence_number" + struct.pack("<q", number) + bytes(53))
    time.sleep(1.0)
    end(recorder)
    token.undeclare()
    heard = []
    ear = peer.session.declare_subscriber(key, lambda sample: heard.append(sample.payload.to_bytes()))
    token = peer.announce("MS", 4, "/foreign/thing", *kind)
    suite.run("play", str(bag), "--wait-for", "/foreign/thing")
    wait_for("what was recorded", lambda: len(heard) >= len(sent))
    assert heard == sent, heard
    ear.undeclare()
    token.undeclare()
    return f"{len(heard)} messages recorded and played"


def check_router(peer_of, router, suite):
    """Killed and back: all find each other again."""
    router.kill()
    time.sleep(1.0)
    router.start()
    started = time.monotonic()
    peer = peer_of()
    wait_for("the node again", lambda: "/reconstruction" in peer.nodes())
    check_parameters(peer)
    peer.session.close()
    return f"found again within {time.monotonic() - started:.1f} s"


def check_run(suite):
    """The whole suite in processes of its own, on both transports: the same map."""
    bag = suite.folder / "room.mcap"
    room = "simulate --scene B --object person --path A --platform sway --seconds 5 --depth-size 160 120 -o".split()
    suite.run(*room, str(bag))
    maps = {}
    for name, implementation in (("zenoh", "rmw_zenoh_cpp"), ("dds", "")):
        out = suite.folder / name
        arguments = ["run", str(bag), "--transport", "dds", "--map-edge", "0.03", "--out", str(out)]
        suite.run(*arguments, RMW_IMPLEMENTATION=implementation)
        maps[name] = (out / "map.ply").read_bytes()
    assert maps["zenoh"] == maps["dds"], {name: len(bytes) for name, bytes in maps.items()}
    return f"the same map of {len(maps['dds'])} bytes as over DDS"


def main(program):
    router = Router()
    port = router.port
    with tempfile.TemporaryDirectory() as folder:
        suite = Suite(program, port, Path(folder))
        node = suite.start("node", "reconstruction")
        peer_of = lambda: Peer(port)
        peer = peer_of()
        try:
            print("graph:", check_graph(peer))
            print("parameters:", check_parameters(peer))
            print("life cycle:", check_lifecycle(peer))
            print("topics:", check_topics(peer, suite))
            print("a type that is not defined here:", check_unknown_type(peer, suite))
            peer.session.close()
            print("router killed and back:", check_router(peer_of, router, suite))
            print("run:", check_run(suite), flush=True)
            end(node)
        finally:
            for log in sorted(suite.folder.glob("*.log")):
                print(f"--- {log.name}", log.read_text()[-3000:], sep="\n", file=sys.stderr)
            node.kill()
            router.kill()


if __name__ == "__main__":
    if sys.argv[1] == "--router":
        run_router(sys.argv[2])
    else:
        main(sys.argv[1])
