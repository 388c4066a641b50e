"""Events in the cluster that Prometheus scrapes."""

from palaestra_protocol.pod.status import Termination
from tests.integration.operator.cluster import Place
from tests.integration.operator.operators import RunningOperator
from tests.waiting import eventually


def address(operator: RunningOperator) -> str:
    """Return the address at which an operator serves its metrics, once it does."""
    [line] = eventually(lambda: operator.said("started"))
    return str(line["address"])


def diverge(place: Place, job: str = "unlucky") -> None:
    """Make a job's replica fail once, start again and then diverge."""
    place.train(job)
    [first] = place.pods(job)
    place.run(first)
    place.until("Running", job)  # otherwise a slow operator sees the pod for the first time after its end
    place.end(first, 1)
    [second] = place.pods(job)
    place.run(second)
    place.end(second, 81, Termination(step=7, reason="Diverged: the loss is NaN"))
    place.until("Failed", job)
