"""A suspended Job of a stopped replica is deleted, so that no queue can admit it later and preempt others."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Discard, Stop, as_data

DEADLINE_S = 60
DISCARD = Discard(job="job-1", replica=1)


@pytest.fixture
def over(make_scene):
    """A job whose deadline has passed: replica 0 trains, replica 1 waits to be admitted."""
    scene = make_scene(replicas=2, activeDeadlineSeconds=DEADLINE_S)
    scene.settle()
    scene.running_pod(0)
    scene.job(1)["spec"]["suspend"] = True
    scene.settle()
    scene.pass_(DEADLINE_S)
    return scene


def test_it_is_marked_then_reported_then_deleted(over):
    """Each step is stored in the cluster before the next, so the operator may be killed between them."""
    marked, told, deleted = (over.step().actions for _ in range(3))

    assert [(type(each), each.replica) for each in marked] == [(Stop, 0), (Stop, 1)]
    assert told == ()
    assert over.replica(1).phase is Phase.FAILED
    assert deleted == (DISCARD,)
    assert over.settle().actions == ()


def test_an_operator_that_was_killed_after_the_mark_goes_on(over):
    """The mark on the Job has the reason; the status is written before the Job is deleted."""
    before = over.raw["status"]
    over.step()
    over.raw["status"] = before  # the status was never written

    told = over.step()

    assert told.actions == ()
    assert as_data(told.status)["replicas"][1]["reason"] == "DeadlineExceeded"
    assert over.step().actions == (DISCARD,)


def test_what_was_deleted_is_never_planned_again(over):
    """The status records that the replica has ended."""
    over.settle()

    assert [each["metadata"]["name"] for each in over.objects["jobs"]] == ["job-0"]
    assert over.settle(3600).actions == ()
    assert (over.status.phase, over.replica(1).reason) == (Phase.FAILED, "DeadlineExceeded")


def test_a_job_that_runs_is_only_stopped(over):
    """Its pods get time to save, and its deadline applies."""
    over.settle()

    assert over.job(0)["spec"]["activeDeadlineSeconds"] == 1
    assert "palaestra.dev/stopped" in over.job(0)["metadata"]["annotations"]


def test_a_job_that_was_admitted_after_its_mark_is_not_deleted(over):
    """It ends by its deadline, as any other Job does."""
    over.step()
    over.job(1)["spec"]["suspend"] = False

    assert over.settle().actions == ()


def test_a_job_that_is_suspended_after_its_mark_is_deleted(over):
    """A queue may suspend it again in the second that it has left."""
    over.settle()
    over.job(0)["spec"]["suspend"] = True

    assert over.settle().actions == (Discard(job="job-0", replica=0),)
