"""The operator deletes the suspended Job of a stopped replica, so that no queue admits the Job later.

An admission would preempt other Jobs for a replica that has already failed.
"""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Discard, Stop, as_data

DEADLINE_S = 60
DISCARD = Discard(job="job-1", replica=1)


@pytest.fixture
def over(make_scene):
    """Return a job whose deadline has passed: replica 0 trains, replica 1 waits in a queue."""
    scene = make_scene(replicas=2, activeDeadlineSeconds=DEADLINE_S)
    scene.settle()
    scene.running_pod(0)
    scene.job(1)["spec"]["suspend"] = True
    scene.settle()
    scene.pass_(DEADLINE_S)
    return scene


def test_it_is_marked_then_reported_then_deleted(over):
    """Each step is stored in the cluster before the next one, so the operator may be killed in between."""
    marked, told, deleted = (over.step().actions for _ in range(3))

    assert [(type(each), each.replica) for each in marked] == [(Stop, 0), (Stop, 1)]
    assert told == ()
    assert over.replica(1).phase is Phase.FAILED
    assert deleted == (DISCARD,)
    assert over.settle().actions == ()


def test_an_operator_that_was_killed_after_the_mark_goes_on(over):
    """The Job's annotation has the reason, so the next operator writes the status and deletes the Job."""
    before = over.raw["status"]
    over.step()
    over.raw["status"] = before  # the status was never written

    told = over.step()

    assert told.actions == ()
    assert as_data(told.status)["replicas"][1]["reason"] == "DeadlineExceeded"
    assert over.step().actions == (DISCARD,)


def test_what_was_deleted_is_never_planned_again(over):
    """The status shows that the replica has ended, so the operator does not create its Job again."""
    over.settle()

    assert [each["metadata"]["name"] for each in over.objects["jobs"]] == ["job-0"]
    assert over.settle(3600).actions == ()
    assert (over.status.phase, over.replica(1).reason) == (Phase.FAILED, "DeadlineExceeded")


def test_a_job_that_runs_is_only_stopped(over):
    """The pods of this Job get time to save a checkpoint before the Job's deadline ends them."""
    over.settle()

    assert over.job(0)["spec"]["activeDeadlineSeconds"] == 1
    assert "palaestra.dev/stopped" in over.job(0)["metadata"]["annotations"]


def test_a_job_that_was_admitted_after_its_mark_is_not_deleted(over):
    """The Job has a deadline of one second and ends by it, like any other stopped Job."""
    over.step()
    over.job(1)["spec"]["suspend"] = False

    assert over.settle().actions == ()


def test_a_job_that_is_suspended_after_its_mark_is_deleted(over):
    """A queue may suspend the Job again before its deadline of one second has passed."""
    over.settle()
    over.job(0)["spec"]["suspend"] = True

    assert over.settle().actions == (Discard(job="job-0", replica=0),)
