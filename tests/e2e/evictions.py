"""A training whose pod is evicted again and again, beside the other tests.

For more than a minute of it nothing happens: Kubernetes waits 10 s before the second pod of a Job, and
twice as long before each further one.
"""

from dataclasses import dataclass
from typing import Self

from tests.e2e.beside import Beside
from tests.e2e.cluster import Object
from tests.e2e.jobs import make_slow_job
from tests.e2e.namespace import Namespace

NAME = "drained"
EVICTIONS = 3  # each further one would only wait longer
EVERY_STEPS = 100
APART = 100
STEPS = 1500
NEXT_POD_S = 600.0


@dataclass(frozen=True)
class Evicted:
    """What came of it: the step `seen` before each eviction, the run's `attempts`, its `last` pod."""

    seen: list[int]
    attempts: list[Object]
    last: str


class Evictions:
    """The evicted job, and the `namespace` it is in."""

    def __init__(self, namespace: Namespace) -> None:
        self.namespace = namespace

    def __enter__(self) -> Self:
        """Begin the training, and evicting its pods."""
        self.namespace.apply(make_slow_job(NAME, steps=STEPS, every_steps=EVERY_STEPS, backoffLimit=0))
        self._evicted = Beside(self._evict_again_and_again)
        return self

    def __exit__(self, *_: object) -> None:
        """Take the job away; an eviction that waits for a pod finds none."""
        self.namespace.delete()

    def result(self) -> Evicted:
        """Return what came of the evictions, once the last of them is over."""
        return self._evicted.result()

    def _evict_again_and_again(self) -> Evicted:
        seen = [self._evict(APART * number) for number in range(1, EVICTIONS + 1)]
        last, _ = self.namespace.wait_for_step(NAME, seen[-1], NEXT_POD_S)
        return Evicted(seen, self.namespace.in_run(last, "attempts.jsonl"), last)

    def _evict(self, step: int) -> int:
        """Evict the pod past a step, as a drain of its node does; return the step it was seen at."""
        space = self.namespace
        pod, seen = space.wait_for_step(NAME, step, NEXT_POD_S)
        space.cluster.evict(space.name, pod)
        space.wait(lambda: space.get("pods", pod) is None)
        return seen
