"""A training whose pod is evicted again and again, beside the other tests.

It takes minutes in which nothing happens: Kubernetes waits 10 s before the second pod of a Job, and
twice as long before each further one.
"""

import threading
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Self

from tests.e2e.cluster import Object
from tests.e2e.jobs import make_job
from tests.e2e.namespace import SHORT_S, Namespace

NAME = "drained"
EVICTIONS = 5
EVERY_STEPS = 100
APART = 300
STEPS = 3000
NEXT_POD_S = 600.0
END_S = 1200.0
# So little that there is room for it beside the training in full.
PARTS = {"requests": {"cpu": "20m", "memory": "64Mi"}}
TRAINER = {
    "steps": STEPS,
    "checkpoint": {"everySteps": EVERY_STEPS},
    "evaluation": {"everySteps": 0},
    "resources": {"requests": {"cpu": "60m", "memory": "400Mi"}},
}


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
        self._result: Future[Evicted] = Future()
        self._drainer = threading.Thread(target=self._tell, daemon=True)

    def __enter__(self) -> Self:
        """Begin the training, and evicting its pods."""
        simulator = {"name": "collect", "role": "Collect", "resources": PARTS}
        self.namespace.apply(make_job(NAME, trainer=TRAINER, backoffLimit=0, simulators=[simulator]))
        self._drainer.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take the job away; an eviction that waits for a pod finds none."""
        self.namespace.delete()

    def result(self) -> Evicted:
        """Return what came of the evictions, once the last of them is over."""
        return self._result.result(END_S)

    def _tell(self) -> None:
        try:
            self._result.set_result(self._evict_again_and_again())
        except BaseException as error:  # noqa: BLE001 - whoever asks for the result gets it
            self._result.set_exception(error)

    def _evict_again_and_again(self) -> Evicted:
        seen = [self._evict(APART * number) for number in range(1, EVICTIONS + 1)]
        last = self.namespace.wait_for_step(NAME, seen[-1], NEXT_POD_S)
        return Evicted(seen, self.namespace.in_run(last, "attempts.jsonl"), last)

    def _evict(self, step: int) -> int:
        """Evict the pod past a step, as a drain of its node does; return the step it was seen at."""
        space = self.namespace
        pod = space.wait_for_step(NAME, step, NEXT_POD_S)
        seen = int(space.trainer_status(pod).get("step", step))
        space.cluster.evict(space.name, pod)
        space.wait(lambda: space.get("pods", pod) is None, SHORT_S)
        return seen
