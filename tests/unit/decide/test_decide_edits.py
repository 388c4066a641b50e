"""If somebody edits an object of the operator, the operator emits one event and does not revert the edit."""

import pytest

from palaestra.api.reasons import Reason


def edited(decision):
    """Return the messages of the events about edits."""
    return [each.message for each in decision.events if each.reason is Reason.EDITED]


def test_what_is_as_it_was_made_is_no_edit(training):
    """Defaults of the API server and the operator's own writes are not edits by others."""
    scene, _ = training()
    scene.job()["spec"] |= {"parallelism": 1, "completions": 1}
    scene.objects["policies"][0]["metadata"]["generation"] = 1

    assert edited(scene.step()) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parallelism": 0}, "parallelism 0 instead of 1"),
        ({"backoffLimit": 9}, "backoffLimit 9 instead of 3"),
        ({"activeDeadlineSeconds": 60}, "activeDeadlineSeconds 60 instead of None"),
        ({"ttlSecondsAfterFinished": 5}, "ttlSecondsAfterFinished 5 instead of None"),
    ],
)
def test_an_edit_of_a_job_is_said_and_left_alone(change, words, training):
    """A Job with parallelism 0 creates no pod, and without the event nobody would find the cause."""
    scene, _ = training()
    scene.job()["spec"] |= change

    decision = scene.step()

    assert edited(decision) == [f"Job job-0 was edited by another field manager: {words}"]
    assert decision.actions == ()


def test_an_edit_of_the_network_policy_is_said_and_left_alone(training):
    """The NetworkPolicy protects the pods from other pods, so an administrator must know about its edit."""
    scene, _ = training()
    scene.objects["policies"][0]["metadata"]["generation"] = 2

    decision = scene.step()

    [message] = edited(decision)
    assert "NetworkPolicy job-" in message
    assert "generation 2" in message
    assert decision.actions == ()


def test_an_edit_is_to_be_written_once(training):
    """Each change of any object causes a reconcile, and each reconcile would repeat the event."""
    scene, _ = training()
    scene.job()["spec"]["parallelism"] = 0

    decision = scene.step()

    assert [each.once for each in decision.events if each.reason is Reason.EDITED] == [True]


def test_our_own_stop_is_no_edit(training):
    """To stop a Job, the operator itself sets the Job's deadline."""
    scene, _ = training(activeDeadlineSeconds=60)
    scene.step(60)

    assert scene.job()["spec"]["activeDeadlineSeconds"] == 1
    assert edited(scene.step()) == []
