"""What happens in the cluster that is scraped."""

from palaestra_protocol.pod.status import Termination
from tests.integration.operator.cluster import Place
from tests.integration.operator.operators import RunningOperator
from tests.waiting import eventually


def address(operator: RunningOperator) -> str:
    """Return where an operator serves its metrics, once it does."""
    [line] = eventually(lambda: operator.said("started"))
    return str(line["address"])


def diverge(place: Place, job: str = "unlucky") -> None:
    """Let a job's replica be tried again once, and then diverge."""
    place.train(job)
    [first] = place.pods(job)
    place.run(first)
    place.until("Running", job)  # else an operator that is slow sees it for the first time when it has ended
    place.end(first, 1)
    [second] = place.pods(job)
    place.run(second)
    place.end(second, 81, Termination(step=7, reason="Diverged: the loss is NaN"))
    place.until("Failed", job)
