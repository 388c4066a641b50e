"""docs/howto/queues.md on the real cluster with a real Kueue, which admits and preempts jobs."""

import os
from dataclasses import dataclass

import pytest

from tests.e2e.cluster import Object
from tests.e2e.jobs import tiny_job
from tests.e2e.kueue import (
    QUEUE,
    VERSION,
    Kueue,
    change_queue,
    leave_room_for_one,
    scheduling,
    wait_for_message,
    wait_for_words,
    words,
    workload,
)
from tests.e2e.namespace import LONG_S, NO_RESTARTS

pytestmark = [pytest.mark.changes_the_cluster, pytest.mark.timeout(900), pytest.mark.usefixtures("robots")]

EVERY_STEPS = 100
AMID = 150
TRAINING = {"steps": 2000, "checkpoint": {"everySteps": EVERY_STEPS}, "evaluation": {"everySteps": 0}}
# This trainer requests as much as a training, but ends at once.
ENDS = {"command": ["bash", "-c", "exit 0"], "evaluation": {"everySteps": 0}}
# This trainer works for so long that the job which it has preempted is seen to wait.
WORKS = {**ENDS, "command": ["bash", "-c", "sleep 5"]}
SHORT = "insufficient unused quota for"
# Jobs that Kueue never admits: requests, queue, and Kueue's message.
NEVER = {
    "nowhere": ({}, "nowhere", "LocalQueue nowhere doesn't exist"),
    "device": (
        {"example.com/device": "1"},
        "trainings",
        "resource example.com/device unavailable in ClusterQueue",
    ),
    "large": ({"memory": "17Gi"}, "trainings", "resources didn't satisfy LimitRange constraints"),
}


@dataclass(frozen=True)
class Story:
    """The observed states of three jobs in a queue whose quota fits one job.

    Attributes:
            waited: the status of `patient`'s replica while `everyday` was admitted.
            short: the message in that status.
            at: the step of `everyday` when `urgent` was created.
            preempted: the status of `everyday`'s replica after the preemption.
            why: Kueue's message about the preemption.
            attempts: the lines of attempts.jsonl after `everyday` was admitted again.
            ends: the last status of each job's replica, by job.
    """

    waited: Object
    short: str
    at: int
    preempted: Object
    why: str
    attempts: list[Object]
    ends: dict[str, Object]


@pytest.fixture(scope="module")
def robots(cluster, tmp_path_factory):
    """The namespace of the page, with Kueue and the queue; the fixture removes everything at the end."""
    kueue = Kueue(cluster, tmp_path_factory.mktemp("queues"))
    if taken := kueue.taken():
        (pytest.skip if os.environ.get("PALAESTRA_CLUSTER") == "existing" else pytest.fail)(taken)
    try:
        yield kueue.install()
    finally:
        kueue.remove()


@pytest.fixture(scope="module")
def story(robots):
    """`everyday` trains, `patient` waits, `urgent` preempts `everyday`, and all of them end."""
    robots.apply(tiny_job("everyday", trainer=TRAINING, backoffLimit=0, scheduling=scheduling()))
    leave_room_for_one(robots, "everyday")
    robots.apply(tiny_job("patient", trainer=ENDS, scheduling=scheduling()))
    short = wait_for_message(robots, "patient", SHORT)
    waited = robots.wait_for_reason("patient", "Queued")
    _, at = robots.wait_for_step("everyday", AMID)

    robots.apply(tiny_job("urgent", trainer=WORKS, scheduling=scheduling("urgent")))
    robots.wait(lambda: "lastAttempt" in robots.replica("everyday"))
    preempted = robots.wait_for_reason("everyday", "Queued")
    why = words(workload(robots, "everyday"), "Preempted")
    back, _ = robots.wait_for_step("everyday", at, LONG_S)
    attempts = robots.in_run(back, "attempts.jsonl")
    names = ("everyday", "patient", "urgent")
    assert {name: robots.wait_for_end(name, LONG_S) for name in names} == dict.fromkeys(names, "Succeeded")
    return Story(waited, short, at, preempted, why, attempts, {name: robots.replica(name) for name in names})


def test_a_job_that_has_no_room_waits_and_its_status_has_the_words_of_kueue(story):
    """The message names the missing resource, so a user needs no permission to read Workloads."""
    assert story.waited["phase"] == "Suspended"
    assert story.short.startswith("waits in queue trainings for Kueue: ")
    assert SHORT in story.short
    assert story.waited["attempt"] == 0


def test_an_urgent_job_takes_the_place_of_one_that_trains(story, robots):
    """The status of the preempted job names the queue, and its Workload contains Kueue's reason."""
    last = story.preempted["lastAttempt"]

    assert story.preempted["phase"] == "Suspended"
    assert story.preempted["reason"] == last["reason"] == "Queued"
    assert "which evicted it" in last["message"]
    assert "Preempted to accommodate a workload" in story.why
    assert any("which evicted it" in each for each in robots.events("everyday", "Queued"))


def test_a_preempted_job_goes_on_from_its_checkpoint_when_there_is_room(story):
    """The trainer saves a checkpoint before it ends, so even with `backoffLimit: 0` no step is lost."""
    resumed_at = int(story.attempts[1]["reason"].removeprefix("resumed at step "))

    assert len(story.attempts) == 2
    assert resumed_at >= story.at - EVERY_STEPS
    assert story.ends["everyday"]["step"] == TRAINING["steps"]


def test_waiting_counts_as_nothing_and_a_preemption_as_a_suspension(story):
    """Kueue causes the wait and the preemption, and neither is a failure of the job."""
    assert story.ends["everyday"]["restarts"] == {**NO_RESTARTS, "suspension": 1}
    assert story.ends["patient"]["restarts"] == story.ends["urgent"]["restarts"] == NO_RESTARTS
    assert {name: end["attempt"] for name, end in story.ends.items()} == {
        "everyday": 2,
        "patient": 1,
        "urgent": 1,
    }


@pytest.mark.parametrize("name", NEVER)
def test_why_a_job_is_never_admitted_is_in_its_status(name, robots):
    """A user finds the message in docs/howto/queues.md, next to the remedy."""
    asked, queue, told = NEVER[name]
    trainer = ENDS | {"resources": {"requests": asked, "limits": asked}}
    robots.apply(tiny_job(name, trainer=trainer, scheduling={"queueName": queue}))

    assert f"waits in queue {queue} for Kueue: " in wait_for_message(robots, name, told)
    assert told in wait_for_words(robots, name, "QuotaReserved", told)
    assert robots.wait_for_reason(name, "Queued")


def test_a_default_queue_is_that_of_jobs_that_name_none(robots):
    """Kueue suspends the Job of a TrainingJob that names no queue.

    If the operator resumed the Job, both controllers would start and stop its pods in turn.
    """
    default = {"apiVersion": VERSION, "kind": "LocalQueue", "spec": {"clusterQueue": QUEUE}}
    robots.create("localqueues", {**default, "metadata": {"name": "default"}})
    change_queue(robots, stopPolicy="Hold")
    robots.apply(tiny_job("anyone", script="exit 0"))
    assert "waits in queue default" in robots.wait_for_reason("anyone", "Queued")["message"]

    change_queue(robots, stopPolicy="None")

    assert robots.wait_for_end("anyone") == "Succeeded"
    assert robots.pods_made("anyone") == 1
