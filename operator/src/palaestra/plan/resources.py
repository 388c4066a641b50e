"""CPU and memory of the containers, and the number of threads that follows from them.

The defaults let two replicas of two simulators each, and the operator, fit on two cores: a replica
asks for 425m. Small networks learn no faster with a second thread, so the trainer has one.
"""

import math
from collections.abc import Mapping

from palaestra.api.container import Resources

Quantities = Mapping[str, str]
CORES = {"m": 0.001, "": 1.0, "k": 1000.0}  # what CPUs are counted in

Planned = dict[str, dict[str, str]]

ROS_MASTER = Resources(requests={"cpu": "25m", "memory": "64Mi"}, limits={"memory": "256Mi"})
SIMULATOR = Resources(requests={"cpu": "75m", "memory": "160Mi"}, limits={"memory": "2Gi"})
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


def threads(planned: Planned) -> int:
    """Return how many threads the CPU limit is good for, 1 where there is none."""
    limit = planned.get("limits", {}).get("cpu", "1")
    number = limit.rstrip("mkMGTPi")
    return max(math.ceil(float(number) * CORES[limit.removeprefix(number)]), 1)
