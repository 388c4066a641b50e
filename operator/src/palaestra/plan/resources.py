"""CPU and memory of the containers, and the number of threads that follows from them.

The defaults let two replicas of two simulators each, and the operator, fit on two cores: a replica
asks for 425m. Small networks learn no faster with a second thread, so the trainer has one.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from palaestra.api.container import Resources

Quantities = Mapping[str, str]
CORES = {"m": 0.001, "": 1.0, "k": 1000.0}  # what CPUs are counted in
BYTES: dict[str, Decimal | int] = {
    "m": Decimal("0.001"),
    "": 1, "k": 10**3, "M": 10**6, "G": 10**9, "T": 10**12, "P": 10**15,
    "Ki": 2**10, "Mi": 2**20, "Gi": 2**30, "Ti": 2**40, "Pi": 2**50,
}  # fmt: skip

Planned = dict[str, dict[str, str]]

NONE = Resources()


@dataclass(frozen=True, slots=True, kw_only=True)
class Defaults:
    """An installation's resources for containers of jobs that mention none; Palaestra's own fill the rest."""

    ros_master: Resources = NONE
    simulator: Resources = NONE
    trainer: Resources = NONE


NO_DEFAULTS = Defaults()

ROS_MASTER = Resources(requests={"cpu": "25m", "memory": "64Mi"}, limits={"memory": "256Mi"})
SIMULATOR = Resources(requests={"cpu": "75m", "memory": "160Mi"}, limits={"memory": "2Gi"})
# 100 MB without a camera, 200 MB with one, beside the sidecar.
MUJOCO = Resources(requests={"cpu": "75m", "memory": "256Mi"}, limits={"memory": "2Gi"})
TRAINER = Resources(requests={"cpu": "250m", "memory": "768Mi"}, limits={"cpu": "1", "memory": "2Gi"})


def resources(wanted: Resources, default: Resources) -> Planned:
    """Return what the job asks for, with defaults for the resources that it does not mention."""
    mentioned = wanted.requests.keys() | wanted.limits.keys()

    def merged(defaults: Quantities, given: Quantities) -> dict[str, str]:
        kept = {name: value for name, value in defaults.items() if name not in mentioned}
        return {**kept, **given}

    planned = {
        "requests": merged(default.requests, wanted.requests),
        "limits": merged(default.limits, wanted.limits),
    }
    return {field: value for field, value in planned.items() if value}


def by_default(installation: Resources, release: Resources) -> Resources:
    """Return the default of a container: the installation's, and the release's where that mentions none."""
    return Resources.model_validate(resources(installation, release))


def for_two(planned: Planned) -> Planned:
    """Return the resources of a container in which a second simulator stands by: twice the memory.

    One of the two computes at a time, so they share the processor.
    """
    return {
        field: {name: twice(value) if name == "memory" else value for name, value in quantities.items()}
        for field, quantities in planned.items()
    }


def twice(quantity: str) -> str:
    """Return a quantity doubled, in its own unit."""
    number, unit = _split(quantity)
    return f"{(2 * Decimal(number)).normalize():f}{unit}"


def in_bytes(memory: str) -> int:
    """Return how many bytes an amount of memory such as 400Mi is."""
    number, unit = _split(memory)
    return int(Decimal(number) * BYTES[unit])


def threads(planned: Planned) -> int:
    """Return how many threads the CPU limit is good for, 1 where there is none."""
    number, unit = _split(planned.get("limits", {}).get("cpu", "1"))
    return max(math.ceil(float(number) * CORES[unit]), 1)


def asks_for_gpu(wanted: Resources) -> bool:
    """Return whether requests or limits name a GPU, such as nvidia.com/gpu, and more than none of it."""
    quantities = (*wanted.requests.items(), *wanted.limits.items())
    return any(name.endswith("/gpu") and Decimal(_split(quantity)[0]) > 0 for name, quantity in quantities)


def _split(quantity: str) -> tuple[str, str]:
    """Return number and unit of a quantity."""
    number = quantity.rstrip("mkMGTPKi")
    return number, quantity.removeprefix(number)
