"""TrainingJobs that ended long ago: made as an earlier operator left them, with nothing beside them."""

from palaestra.cluster.resources import NAMESPACES, TRAINING_JOBS
from tests.bench import crowd

NAMESPACE = "finished"
ENDED = "2026-01-31T12:00:00Z"


def create(api, count):
    """Create TrainingJobs that have succeeded, before any operator runs."""
    api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": NAMESPACE}})

    def finish(name):
        api.create(TRAINING_JOBS, crowd.training_job(name, NAMESPACE))
        api.merge(TRAINING_JOBS, NAMESPACE, name, {"status": status()}, subresource="status")

    crowd.in_parallel(finish, crowd.names(count))


def status():
    """Return the status of a job whose only replica has succeeded."""
    told = {"reason": "Succeeded", "message": "1 of 1 replicas succeeded", "lastTransitionTime": ENDED}
    replica = {
        "index": 0,
        "phase": "Succeeded",
        "reason": "Succeeded",
        "message": "the training is complete: 20000 steps, success rate 0.97",
        "attempt": 1,
        "step": 20_000,
        "target": 20_000,
        "successRate": 0.97,
    }
    return {
        "phase": "Succeeded",
        "observedGeneration": 1,
        "conditions": [
            {"type": "Accepted", "status": "True", "observedGeneration": 1, **told, "reason": "Accepted"},
            {"type": "Succeeded", "status": "True", "observedGeneration": 1, **told},
        ],
        "release": {"trainer": "trainer:bench", "stub": "stub:bench", "webots": "webots:bench"},
        "startTime": ENDED,
        "completionTime": ENDED,
        "running": "1/1",
        "step": 20_000,
        "successRate": 0.97,
        "replicas": [replica],
    }
