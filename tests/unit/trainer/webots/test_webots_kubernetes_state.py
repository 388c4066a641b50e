"""What a pod's state and events mean for a notebook that waits for its simulator."""

import pytest

from palaestra_trainer.webots.launching.kubernetes_state import address_of, failure_of, told

RUNNING = {"running": {"startedAt": "2026-11-28T12:00:00Z"}}


def pod(state, phase="Pending", **status):
    """Return a pod whose only container has this state."""
    return {
        "status": {"phase": phase, "containerStatuses": [{"name": "simulator", "state": state}], **status}
    }


def test_only_a_running_container_has_an_address():
    """A pod gets its address before its containers run."""
    assert address_of(None) is None
    assert address_of({"status": {"podIP": "10.0.0.1"}}) is None
    assert address_of(pod({"waiting": {"reason": "ContainerCreating"}}, podIP="10.0.0.1")) is None
    assert address_of(pod(RUNNING, podIP="10.0.0.1")) == "10.0.0.1"


@pytest.mark.parametrize(
    ("found", "events", "failure"),
    [
        (None, [], None),
        (None, [{"reason": "FailedCreate", "message": "exceeded quota: q"}], "exceeded quota: q"),
        (None, [{"reason": "SuccessfulCreate", "message": "made"}], None),
        (pod({"waiting": {"reason": "ContainerCreating"}}), [], None),
        (pod({"waiting": {"reason": "ErrImagePull", "message": "later"}}), [], None),
        (
            pod({"waiting": {"reason": "ImagePullBackOff", "message": "no such image"}}),
            [],
            "container simulator: ImagePullBackOff: no such image",
        ),
        (
            pod({"terminated": {"exitCode": 2, "message": "palaestra-sidecar: wrong\n"}}),
            [],
            "palaestra-sidecar: wrong",
        ),
        (pod({"terminated": {"exitCode": 137}}), [], "container simulator ended with code 137"),
        (pod(RUNNING, "Failed", reason="Evicted", message="disk"), [], "Evicted: disk"),
        (pod(RUNNING, "Running"), [], None),
    ],
)
def test_a_failure_is_known_at_once_and_everything_else_may_still_start(found, events, failure):
    """A user must neither wait five minutes for a pod that cannot run, nor lose a pod that is only slow."""
    assert failure_of(found, events) == failure


def test_a_failed_init_container_is_the_failure():
    """The ROS master runs in an init container, so the simulator's container has not started yet."""
    ended = {"name": "ros-master", "state": {"terminated": {"exitCode": 1, "message": "port in use"}}}

    assert failure_of({"status": {"initContainerStatuses": [ended]}}, []) == "port in use"


def test_the_newest_warnings_are_told_once():
    """The same warning may repeat many times. The newest warnings explain the current state."""
    events = [
        {"type": "Warning", "reason": "FailedScheduling", "message": text, "lastTimestamp": time}
        for text, time in (("no room", "2"), ("no node", "1"), ("no room", "3"))
    ]

    assert told([*events, {"type": "Normal", "reason": "Created", "message": "x"}]) == (
        "FailedScheduling: no node; FailedScheduling: no room"
    )
    assert told([]) == "no events"
