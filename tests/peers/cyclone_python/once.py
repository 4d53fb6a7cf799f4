"""One call of a service by a fresh process, made the moment discovery shows the service, and never again: what `ros2 param
get` does. `README.md` above says what it does."""

import json
import os
import random
import sys
import time

from cyclonedds.domain import DomainParticipant

import messages
from call import LOOK_PERIOD_S, Client

# The test gives up sooner.
PATIENCE_S = 180


def run(domain, service, name, value):
    until = time.monotonic() + PATIENCE_S

    def wait_until(holds):
        while not (found := holds()):
            if time.monotonic() > until:
                sys.exit(f"cyclone client: {holds.__name__} in vain")
            time.sleep(LOOK_PERIOD_S)
        return found

    participant = DomainParticipant(int(domain))
    client = Client(participant, service, *messages.service(os.environ["STILLMAP_MSG_FOLDER"], name))
    header = {"client": client.number, "sequence": random.getrandbits(31)}

    def waited_for_the_service():
        return client.writer.get_matched_subscriptions() and client.reader.get_matched_publications()

    def waited_for_the_answer():
        for sample in client.reader.take(10):
            if sample.sample_info.valid_data:
                response = client.response.to_json(sample)
                if {name: response.pop(name) for name in header} == header:
                    return response
        return None

    wait_until(waited_for_the_service)
    client.writer.write(client.request.from_json(json.loads(value) | header))
    print(json.dumps(wait_until(waited_for_the_answer)), flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit("usage: once.py DOMAIN SERVICE TYPE, and the request in JSON on standard input")
    run(*sys.argv[1:], sys.stdin.readline())
