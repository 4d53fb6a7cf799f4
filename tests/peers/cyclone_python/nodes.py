"""Who is who in the graph, as `ros2 node list` and `ros2 node info` find out: each participant announces its nodes with
the numbers of their endpoints on `ros_discovery_info`, and DDS itself tells the topics of those numbers.
`README.md` above says what it does."""

import json
import sys
import threading
import time
from dataclasses import dataclass

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import cdrv0, final
from cyclonedds.idl.types import array, sequence, uint8
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

LOOK_PERIOD_S = 0.05
DEPTH = 1000
TOPIC = "ros_discovery_info"
PREFIX_BYTES = 12


# As since ROS 2 Iron.
@dataclass
@cdrv0
@final
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16]


@dataclass
@cdrv0
@final
class Node(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
@cdrv0
@final
class Participant(IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[Node]


QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
)


def run(domain):
    participant = DomainParticipant(int(domain))
    announcements = DataReader(participant, Topic(participant, TOPIC, Participant), qos=QOS)
    ends = [
        BuiltinDataReader(participant, topic)
        for topic in (BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription)
    ]
    ended = threading.Event()
    # The test closes standard input to end the peer, and so does a test that dies.
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    topics, announced, told = {}, {}, None
    print("ready", flush=True)
    while not ended.is_set():
        for end in ends:
            for found in end.take(DEPTH):
                if found.sample_info.valid_data:
                    topics[found.key.bytes] = found.topic_name
        for sample in announcements.take(DEPTH):
            if sample.sample_info.valid_data:
                announced[bytes(sample.gid.data)[:PREFIX_BYTES]] = sample.node_entities_info_seq
        graph = [node for prefix, nodes in announced.items() for node in described(prefix, nodes, topics)]
        if graph != told:
            told = graph
            for node in graph:
                print("heard", json.dumps(node), flush=True)
        time.sleep(LOOK_PERIOD_S)


def described(prefix, nodes, topics):
    """The nodes of a participant, with the topics of their ends, and those of its ends that belong to none of them."""
    claimed = set()

    def names(gids):
        numbers = {bytes(gid.data) for gid in gids}
        claimed.update(numbers)
        return sorted(topics[number] for number in numbers if number in topics)

    described = [
        {
            "node": f"{node.node_namespace.rstrip('/')}/{node.node_name}",
            "readers": names(node.reader_gid_seq),
            "writers": names(node.writer_gid_seq),
        }
        for node in nodes
    ]
    nobodys = sorted(
        topic
        for number, topic in topics.items()
        if number[:PREFIX_BYTES] == prefix and number not in claimed and topic != TOPIC
    )
    return [node | {"nobodys": nobodys} for node in described]
