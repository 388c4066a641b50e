"""The operator maps a trainer's exit code by each rule of the podFailurePolicy, and sets the status."""

import pytest

from tests.e2e.namespace import LONG_S, named

pytestmark = pytest.mark.timeout(1200)

INTERRUPTED_ONCE = (
    "test -e $PALAESTRA_RUN/seen && exit 0; mkdir -p $PALAESTRA_RUN; touch $PALAESTRA_RUN/seen; exit 75"
)
# Each attempt appends a line to a file in the run directory, and prints the lines of all attempts.
FAILS = (
    "mkdir -p $PALAESTRA_RUN; echo $PALAESTRA_POD_UID >>$PALAESTRA_RUN/pods; cat $PALAESTRA_RUN/pods; exit 70"
)
MOST_IGNORED = 10  # the operator accepts no more pods without a step
GIVEN_UP = {
    "refuses": (2, "ConfigurationRefused"),
    "spent": (80, "SimulatorBudgetSpent"),
    "diverged": (81, "Diverged"),
}


@pytest.mark.beside
@pytest.mark.parametrize("name", GIVEN_UP)
def test_a_trainer_that_says_so_is_not_tried_again(name, namespace, job):
    """A second pod would end in the same way.

    The exit codes report a wrong configuration, a spent restart budget and a divergence.
    """
    code, reason = GIVEN_UP[name]

    namespace.apply(job(name, script=f"exit {code}"))

    assert namespace.wait_for_end(name, LONG_S) == "Failed"
    assert namespace.replica(name)["reason"] == reason
    assert f"exit code {code}" in namespace.replica(name)["message"]
    assert namespace.pods_made(name) == 1


@pytest.mark.beside
@pytest.mark.after_the_kills
def test_an_unexpected_end_is_tried_as_often_as_backoff_limit_says(namespace, job):
    """With `backoffLimit: 2`, two failures are retried, so the run has three pods and three attempts."""
    namespace.apply(job("fails", script=FAILS, backoffLimit=2))

    assert namespace.wait_for_end("fails", LONG_S) == "Failed"

    replica = namespace.replica("fails")
    found = namespace.pods("fails", live=False)
    pods = [named(pod) for pod in found]
    attempts = namespace.cluster.kubectl("logs", pods[-1], "-c=trainer", "-n", namespace.name).split()
    assert namespace.pods_made("fails") == len(pods) == 3
    assert attempts == [pod["metadata"]["uid"] for pod in found]
    assert replica["attempt"] == len(attempts)
    assert replica["pod"]["name"] == pods[-1]
    assert replica["reason"] == "BackoffLimitSpent"
    assert replica["restarts"]["trainer"] == 2
    retried = " ".join(namespace.events("fails", "Retrying"))
    assert pods[0] in retried
    assert pods[1] in retried


@pytest.mark.beside
def test_a_stalled_trainer_counts_against_the_limit(namespace, job):
    """With a limit of 0, a stalled run has no retry, because a stall is a failure of the trainer."""
    namespace.apply(job("stalls", script="exit 82", backoffLimit=0))

    assert namespace.wait_for_end("stalls", LONG_S) == "Failed"
    assert namespace.pods_made("stalls") == 1


@pytest.mark.beside
def test_an_interrupted_trainer_is_tried_again_and_not_counted(namespace, job):
    """The trainer exits with 75 after it has saved a checkpoint, so the run can resume.

    An interruption is not a failure: the run resumes on the same volume even if `backoffLimit` is 0.
    """
    namespace.apply(job("interrupted", script=INTERRUPTED_ONCE, backoffLimit=0))

    assert namespace.wait_for_end("interrupted", LONG_S) == "Succeeded"
    assert namespace.pods_made("interrupted") == 2
    assert namespace.replica("interrupted")["restarts"]["trainer"] == 0


@pytest.mark.comes_late
@pytest.mark.timeout(900)
def test_a_trainer_that_is_always_interrupted_is_stopped(always_interrupted):
    """Kubernetes sets no limit for pods whose failure is ignored, so the operator must stop them."""
    space = always_interrupted

    assert space.wait_for_end("always", 800) == "Failed"

    assert space.replica("always")["reason"] == "NoProgress"
    assert 1 < space.pods_made("always") <= MOST_IGNORED
    (job,) = space.wait(lambda: [each for each in space.select("jobs", "always") if has_failed(each)])
    assert job["metadata"]["annotations"]["palaestra.dev/stopped"].startswith("NoProgress: ")
    assert space.pods("always") == []


def has_failed(job):
    """Return whether a batch/v1 Job has finally failed."""
    conditions = job["status"].get("conditions", [])
    return any(each["type"] == "Failed" and each["status"] == "True" for each in conditions)
