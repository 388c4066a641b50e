"""A training whose pod is evicted repeatedly, while other tests run.

Kubernetes waits 10 s before it creates the second pod of a Job, and doubles the delay for each further pod.
So this training waits for more than a minute in total.
"""

from dataclasses import dataclass
from typing import Self

from tests.e2e.beside import Beside
from tests.e2e.cluster import Object
from tests.e2e.jobs import make_slow_job
from tests.e2e.namespace import Namespace

NAME = "drained"
EVICTIONS = 3  # more evictions would only lengthen the test
EVERY_STEPS = 100
APART = 100
STEPS = 1500
NEXT_POD_S = 600.0


@dataclass(frozen=True)
class Evicted:
    """The steps `seen` before each eviction, the `attempts` of the run, and the name of the `last` pod."""

    seen: list[int]
    attempts: list[Object]
    last: str


class Evictions:
    """The training that is evicted, and its `namespace`."""

    def __init__(self, namespace: Namespace) -> None:
        self.namespace = namespace

    def __enter__(self) -> Self:
        """Start the training and the evictions."""
        self.namespace.apply(make_slow_job(NAME, steps=STEPS, every_steps=EVERY_STEPS, backoffLimit=0))
        self._evicted = Beside(self._evict_again_and_again)
        return self

    def __exit__(self, *_: object) -> None:
        """Delete the namespace; an eviction that still waits for a pod then fails."""
        self.namespace.delete()

    def result(self) -> Evicted:
        """Return the result after the last eviction."""
        return self._evicted.result()

    def _evict_again_and_again(self) -> Evicted:
        seen = [self._evict(APART * number) for number in range(1, EVICTIONS + 1)]
        last, _ = self.namespace.wait_for_step(NAME, seen[-1], NEXT_POD_S)
        return Evicted(seen, self.namespace.in_run(last, "attempts.jsonl"), last)

    def _evict(self, step: int) -> int:
        """Evict the pod after it has passed a step, as a drain of its node does; return the observed step."""
        space = self.namespace
        pod, seen = space.wait_for_step(NAME, step, NEXT_POD_S)
        space.cluster.evict(space.name, pod)
        space.wait(lambda: space.get("pods", pod) is None)
        return seen
