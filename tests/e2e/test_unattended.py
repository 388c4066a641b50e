"""A run that nobody attends to, in a cluster that takes its pods away again and again."""

import pytest

from tests.e2e.evictions import EVERY_STEPS, EVICTIONS, NAME, NEXT_POD_S, STEPS
from tests.e2e.namespace import named


@pytest.mark.comes_late
@pytest.mark.timeout(1500)
def test_five_evictions_cost_at_most_a_checkpoint_interval_each(evictions):
    """None of them counts against `backoffLimit`, and the status has counted each of them once."""
    seen, namespace = evictions.seen(), evictions.namespace
    last = namespace.wait_for_step(NAME, seen[-1], NEXT_POD_S)
    attempts = namespace.in_run(last, "attempts.jsonl")

    resumed = [int(each["reason"].removeprefix("resumed at step ")) for each in attempts[1:]]
    assert len(resumed) == EVICTIONS
    assert all(at >= before - EVERY_STEPS for at, before in zip(resumed, seen, strict=True))
    assert namespace.wait_for_end(NAME) == "Succeeded"
    replica = namespace.replica(NAME)
    assert replica["step"] == STEPS
    assert replica["attempt"] == EVICTIONS + 1
    assert replica["restarts"] == {"trainer": 0, "simulator": 0, "disruption": EVICTIONS, "suspension": 0}
    assert [named(pod) for pod in namespace.pods(NAME, live=False)] == [last]
