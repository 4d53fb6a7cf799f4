"""A client of any service, as `rmw_cyclonedds` makes one, and a subscriber to any topic: what `ros2 param`, `ros2 service
call` and `ros2 topic echo` do. `README.md` above says what it does."""

import json
import os
import random
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

# The test gives up sooner.
PATIENCE_S = 180
LOOK_PERIOD_S = 0.005
DEPTH = 1000

QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(DEPTH),
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
)

telling = threading.Lock()


def tell(word, value):
    with telling:
        print(word, json.dumps(value), flush=True)


class Client:
    def __init__(self, participant, service, request, response):
        self.request, self.response = request, response
        self.reader = DataReader(participant, Topic(participant, f"rr{service}Reply", response.type), qos=QOS)
        self.writer = DataWriter(participant, Topic(participant, f"rq{service}Request", request.type), qos=QOS)
        self.number = random.getrandbits(64)
        self.sequence = 0

    def call(self, value):
        until = time.monotonic() + PATIENCE_S
        self.sequence += 1
        header = {"client": self.number, "sequence": self.sequence}
        request = self.request.from_json(value | header)
        asked = False
        while time.monotonic() < until:
            if not asked and self.writer.get_matched_subscriptions() and self.reader.get_matched_publications():
                self.writer.write(request)
                asked = True
            for sample in self.reader.take(DEPTH):
                if sample.sample_info.valid_data:
                    response = self.response.to_json(sample)
                    if {name: response.pop(name) for name in header} == header:
                        return response
            time.sleep(LOOK_PERIOD_S)
        sys.exit("cyclone client: waited in vain")


def listen(participant, topic, message):
    reader = DataReader(participant, Topic(participant, f"rt{topic}", message.type), qos=QOS)
    while True:
        for sample in reader.take(DEPTH):
            if sample.sample_info.valid_data:
                tell("heard", [topic, message.to_json(sample)])
        time.sleep(LOOK_PERIOD_S)


def run(domain, topics):
    folder = os.environ["STILLMAP_MSG_FOLDER"]
    types = messages.read(folder)
    participant = DomainParticipant(int(domain))
    for topic, name in topics:
        threading.Thread(target=listen, args=(participant, topic, types[name]), daemon=True).start()
    clients = {}
    print("ready", flush=True)
    # The test closes standard input to end the peer, and so does a test that dies.
    for line in sys.stdin:
        service, name, value = json.loads(line)
        if service not in clients:
            clients[service] = Client(participant, service, *messages.service(folder, name))
        tell("answer", clients[service].call(value))
