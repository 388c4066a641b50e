"""A run that nobody attends to, in a cluster that takes its pods away again and again."""

import pytest

from tests.e2e.namespace import LONG_S, SHORT_S, named

pytestmark = [pytest.mark.trains, pytest.mark.timeout(900)]

EVICTIONS = 5
EVERY_STEPS = 100
APART = 300
STEPS = 3000


def evict(namespace, name, step):
    """Evict the pod once it is past a step, as a drain of its node does; return the step it was seen at."""
    pod = namespace.wait_for_step(name, step)
    seen = namespace.trainer_status(pod)["step"]
    namespace.cluster.evict(namespace.name, pod)
    namespace.wait(lambda: namespace.get("pods", pod) is None, SHORT_S)
    return seen


def test_five_evictions_cost_at_most_a_checkpoint_interval_each(namespace, job):
    """None of them counts against `backoffLimit`, and the status has counted each of them once."""
    training = {"steps": STEPS, "checkpoint": {"everySteps": EVERY_STEPS}, "evaluation": {"everySteps": 0}}
    namespace.apply(job("drained", trainer=training, backoffLimit=0))

    seen = [evict(namespace, "drained", APART * number) for number in range(1, EVICTIONS + 1)]
    last = namespace.wait_for_step("drained", seen[-1])
    attempts = namespace.in_run(last, "attempts.jsonl")

    resumed = [int(each["reason"].removeprefix("resumed at step ")) for each in attempts[1:]]
    assert len(resumed) == EVICTIONS
    assert all(at >= before - EVERY_STEPS for at, before in zip(resumed, seen, strict=True))
    assert namespace.wait_for_end("drained", LONG_S) == "Succeeded"
    replica = namespace.replica("drained")
    assert replica["step"] == STEPS
    assert replica["attempt"] == EVICTIONS + 1
    assert replica["restarts"] == {"trainer": 0, "simulator": 0, "disruption": EVICTIONS, "suspension": 0}
    assert [named(pod) for pod in namespace.pods("drained", live=False)] == [last]
