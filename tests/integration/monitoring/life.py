"""Situations in a cluster for the metrics that Prometheus scrapes."""

from palaestra_protocol.pod.status import Termination
from tests.integration.operator.cluster import Place
from tests.integration.operator.operators import RunningOperator
from tests.waiting import eventually


def address(operator: RunningOperator) -> str:
    """Wait until an operator serves its metrics, and return the address."""
    [line] = eventually(lambda: operator.said("started"))
    return str(line["address"])


def diverge(place: Place, job: str = "unlucky") -> None:
    """Let a job's replica fail once, restart, and then diverge."""
    place.train(job)
    [first] = place.pods(job)
    place.run(first)
    place.until("Running", job)  # a slow operator must see the pod before its end
    place.end(first, 1)
    [second] = place.pods(job)
    place.run(second)
    place.end(second, 81, Termination(step=7, reason="Diverged: the loss is NaN"))
    place.until("Failed", job)
