"""A peer on Cyclone's Python package for the tests: messages as objects with named fields.
`README.md` above says what the modes do."""

import json
import os
import sys
import threading

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import call
import graph
import messages
import nodes

# Samples that a volatile endpoint keeps; a latched one keeps the last.
DEPTH = 10
# Between two looks at what has come and who has matched.
LOOK_PERIOD_S = 0.005

ended = threading.Event()
orders = []


def tell(word, about=""):
    print(word, about, flush=True) if about else print(word, flush=True)


def listen():
    """The test closes standard input to end the peer, and so does a test that dies."""
    for line in sys.stdin:
        orders.append(line)
    ended.set()


def profile(reliability, durability):
    latched = durability == "transient_local"
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1))
        if reliability == "reliable"
        else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(1 if latched else DEPTH),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )


class Route:
    """From NAMESPACE/there/TYPE to NAMESPACE/back/TYPE."""

    def __init__(self, participant, namespace, message, qos):
        self.message = message
        self.matched = False
        there = Topic(participant, f"rt{namespace}/there/{message.name}", message.type)
        back = Topic(participant, f"rt{namespace}/back/{message.name}", message.type)
        self.reader = DataReader(participant, there, qos=qos)
        self.writer = DataWriter(participant, back, qos=qos)

    def look_for_match(self):
        if self.matched:
            return
        if self.reader.get_matched_publications() and self.writer.get_matched_subscriptions():
            self.matched = True
            tell("matched", self.message.name)


def run(mode, domain, namespace, reliability, durability):
    types = messages.read(os.environ["STILLMAP_MSG_FOLDER"])
    participant = DomainParticipant(int(domain))
    qos = profile(reliability, durability)
    routes = {
        name: Route(participant, namespace, message, qos) for name, message in types.items()
    }
    threading.Thread(target=listen, daemon=True).start()
    tell("ready")
    while not ended.wait(LOOK_PERIOD_S):
        for route in routes.values():
            for sample in route.reader.take(DEPTH):
                if not sample.sample_info.valid_data:
                    continue
                if mode == "echo":
                    route.writer.write(sample)
                else:
                    tell("heard", json.dumps([route.message.name, route.message.to_json(sample)]))
            route.look_for_match()
        while orders:
            name, value = json.loads(orders.pop(0))
            routes[name].writer.write(types[name].from_json(value))


if __name__ == "__main__":
    if sys.argv[1:2] == ["call"] and len(sys.argv) > 2 and len(sys.argv) % 2:
        call.run(sys.argv[2], list(zip(sys.argv[3::2], sys.argv[4::2])))
        sys.exit()
    if sys.argv[1:2] == ["nodes"] and len(sys.argv) == 3:
        nodes.run(sys.argv[2])
        sys.exit()
    if sys.argv[1:2] == ["graph"] and len(sys.argv) == 3:
        graph.run(sys.argv[2])
        sys.exit()
    if len(sys.argv) != 6 or sys.argv[1] not in ("echo", "name"):
        usage = "echo|name DOMAIN NAMESPACE RELIABILITY DURABILITY, call DOMAIN [TOPIC TYPE]..., nodes DOMAIN, or graph DOMAIN"
        sys.exit(f"usage: peer.py {usage}")
    run(*sys.argv[1:])
