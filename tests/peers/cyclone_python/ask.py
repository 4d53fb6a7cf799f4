"""A client of a ROS 2 service on Cyclone DDS, as `rmw_cyclonedds` makes one: 16 bytes stand in front of
a request and come back in front of its response, the client's number and that of the request.
`README.md` above says what it does."""

import random
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import cdrv0, final
from cyclonedds.idl.types import int64, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

# The test gives up sooner.
PATIENCE_S = 180
LOOK_PERIOD_S = 0.005


@dataclass
@cdrv0
@final
class Request(IdlStruct, typename="std_srvs::srv::dds_::SetBool_Request_"):
    client: uint64
    sequence: int64
    data: bool


@dataclass
@cdrv0
@final
class Response(IdlStruct, typename="std_srvs::srv::dds_::SetBool_Response_"):
    client: uint64
    sequence: int64
    success: bool
    message: str


class Client:
    def __init__(self, participant, service):
        qos = Qos(
            Policy.Reliability.Reliable(duration(seconds=1)),
            Policy.Durability.Volatile,
            Policy.History.KeepLast(10),
            Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        )
        requests = Topic(participant, f"rq{service}Request", Request)
        responses = Topic(participant, f"rr{service}Reply", Response)
        self.reader = DataReader(participant, responses, qos=qos)
        self.writer = DataWriter(participant, requests, qos=qos)
        self.number = random.getrandbits(64)
        self.sequence = 0

    def has_matched(self):
        return bool(self.writer.get_matched_subscriptions() and self.reader.get_matched_publications())

    def ask(self, data):
        self.sequence += 1
        self.writer.write(Request(self.number, self.sequence, data))

    def take(self):
        """The response to what was asked last, if it has come."""
        for response in self.reader.take(10):
            if (response.client, response.sequence) == (self.number, self.sequence):
                return response
        return None


def run(domain, service, times):
    until = time.monotonic() + PATIENCE_S

    def wait():
        if time.monotonic() > until:
            sys.exit("cyclone client: waited in vain")
        time.sleep(LOOK_PERIOD_S)

    participant = DomainParticipant(int(domain))
    clients = [Client(participant, service), Client(participant, service)]
    while not all(client.has_matched() for client in clients):
        wait()
    for _ in range(int(times)):
        # Both before the first answer, so that each must tell its own.
        for number, client in enumerate(clients):
            client.ask(number == 1)
        for number, client in enumerate(clients):
            while not (response := client.take()):
                wait()
            print("answer", number, str(response.success).lower(), response.message, flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit("usage: ask.py DOMAIN SERVICE TIMES")
    run(*sys.argv[1:])
