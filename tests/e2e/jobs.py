"""Small TrainingJobs. Jobs that train request normal resources, and jobs that only wait request few."""

import copy
from typing import Any

from tests.e2e.cluster import Object
from tests.jobs import example

WAIT = "trap exit TERM; sleep 3600 & wait"
LITTLE = {"requests": {"cpu": "5m", "memory": "48Mi"}}
# A simulator whose steps take time but no processor time.
SLOW = {
    "name": "collect",
    "role": "Collect",
    "env": [{"name": "PALAESTRA_STUB_FAULTS", "value": "slow:latency_ms=40"}],
    "resources": {"requests": {"cpu": "20m", "memory": "64Mi"}},
}
SMALL = {"requests": {"cpu": "60m", "memory": "400Mi"}}


def make_claim(name: str, **metadata: Any) -> Object:
    """Return a PersistentVolumeClaim that belongs to no job."""
    spec = {"accessModes": ["ReadWriteOnce"], "resources": {"requests": {"storage": "64Mi"}}}
    return {"metadata": {"name": name, **metadata}, "spec": spec}


def tiny_job(name: str = "tiny", *, script: str = "", simulator: Object | None = None, **spec: Any) -> Object:
    """Return manifests/examples/tiny.yaml with another `name` and these fields of its spec.

    `script` is bash code that replaces the training; the job then has one simulator only. `simulator`
    contains fields of the first group of simulators. A `trainer` in `spec` is merged into the example's
    trainer.
    """
    job = example("tiny")
    job["metadata"]["name"] = name
    fields = job["spec"]
    fields["trainer"] |= spec.pop("trainer", {})
    if script:
        fields["simulators"] = fields["simulators"][:1]
        fields["trainer"] |= {
            "command": ["bash", "-c", script],
            "evaluation": {"everySteps": 0},
            "resources": LITTLE,
        }
        fields["simulators"][0]["resources"] = LITTLE
    fields["simulators"][0] |= simulator or {}
    fields.update(copy.deepcopy(spec))
    return job


def make_slow_job(name: str, *, steps: int, every_steps: int, **spec: Any) -> Object:
    """Return a training of at most 25 steps per second, which still runs when a test makes its checks.

    The simulator's latency limits the rate, so the rate is the same on any machine. The job requests few
    resources.
    """
    trainer = {
        "steps": steps,
        "checkpoint": {"everySteps": every_steps},
        "evaluation": {"everySteps": 0},
        "resources": SMALL,
    }
    return tiny_job(name, trainer=trainer, simulators=[SLOW], **spec)
