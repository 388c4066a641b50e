"""The operator accepts an object as a TrainingJob or refuses it with a reason.

An invalid object never keeps the operator from reconciling others.
"""

from datetime import UTC, datetime

import pytest

from palaestra.decide import JobRefused, accept, as_data, managed_here, reject

NOW = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)
HEAD = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob"}
SAC = {"trainer": {"algorithm": {"name": "SAC"}}}


def raw(spec=None, status=None, **metadata):
    """Return a TrainingJob as an API server holds it."""
    named = {"name": "job", "namespace": "default", "uid": "u-1", "generation": 3, **metadata}
    return {**HEAD, "metadata": named, "spec": spec or {}} | ({"status": status} if status else {})


def refused(obj):
    """Return the error with which an object is refused."""
    with pytest.raises(JobRefused) as info:
        accept(obj)
    return info.value


def test_a_right_job_is_read_with_its_generation_and_its_status():
    """Each operator process continues from the status that an earlier one wrote."""
    job = accept(raw(status={"phase": "Running"}))

    assert (job.metadata.generation, job.status.phase) == (3, "Running")


def test_a_mistake_that_only_the_models_find_is_reported_with_its_field():
    """The API server cannot check the content of free objects, so the operator does."""
    problem = refused(raw(SAC))

    assert problem.reason == "InvalidSpec"
    assert problem.message == (
        "spec.trainer.algorithm.name: SAC needs continuous actions; "
        "set environment.options.actions: continuous"
    )


def test_such_a_job_has_failed_for_good():
    """Nobody can change the spec, so the job can never become valid."""
    decision = reject(raw(SAC), refused(raw(SAC)), NOW)

    held = {each.type.value: each.status.value for each in decision.status.conditions}
    assert (decision.status.phase, held["Accepted"], held["Failed"]) == ("Failed", "False", "True")
    assert decision.status.completion_time == NOW
    assert {each.reason for each in decision.events} == {"InvalidSpec"}


def test_refusing_again_changes_nothing():
    """The status already has the first refusal, so a second reconcile must not write it again."""
    first = as_data(reject(raw(SAC), refused(raw(SAC)), NOW).status)
    again = raw(SAC, first)

    decision = reject(again, refused(again), NOW.replace(hour=13))

    assert (as_data(decision.status), decision.events) == (first, ())


def test_a_job_that_was_refused_once_is_never_started():
    """Even a release that would accept this spec must not start a job that has failed."""
    failed = as_data(reject(raw(SAC), refused(raw(SAC)), NOW).status)

    assert accept(raw(status=failed)).status.phase == "Failed"


def test_it_is_deleted_after_its_time_to_live():
    """A refused job has ended, so `ttlSecondsAfterFinished` applies as to any ended job."""
    spec = {**SAC, "ttlSecondsAfterFinished": 60}
    status = as_data(reject(raw(spec), refused(raw(spec)), NOW).status)
    obj = raw(spec, status)

    early = reject(obj, refused(obj), NOW.replace(second=20))
    late = reject(obj, refused(obj), NOW.replace(minute=1))

    assert (early.actions, early.wake_after_s) == ((), 40)
    assert [(each.name, each.uid) for each in late.actions] == [("job", "u-1")]


def test_a_job_that_an_older_release_accepted_goes_on_as_it_is():
    """An upgrade of the operator must not touch the pods of running jobs."""
    release = {"trainer": "t:1", "stub": "s:1", "mujoco": "m:1", "webots": "w:1"}
    obj = raw(SAC, {"phase": "Running", "release": release})

    decision = reject(obj, refused(obj), NOW)

    assert (decision.status, decision.actions) == (None, ())
    assert [each.reason for each in decision.events] == ["InvalidSpec"]


@pytest.mark.parametrize("status", [{"phase": "Dancing"}, {"activeSeconds": "4"}, "text"])
def test_a_status_that_cannot_be_read_is_left_alone(status):
    """The operator cannot know which replicas have ended, so it changes nothing."""
    obj = raw(status=status)

    decision = reject(obj, refused(obj), NOW)

    assert refused(obj).reason == "StatusUnreadable"
    assert (decision.status, decision.actions) == (None, ())


@pytest.mark.parametrize(
    ("spec", "metadata", "ours"),
    [
        ({}, {}, True),
        ({"managedBy": "palaestra.dev/operator"}, {}, True),
        ({"managedBy": "kueue.x-k8s.io/multikueue"}, {}, False),
        ({}, {"deletionTimestamp": "2026-01-31T12:00:00Z"}, False),
    ],
)
def test_jobs_of_other_controllers_and_of_nobody_are_left_alone(spec, metadata, ours):
    """The author may have left the job to another controller.

    A job that is being deleted must not get new objects.
    """
    assert managed_here(raw(spec, **metadata)) is ours
