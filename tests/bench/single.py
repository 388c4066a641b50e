"""One TrainingJob from its creation to its end, and what the operator asks of the API server meanwhile."""

import http.server
import json
import threading
import time
from contextlib import contextmanager, suppress

from palaestra.plan.layout import STATUS_PORT
from palaestra_sim.protocol.status import TrainerStatus
from tests.bench import crowd
from tests.integration.operator.cluster import Place
from tests.integration.operator.installed import READS, asked

TRAINS_S = 10


def requests_of_one_job(plane, api):
    """Return reads, writes and events until the pod exists, and until the job has succeeded."""
    place = Place(api)
    crowd.wait_for_account(api, place.name)
    before = len(asked(plane))
    place.train()
    [pod] = place.pods()
    crowd.wait_for_silence(plane)
    to_the_pod = counted(asked(plane)[before:])
    with training() as address:
        place.run(pod, address)
        time.sleep(TRAINS_S)  # it trains
        place.end(pod)
        place.until("Succeeded")
    crowd.wait_for_silence(plane)
    return {"to_the_pod": to_the_pod, "to_the_end": counted(asked(plane)[before:])}


def counted(requests):
    """Return how many of these are reads, writes and events; watches and the Lease are none."""
    counts = [each for each in requests if each.counts]
    events = [each for each in counts if each.resource == "events" and each.verb not in READS]
    reads = [each for each in counts if each.verb in READS]
    return {"reads": len(reads), "writes": len(counts) - len(reads) - len(events), "events": len(events)}


@contextmanager
def training():
    """Serve the status of a trainer that makes a hundred steps a second; yields its address."""
    began = time.monotonic()

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            step = int(100 * (time.monotonic() - began))
            told = TrainerStatus(step=step, target=100 * TRAINS_S, episodes=1, phase="collecting")
            body = json.dumps(told.to_json()).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            """Print nothing: figures are printed here."""

    with serving(Answer) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_address[0]
        server.shutdown()
        thread.join()


def serving(answer):
    """Return a server with a trainer's port, at an address of the loopback where it is free."""
    for last in range(1, 255):
        with suppress(OSError):
            return http.server.ThreadingHTTPServer((f"127.91.91.{last}", STATUS_PORT), answer)
    raise RuntimeError(f"port {STATUS_PORT} is taken at every address")
