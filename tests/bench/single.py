"""The operator's requests to the API server for one TrainingJob, from its creation to its end."""

import time

from palaestra_protocol.pod.status import Termination, TrainerStatus
from tests.bench import crowd
from tests.integration.operator.cluster import Place
from tests.integration.operator.installed import READS, asked
from tests.trainer_status import serving

TRAINS_S = 10


def requests_of_one_job(plane, api):
    """Return the numbers of reads, writes and events: until the pod exists, and until the job succeeds."""
    place = Place(api)
    crowd.wait_for_account(api, place.name)
    before = len(asked(plane))
    place.train()
    [pod] = place.pods()
    crowd.wait_for_silence(plane)
    to_the_pod = counted(asked(plane)[before:])
    with training() as address:
        place.run(pod, address)
        time.sleep(TRAINS_S)  # the duration of the job's training
        place.end(pod, word=Termination(step=100, reason="Completed: the training is complete"))
        place.until("Succeeded")
    crowd.wait_for_silence(plane)
    return {"to_the_pod": to_the_pod, "to_the_end": counted(asked(plane)[before:])}


def counted(requests):
    """Return the number of reads, writes and events; watches and requests for the Lease do not count."""
    counts = [each for each in requests if each.counts]
    events = [each for each in counts if each.resource == "events" and each.verb not in READS]
    reads = [each for each in counts if each.verb in READS]
    return {"reads": len(reads), "writes": len(counts) - len(reads) - len(events), "events": len(events)}


def training():
    """Serve the status of a trainer that makes a hundred steps per second, and yield the address."""
    began = time.monotonic()

    def status():
        step = int(100 * (time.monotonic() - began))
        return TrainerStatus(step=step, target=100 * TRAINS_S, episodes=1, phase="collecting")

    return serving(status)
