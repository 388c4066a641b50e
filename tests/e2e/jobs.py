"""Small TrainingJobs: those that train need normal resources, and those that only wait fit next to others."""

import copy
from typing import Any

from tests.e2e.cluster import Object
from tests.jobs import example

WAIT = "trap exit TERM; sleep 3600 & wait"
LITTLE = {"requests": {"cpu": "5m", "memory": "48Mi"}}
# Steps that take time but no processor.
SLOW = {
    "name": "collect",
    "role": "Collect",
    "env": [{"name": "PALAESTRA_STUB_FAULTS", "value": "slow:latency_ms=40"}],
    "resources": {"requests": {"cpu": "20m", "memory": "64Mi"}},
}
SMALL = {"requests": {"cpu": "60m", "memory": "400Mi"}}


def make_claim(name: str, **metadata: Any) -> Object:
    """Return a claim that belongs to no job."""
    spec = {"accessModes": ["ReadWriteOnce"], "resources": {"requests": {"storage": "64Mi"}}}
    return {"metadata": {"name": name, **metadata}, "spec": spec}


def tiny_job(name: str = "tiny", *, script: str = "", simulator: Object | None = None, **spec: Any) -> Object:
    """Return manifests/examples/tiny.yaml with another `name` and these fields of its spec.

    `script` is bash that replaces the training, with one simulator only. `simulator` has fields of the first
    group of simulators; a given `trainer` is merged into the example's.
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
    """Return a training of at most 25 steps per second, so that it still runs after all checks.

    This holds however busy the machine is, and the job leaves room for others.
    """
    trainer = {
        "steps": steps,
        "checkpoint": {"everySteps": every_steps},
        "evaluation": {"everySteps": 0},
        "resources": SMALL,
    }
    return tiny_job(name, trainer=trainer, simulators=[SLOW], **spec)
