"""CPU and memory of the containers, and the number of threads that follows from the CPU limit.

With the defaults, a replica with two simulators requests 425m of CPU. So the operator and two such replicas
fit on two cores. A second thread does not speed up small networks, so the trainer has one thread.
"""

import math
from dataclasses import dataclass
from decimal import Decimal

from palaestra.api.container import Resources

UNITS: dict[str, Decimal | int] = {
    "m": Decimal("0.001"),
    "": 1, "k": 10**3, "M": 10**6, "G": 10**9, "T": 10**12, "P": 10**15,
    "Ki": 2**10, "Mi": 2**20, "Gi": 2**30, "Ti": 2**40, "Pi": 2**50,
}  # fmt: skip

Planned = dict[str, dict[str, str]]

NONE = Resources()


@dataclass(frozen=True, slots=True, kw_only=True)
class Defaults:
    """An installation's default resources of containers; Palaestra's own defaults complete them."""

    ros_master: Resources = NONE
    simulator: Resources = NONE
    trainer: Resources = NONE


NO_DEFAULTS = Defaults()

ROS_MASTER = Resources(requests={"cpu": "25m", "memory": "64Mi"}, limits={"memory": "256Mi"})
SIMULATOR = Resources(requests={"cpu": "75m", "memory": "160Mi"}, limits={"memory": "2Gi"})
# MuJoCo uses 100 MB without a camera and 200 MB with a camera, in addition to the sidecar.
MUJOCO = Resources(requests={"cpu": "75m", "memory": "256Mi"}, limits={"memory": "2Gi"})
TRAINER = Resources(requests={"cpu": "250m", "memory": "768Mi"}, limits={"cpu": "1", "memory": "2Gi"})


def resources(wanted: Resources, default: Resources) -> Planned:
    """Return the job's resources, with defaults for all resources that the job does not set.

    If a job sets only the request of a resource, the default limit stays, but is raised to the request if the
    request is larger. Without a limit, one container could use all memory of its node. If a job sets only a
    limit, the default request is left out. Then the API server sets the request to the limit.
    """
    requests = {name: value for name, value in default.requests.items() if name not in wanted.limits}
    limits = {
        name: max(value, wanted.requests.get(name, value), key=_amount)
        for name, value in default.limits.items()
    }
    planned = {"requests": {**requests, **wanted.requests}, "limits": {**limits, **wanted.limits}}
    return {field: value for field, value in planned.items() if value}


def by_default(installation: Resources, release: Resources) -> Resources:
    """Return the default resources of a container: the installation's, completed by the release's."""
    return Resources.model_validate(resources(installation, release))


def for_two(planned: Planned) -> Planned:
    """Return the resources of a container with a standby simulator: twice the memory.

    Only one of the two simulators computes at a time, so the CPU is not doubled.
    """
    return {
        field: {name: twice(value) if name == "memory" else value for name, value in quantities.items()}
        for field, quantities in planned.items()
    }


def twice(quantity: str) -> str:
    """Return the double of a quantity, in the same unit."""
    number, unit = _split(quantity)
    return f"{(2 * Decimal(number)).normalize():f}{unit}"


def in_bytes(memory: str) -> int:
    """Return the bytes of an amount of memory, such as 400Mi."""
    return int(_amount(memory))


def threads(planned: Planned) -> int:
    """Return the number of threads for the CPU limit; 1 without a limit."""
    return max(math.ceil(_amount(planned.get("limits", {}).get("cpu", "1"))), 1)


def asks_for_gpu(wanted: Resources) -> bool:
    """Return whether requests or limits name a GPU, such as nvidia.com/gpu, in an amount above 0."""
    names = (*wanted.requests, *wanted.limits)
    return any(name.endswith("/gpu") and asks_for(name, wanted) for name in names)


def asks_for(resource: str, wanted: Resources) -> bool:
    """Return whether requests or limits name a resource in an amount above 0."""
    quantities = (wanted.requests.get(resource, "0"), wanted.limits.get(resource, "0"))
    return any(_amount(quantity) > 0 for quantity in quantities)


def _amount(quantity: str) -> Decimal:
    """Return the number of a quantity in its base unit: cores or bytes."""
    number, unit = _split(quantity)
    return Decimal(number) * UNITS[unit]


def _split(quantity: str) -> tuple[str, str]:
    """Return number and unit of a quantity."""
    number = quantity.rstrip("mkMGTPKi")
    return number, quantity.removeprefix(number)
