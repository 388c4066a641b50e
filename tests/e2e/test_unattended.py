"""A run without supervision, in a cluster that evicts its pods repeatedly."""

import pytest

from tests.e2e.evictions import EVERY_STEPS, EVICTIONS, NAME, STEPS
from tests.e2e.namespace import LONG_S, NO_RESTARTS, named


@pytest.mark.comes_late
@pytest.mark.timeout(1500)
def test_each_of_several_evictions_costs_at_most_a_checkpoint_interval(evictions):
    """The next pod resumes from the last checkpoint.

    No eviction counts against `backoffLimit`, and the status counts each eviction once.
    """
    evicted, namespace = evictions.result(), evictions.namespace

    resumed = [int(each["reason"].removeprefix("resumed at step ")) for each in evicted.attempts[1:]]
    assert len(resumed) == EVICTIONS
    assert all(at >= before - EVERY_STEPS for at, before in zip(resumed, evicted.seen, strict=True))
    assert namespace.wait_for_end(NAME, LONG_S) == "Succeeded"
    replica = namespace.replica(NAME)
    assert replica["step"] == STEPS
    assert replica["attempt"] == EVICTIONS + 1
    assert replica["restarts"] == {**NO_RESTARTS, "disruption": EVICTIONS}
    assert [named(pod) for pod in namespace.pods(NAME, live=False)] == [evicted.last]
