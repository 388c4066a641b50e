"""A training whose pod is evicted again and again, beside the other tests."""

import threading
from concurrent.futures import Future
from typing import Self

from tests.e2e.jobs import make_job
from tests.e2e.namespace import SHORT_S, Namespace

NAME = "drained"
EVICTIONS = 5
EVERY_STEPS = 100
APART = 300
STEPS = 3000
NEXT_POD_S = (
    420.0  # Kubernetes waits 10 s before the second pod of a Job, and twice as long before each further one
)
END_S = 1200.0
# So little that there is room for it beside the training in full.
PARTS = {"requests": {"cpu": "40m", "memory": "64Mi"}}
TRAINER = {
    "steps": STEPS,
    "checkpoint": {"everySteps": EVERY_STEPS},
    "evaluation": {"everySteps": 0},
    "resources": {"requests": {"cpu": "60m", "memory": "400Mi"}},
}


class Evictions:
    """The evicted job: `namespace` it is in, and the steps at which its pods were seen last."""

    def __init__(self, namespace: Namespace) -> None:
        self.namespace = namespace
        self._seen: Future[list[int]] = Future()
        self._drainer = threading.Thread(target=self._evict_again_and_again, daemon=True)

    def __enter__(self) -> Self:
        """Begin the training, and evicting its pods."""
        collect = {"simulators": [{"name": "collect", "role": "Collect", "resources": PARTS}]}
        self.namespace.apply(make_job(NAME, trainer=TRAINER, backoffLimit=0, **collect))
        self._drainer.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take the job away; an eviction that waits for a pod finds none."""
        self.namespace.delete()

    def seen(self) -> list[int]:
        """Return the step at which each pod was seen before its eviction, once all are over."""
        return self._seen.result(END_S)

    def _evict_again_and_again(self) -> None:
        try:
            self._seen.set_result([self._evict(APART * number) for number in range(1, EVICTIONS + 1)])
        except BaseException as error:  # noqa: BLE001 - whoever asks for the steps gets it
            self._seen.set_exception(error)

    def _evict(self, step: int) -> int:
        """Evict the pod once it is past a step, as a drain of its node does."""
        space = self.namespace
        pod = space.wait_for_step(NAME, step, NEXT_POD_S)
        seen = int(space.trainer_status(pod)["step"])
        space.cluster.evict(space.name, pod)
        space.wait(lambda: space.get("pods", pod) is None, SHORT_S)
        return seen
