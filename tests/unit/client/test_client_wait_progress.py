"""The lines that a client prints for a person who waits for a job."""

import pytest

from palaestra.api import Status
from palaestra.client.wait_progress import News

WAITS = {
    "index": 0,
    "phase": "Pending",
    "reason": "ImagePull",
    "message": "container trainer: image a:1 cannot be pulled (ErrImagePull)",
    "since": "2026-01-31T12:00:05Z",
}
LINE = (
    "lab/job: replica 0: ImagePull since 2026-01-31T12:00:05Z: "
    "container trainer: image a:1 cannot be pulled (ErrImagePull)"
)


@pytest.fixture
def news():
    """Return a function that takes the replicas of the next status and returns the new lines."""
    kept = News("lab/job")

    def of(*replicas, phase="Pending"):
        return list(kept.of(phase, Status.model_validate({"replicas": list(replicas)})))

    return of


def test_a_reason_to_wait_is_reported_with_since_when_and_the_words_of_the_kubelet(news):
    """A job with a typo in its image waited for hours, and the user saw only `Pending`."""
    assert news(WAITS) == ["lab/job: Pending", LINE]


def test_what_did_not_change_is_reported_once(news):
    """The client reads the status every two seconds and must not repeat a line."""
    news(WAITS)

    assert news(WAITS) == []


def test_phrases_that_alternate_are_reported_once_each(news):
    """The kubelet's message alternates between a pull error and a back-off time, which grows."""
    other = WAITS | {"message": "container trainer: image a:1 cannot be pulled (back-off 10s)"}
    longer = WAITS | {"message": "container trainer: image a:1 cannot be pulled (back-off 20s)"}

    lines = [line for each in (WAITS, other, WAITS, longer, WAITS) for line in news(each)]

    assert [line.rpartition("(")[2] for line in lines[1:]] == ["ErrImagePull)", "back-off 10s)"]


def test_a_reason_that_comes_back_is_reported_again(news):
    """The replica trained in between, so this is a new wait with its own start time."""
    news(WAITS)
    news(WAITS | {"phase": "Running", "reason": "Training"}, phase="Running")

    assert news(WAITS | {"since": "2026-01-31T13:00:00Z"}) == [
        "lab/job: Pending",
        LINE.replace("12:00:05", "13:00:00"),
    ]


@pytest.mark.parametrize("reason", ["Queued", "SecretMissing", "Unschedulable", "OfANewerRelease"])
def test_every_hold_and_trouble_is_a_reason_to_wait(news, reason):
    """A user must see every cause of a wait, even a reason that this release does not know."""
    [_, line] = news(WAITS | {"reason": reason})

    assert f": {reason} since" in line


@pytest.mark.parametrize(
    "replica",
    [
        WAITS | {"reason": "Starting"},
        WAITS | {"reason": "Training", "phase": "Running"},
        WAITS | {"phase": "Failed"},
        {"index": 0},
    ],
)
def test_steps_on_the_way_and_ends_are_no_reason_to_wait(news, replica):
    """For these replicas, the line with the phase of the job is enough."""
    assert news(replica) == ["lab/job: Pending"]


def test_each_replica_is_reported(news):
    """Two replicas may wait for different reasons."""
    lines = news(WAITS, WAITS | {"index": 1, "reason": "Unschedulable"})

    assert [line.split(": ")[1:3] for line in lines[1:]] == [
        ["replica 0", "ImagePull since 2026-01-31T12:00:05Z"],
        ["replica 1", "Unschedulable since 2026-01-31T12:00:05Z"],
    ]
