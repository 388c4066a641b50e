"""The decision after the end of a pod and the wait before the next pod, without starting a process."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api import validate
from palaestra.local.container import BackOff
from palaestra.local.retry_policy import IDLE_PODS, RetryVerdict, Tries, verdict
from palaestra.plan import ClusterLayout, Images, identified, plan

JOB = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": {"name": "a"}}
PLANNED = plan(identified(validate({**JOB, "spec": {}}), "uid"), ClusterLayout(images=Images.of_release("1")))


@pytest.mark.parametrize(
    ("code", "meaning"),
    [
        (0, RetryVerdict.COMPLETE),
        (1, RetryVerdict.COUNT),
        (2, RetryVerdict.FAIL_JOB),
        (75, RetryVerdict.IGNORE),
        (80, RetryVerdict.FAIL_JOB),
        (81, RetryVerdict.FAIL_JOB),
        (82, RetryVerdict.COUNT),
        (137, RetryVerdict.COUNT),
        (143, RetryVerdict.COUNT),
    ],
)
def test_the_planned_job_says_what_an_exit_code_means(code, meaning):
    """`palaestra run` reads the same rules as Kubernetes, so the exit codes are defined once."""
    assert verdict(PLANNED.replicas[0].job, code) is meaning


def test_without_a_policy_every_failure_is_counted():
    """Kubernetes also counts every failure by default."""
    assert verdict({"spec": {}}, 75) is RetryVerdict.COUNT


def test_rules_are_read_in_order_and_the_first_match_decides():
    """A local run must decide as Kubernetes does, which documents this order for `podFailurePolicy`."""
    rules = [
        {"action": "Ignore", "onExitCodes": {"operator": "NotIn", "values": [7]}},
        {"action": "FailJob", "onExitCodes": {"operator": "In", "values": [7, 8]}},
    ]
    job = {"spec": {"podFailurePolicy": {"rules": rules}}}

    assert verdict(job, 8) is RetryVerdict.IGNORE
    assert verdict(job, 7) is RetryVerdict.FAIL_JOB


@given(st.integers(min_value=0, max_value=20))
def test_a_limit_of_n_means_n_plus_one_pods(limit):
    """The limit counts retries, and the first pod is not a retry."""
    tries = Tries(limit=limit)
    pods = 1
    while tries.another(RetryVerdict.COUNT, step=0):
        pods += 1

    assert pods == limit + 1


def test_ignored_pods_that_get_no_further_are_bounded():
    """Kubernetes has no limit for ignored pods, so a job whose ROS master never starts would run for ever."""
    tries = Tries(limit=0)
    went_on = [tries.another(RetryVerdict.IGNORE, step=0) for _ in range(IDLE_PODS)]

    assert went_on == [True] * (IDLE_PODS - 1) + [False]


def test_progress_makes_ignored_pods_unbounded():
    """A run that is interrupted every hour, but makes progress, will end."""
    tries = Tries(limit=0)

    assert all(tries.another(RetryVerdict.IGNORE, step=step) for step in range(1, 50))


def test_the_wait_before_the_next_pod_doubles_and_is_bounded():
    """Without the wait, a pod that fails at once would be started hundreds of times a minute."""
    tries = Tries(limit=100)
    waits = []
    for _ in range(9):
        tries.another(RetryVerdict.COUNT, step=0)
        waits.append(tries.wait_s)

    assert waits == [1, 2, 4, 8, 16, 32, 60, 60, 60]


@given(st.integers(min_value=1, max_value=60))
def test_a_sidecars_back_off_grows_up_to_its_bound(ends):
    """A crash loop must not use the whole processor, but a single crash should cost little time."""
    backoff = BackOff(first_s=0.5, most_s=30.0)

    assert backoff.wait_s(1) == 0.5
    assert backoff.wait_s(ends) <= backoff.wait_s(ends + 1) <= 30.0
