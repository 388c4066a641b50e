"""A trainer that starts slowly, and a trainer that the kubelet ends after a failed probe."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Replace
from palaestra_protocol.pod.status import CheckpointStatus

LIVENESS = "Container trainer failed liveness probe, will be restarted"
STARTUP = "Container trainer failed startup probe, will be restarted"
SIGNALLED = "SIGTERM: ending; nothing was started"


@pytest.fixture
def start_slowly(accepted):
    """`start_slowly()` returns a job whose trainer has not passed its startup probe, and the pod."""

    def make(**spec):
        scene = accepted(**spec)
        pod = scene.running_pod()
        pod["status"]["containerStatuses"][0]["started"] = False
        scene.settle()
        return scene, pod

    return make


def end_by_probe(scene, pod, words=LIVENESS, code=75):
    """Let the kubelet end the trainer of a pod, and emit an event with the reason."""
    scene.end(pod, code, SIGNALLED)
    event = {"involvedObject": {"uid": pod["metadata"]["uid"]}, "reason": "Killing", "message": words}
    scene.objects["events"].append({**event, "lastTimestamp": scene.stamp()})


def running(scene):
    """Return the status of the condition that `kubectl wait` reads."""
    return next(each.status.value for each in scene.status.conditions if each.type == "Running")


def test_a_trainer_that_has_not_answered_yet_starts(start_slowly):
    """On a busy node, importing PyTorch takes minutes, in which the trainer does not train."""
    scene, _ = start_slowly()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.PENDING, "Starting")
    assert scene.replica().message == "its trainer starts, and has not responded yet"
    assert running(scene) == "False"


@pytest.mark.parametrize("answer", ["to the kubelet", "to the operator"])
def test_a_trainer_runs_once_it_has_answered(start_slowly, answer):
    """A response to the kubelet's probe or to the operator's poll proves that the trainer runs."""
    scene, pod = start_slowly()
    if answer == "to the kubelet":
        pod["status"]["containerStatuses"][0]["started"] = True
    else:
        scene.poll(pod)
    scene.settle()

    assert (scene.replica().reason, running(scene)) == ("Training", "True")


def test_the_start_timeout_counts_while_a_trainer_has_not_answered(start_slowly):
    """A trainer that hangs in an import never does a first step."""
    scene, _ = start_slowly(startTimeoutSeconds=600)

    scene.settle(601)

    assert (scene.replica().phase, scene.replica().reason) == (Phase.FAILED, "StartTimeout")
    assert "its trainer starts, and has not responded yet" in scene.replica().message


@pytest.mark.parametrize(("words", "probe"), [(LIVENESS, "liveness"), (STARTUP, "startup")])
def test_a_trainer_that_its_probe_ended_says_so_with_the_remedy(training, words, probe):
    """The pod does not show who sent the signal. Only the kubelet's event shows it."""
    scene, pod = training()
    end_by_probe(scene, pod, words)

    scene.settle()

    for told in (scene.replica(), scene.replica().last_attempt):
        assert told.reason == "ProbeFailed"
        assert f"because its {probe} probe failed (exit code 75)" in told.message
        assert "spec.trainer.resources" in told.message


def test_a_trainer_that_its_probe_ended_counts_once_and_evicts_nothing(training):
    """The Job counts no failure for exit code 75.

    Without the operator's count, the Job would retry for ever.
    """
    scene, pod = training()
    end_by_probe(scene, pod)

    decision = scene.settle()
    scene.settle(60)
    scene.objects["events"].clear()  # the operator does not request the events of an older pod
    scene.running_pod()
    scene.settle()

    assert [action.times for action in decision.actions if isinstance(action, Replace)] == [1]
    assert "deletionTimestamp" not in pod["metadata"]
    counts = scene.replica().restarts
    assert (counts.operator, counts.trainer, counts.disruption) == (1, 0, 0)
    assert scene.replica().last_attempt.reason == "ProbeFailed"


def test_probes_end_a_replica_after_backoff_limit_retries(training):
    """The limit n counts retries, so n + 1 pods run, as for a trainer that fails by itself."""
    scene, pod = training(backoffLimit=2)
    for _ in range(2):
        end_by_probe(scene, pod)
        scene.settle()
        assert scene.replica().phase is Phase.PENDING
        scene.pass_(30)
        pod = scene.running_pod()
        scene.settle()
    end_by_probe(scene, pod)

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.FAILED, "ProbeFailed")


def test_a_trainer_that_its_probe_killed_keeps_its_reason_when_the_next_pod_is_there(training):
    """The Job counts exit code 137 itself.

    The operator does not read the event of the older pod again, so the status must keep the reason.
    """
    scene, pod = training()
    end_by_probe(scene, pod, code=137)
    decision = scene.settle()

    scene.objects["events"].clear()
    scene.pass_(30)
    scene.count_failures(1)
    scene.running_pod()
    scene.settle()

    assert not [action for action in decision.actions if isinstance(action, Replace)]
    assert scene.replica().last_attempt.reason == "ProbeFailed"
    assert (scene.replica().restarts.trainer, scene.replica().restarts.operator) == (1, 0)


def test_a_deleted_pod_was_not_ended_by_its_probe(training):
    """For a deleted pod the kubelet also emits `Killing`, but without a failed probe in its message."""
    scene, pod = training()
    scene.delete(pod)
    end_by_probe(scene, pod, "Stopping container trainer")

    scene.settle()

    assert scene.replica().last_attempt.reason == "Disrupted"
    assert scene.replica().restarts.operator == 0


@pytest.mark.parametrize("saved", [False, True])
def test_the_next_pod_resumes_only_where_there_is_a_checkpoint(training, saved):
    """An attempt that ended before its first checkpoint has saved nothing."""
    scene, pod = training()
    checkpoint = CheckpointStatus(step=5, time="2026-01-31T12:00:00Z") if saved else None
    scene.poll(pod, step=5, last_checkpoint=checkpoint)
    scene.settle()
    scene.take(pod)

    scene.settle()

    told = scene.replica().message
    assert told.endswith(
        "; the next pod resumes from the last checkpoint"
        if saved
        else "; the next pod starts the run again, because no checkpoint was reported"
    )
