"""The status of a replica that waits in a queue of Kueue."""

import pytest

from palaestra.api.reasons import LONGEST_MESSAGE
from palaestra.api.status import Phase

SHORT = "insufficient unused quota for cpu in flavor any-machine, 425m more needed"
WAITS = "waits in queue robots for Kueue"
TAKEN = f"{WAITS}, which evicted it"
AGAIN = "; it continues when it is admitted again"


@pytest.fixture
def queued(make_scene):
    """Return a job that waits in a queue and was never admitted."""
    scene = make_scene(scheduling={"queueName": "robots"})
    scene.kueue = True
    scene.settle()
    return scene


def say(scene, words):
    """Set the message with which Kueue explains in the Workload why it does not admit the Job."""
    scene.unadmitted = {scene.job()["metadata"]["uid"]: words}
    return scene.settle()


def test_the_status_has_the_words_of_kueue(queued):
    """The author of a job may lack the permission to read Workloads."""
    decision = say(queued, SHORT)

    assert (queued.status.phase, queued.replica().reason) == (Phase.SUSPENDED, "Queued")
    assert queued.replica().message == f"{WAITS}: {SHORT}"
    assert {each.message for each in queued.status.conditions if each.type == "Suspended"} == {
        f"{WAITS}: {SHORT}"
    }
    assert decision.events == (), "the event of the reason was emitted before the words were known"


def admit_and_take_back(scene, last_word):
    """Let Kueue admit the job and then preempt its pod."""
    scene.job()["spec"]["suspend"] = False
    pod = scene.running_pod()
    scene.settle()
    scene.job()["spec"]["suspend"] = True
    scene.delete(pod)
    scene.end(pod, 75, last_word())
    scene.settle(5)


def test_long_words_leave_the_rest_of_the_message_whole(queued, last_word):
    """Kueue's message lists every flavor that it tried, so the operator shortens only this part."""
    admit_and_take_back(queued, last_word)

    say(queued, "x" * 600)

    message = queued.replica().message
    assert message.startswith(f"{TAKEN}: xxx")
    assert message.endswith(f"...{AGAIN}")
    assert len(message) <= LONGEST_MESSAGE


@pytest.mark.parametrize("words", [SHORT, "LocalQueue robots doesn't exist"])
def test_an_operator_that_was_restarted_keeps_the_words_until_it_has_asked(words, queued):
    """If a restart removed the messages, the operator would write each waiting job's status twice."""
    say(queued, words)
    before = queued.raw["status"]

    queued.restart()
    queued.unadmitted = {}
    queued.settle()

    assert queued.raw["status"] == before


def test_words_that_no_longer_hold_are_dropped(queued):
    """The operator has read the Workload again, and the Workload has no message now."""
    say(queued, SHORT)

    say(queued, "")

    assert queued.replica().message == WAITS


def test_words_of_the_time_before_a_pod_are_not_kept(queued, last_word):
    """Kueue has admitted the job since that message, so the new wait has another cause."""
    say(queued, SHORT)
    queued.unadmitted = {}

    admit_and_take_back(queued, last_word)

    assert queued.replica().message == TAKEN + AGAIN


def test_the_end_of_an_attempt_has_no_words_about_the_next(queued, last_word):
    """Kueue's message explains the new wait, not the preemption that ended the attempt."""
    admit_and_take_back(queued, last_word)

    say(queued, SHORT)

    assert queued.replica().message == f"{TAKEN}: {SHORT}{AGAIN}"
    assert queued.replica().last_attempt.message == TAKEN + AGAIN


def test_a_workload_that_was_not_read_is_reported_once(queued):
    """The operator reads the Workloads of only a limited number of waiting Jobs.

    The message then names `kubectl describe workload`: only the Workload has the cause.
    """
    say(queued, SHORT)
    queued.unadmitted = {}
    queued.objects["unasked"] = frozenset({queued.job()["metadata"]["uid"]})

    for _ in range(2):
        queued.settle()

    assert queued.replica().message == (
        f"{WAITS}; the cause was not looked up, because too many other replicas wait; "
        "`kubectl describe workload` shows it"
    )
