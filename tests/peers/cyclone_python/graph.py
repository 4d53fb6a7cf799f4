"""Nodes of a foreign graph: publishers that send one message again and again, subscriptions, and the names of nodes as
ROS 2 announces them. `README.md` above says what it does."""

import json
import os
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import messages

PERIOD_S = 0.1
DEPTH = 10

# `rmw_dds_common`, with as many bytes in the name of an endpoint as the release has: 24 until Humble, 16 since Iron.
ANNOUNCEMENT = "rmw_dds_common/msg/ParticipantEntitiesInfo"


def announcement(gid_bytes):
    return {
        "rmw_dds_common/msg/Gid": f"uint8[{gid_bytes}] data\n",
        "rmw_dds_common/msg/NodeEntitiesInfo": (
            "string node_namespace\nstring node_name\nGid[] reader_gid_seq\nGid[] writer_gid_seq\n"
        ),
        ANNOUNCEMENT: "Gid gid\nNodeEntitiesInfo[] node_entities_info_seq\n",
    }


def profile(reliability, durability):
    latched = durability == "transient_local"
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1))
        if reliability == "reliable"
        else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(DEPTH),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )


def stamp(message, offset_s):
    """Sets all stamps of a message, given in JSON."""
    now_ns = time.time_ns() + round(offset_s * 1e9)
    for header in headers(message):
        header["stamp"] = {"sec": now_ns // 10**9, "nanosec": now_ns % 10**9}


def headers(value):
    if isinstance(value, dict):
        for name, inner in value.items():
            if name == "header":
                yield inner
            else:
                yield from headers(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from headers(inner)


class Graph:
    def __init__(self, domain):
        self.participant = DomainParticipant(int(domain))
        self.types = messages.read(os.environ["STILLMAP_MSG_FOLDER"])
        self.ends, self.speakers = [], []

    def add(self, order):
        if "node" in order:
            self.announce(order["node"], order["gid_bytes"])
            return
        message = self.types[order["type"]]
        topic = Topic(self.participant, f"rt{order['topic']}", message.type)
        qos = profile(order["reliability"], order["durability"])
        if order["message"] is None:
            self.ends.append(DataReader(self.participant, topic, qos=qos))
        else:
            writer = DataWriter(self.participant, topic, qos=qos)
            self.speakers.append((writer, message, order))

    def announce(self, node, gid_bytes):
        texts, built = announcement(gid_bytes), {}
        message = messages.build(ANNOUNCEMENT, texts, built)
        topic = Topic(self.participant, "ros_discovery_info", message.type)
        writer = DataWriter(self.participant, topic, qos=profile("reliable", "transient_local"))
        gid = {"data": list(self.participant.guid.bytes.ljust(gid_bytes, b"\0"))}
        namespace, _, name = node.rpartition("/")
        of_node = {
            "node_namespace": namespace or "/",
            "node_name": name,
            "reader_gid_seq": [],
            "writer_gid_seq": [],
        }
        writer.write(message.from_json({"gid": gid, "node_entities_info_seq": [of_node]}))
        self.ends.append(writer)

    def speak(self):
        for writer, message, order in self.speakers:
            if order["offset_s"] is not None:
                stamp(order["message"], order["offset_s"])
            writer.write(message.from_json(order["message"]))


def run(domain):
    graph = Graph(domain)
    print("ready", flush=True)
    orders, ended = [], threading.Event()

    def listen():
        for line in sys.stdin:
            orders.append(json.loads(line))
        ended.set()

    threading.Thread(target=listen, daemon=True).start()
    while not ended.wait(PERIOD_S):
        while orders:
            graph.add(orders.pop(0))
            print("created", flush=True)
        graph.speak()
