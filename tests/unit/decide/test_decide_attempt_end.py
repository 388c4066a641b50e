"""The status keeps the reason, the last lines and the faults of the last attempt after its pod is deleted."""

import pytest

from palaestra.api.status import Phase
from palaestra_protocol.pod.status import FaultRecord


def last(scene):
    """Return the number, the exit code and the reason of the last attempt."""
    kept = scene.replica().last_attempt
    return (kept.attempt, kept.exit_code, kept.reason)


def disrupted(decision):
    """Return the messages of the events about disruptions."""
    return [each.message for each in decision.events if each.reason == "Disrupted"]


def test_the_first_attempt_has_none_before_it(training):
    """During the first attempt no attempt has ended, so the field is absent."""
    scene, _ = training()

    assert scene.replica().last_attempt is None


def test_the_last_lines_and_the_faults_outlive_the_pod(training, last_word):
    """Kubernetes deletes the logs of a pod together with the pod."""
    scene, pod = training()
    fault = FaultRecord(
        time="2026-01-31T11:59:00Z", simulator="collect-0", kind="hung", fact="no answer in 5 s", step=7
    )
    word = last_word(
        reason="SimulatorBudgetSpent: collect-0: 11 restarts",
        log=("first line", "last line"),
        faults=(fault,),
        restarts=10,
    )
    scene.end(pod, 80, word)
    scene.end_job("Failed", 0, "PodFailurePolicy")
    scene.settle()
    scene.objects["pods"].clear()

    scene.settle(600)

    kept = scene.replica().last_attempt
    assert last(scene) == (1, 80, "SimulatorBudgetSpent")
    assert kept.message == (
        "the simulators failed too often (exit code 80): SimulatorBudgetSpent: collect-0: 11 restarts"
    )
    assert (kept.log, kept.restarts) == (("first line", "last line"), 10)
    [told] = kept.faults
    assert (told.simulator, told.kind, told.fact, told.step) == ("collect-0", "hung", "no answer in 5 s", 7)


def test_a_trainer_that_could_write_no_last_word_leaves_the_end_of_its_log(training):
    """Kubernetes copies the end of the log into the termination message.

    The status keeps its last ten lines and shortens each of them.
    """
    scene, pod = training()
    lines = [f"line {i}" for i in range(30)] + ["", "x" * 500]
    scene.end(pod, 137, "\n".join(lines))

    scene.settle()

    kept = scene.replica().last_attempt
    assert kept.log[:2] == ("line 21", "line 22")
    assert (len(kept.log), len(kept.log[-1])) == (10, 200)
    assert last(scene) == (1, 137, "TrainerFailed")


def test_restarts_that_only_a_poll_reported_are_kept_at_once(accepted, simulator):
    """The restarts count even if the trainer had ended when the operator first saw its pod.

    A second reconcile does not count them again.
    """
    scene = accepted(backoffLimit=5)
    pod = scene.running_pod()
    scene.end(pod, 1)
    pod["status"]["phase"] = "Running"  # its sidecars still run
    scene.poll(pod, simulators=(simulator(restarts=3),))

    scene.step()
    first = scene.replica().last_attempt
    scene.step()

    assert first.restarts == 3
    assert scene.replica().last_attempt == first


def test_the_log_of_a_container_before_the_trainer_is_kept(accepted, command_groups):
    """The trainer never started and has no log, so the init container's log has the cause."""
    scene = accepted(simulators=command_groups)
    pod = scene.new_pod()
    scene.container(pod, "install-sidecar", code=1, message="cp: one\ncp: no space left on device\n")
    pod["status"]["phase"] = "Failed"

    scene.settle()

    assert scene.replica().last_attempt.log == ("cp: one", "cp: no space left on device")


@pytest.mark.parametrize(
    ("code", "word", "reason"),
    [
        (0, "Completed: it", "Succeeded"),
        (2, "ConfigurationWrong: it", "ConfigurationRefused"),
        (70, "Unexpected: it", "TrainerFailed"),
        (75, "MasterLost: it", "Interrupted"),
        (80, "SimulatorBudgetSpent: it", "SimulatorBudgetSpent"),
        (81, "Diverged: loss is NaN at step 5", "Diverged"),
        (82, "SimulatorHung: it", "SimulatorHung"),
        (82, "Stalled: it", "Stalled"),
        (1, "StorageFull: it", "StorageFull"),
    ],
)
def test_how_an_attempt_ended_is_one_of_the_reasons(training, last_word, code, word, reason):
    """Users and programs know only the documented reasons.

    The exit code and the trainer's termination message determine which reason it is.
    """
    scene, pod = training()
    scene.end(pod, code, last_word(reason=word))

    scene.settle()

    assert last(scene) == (1, code, reason)


def test_a_trainer_that_was_killed_for_its_memory_did_not_just_end_with_137(training):
    """Other kills have exit code 137 too, but only this one needs more memory."""
    scene, pod = training()
    scene.end(pod, 137, reason="OOMKilled")

    scene.settle()

    assert last(scene) == (1, 137, "TrainerOutOfMemory")


def evict(scene, pod):
    """Let a drain evict the pod; its trainer saves a checkpoint and stops."""
    scene.take(pod, "Eviction API: evicting")


def preempt(scene, pod):
    """Let the scheduler preempt the pod; its trainer does not save in time."""
    scene.take(pod, "preempted")
    scene.end(pod, 137)


def lose_with_its_node(scene, pod):  # noqa: ARG001 - the test calls all of them with the same arguments
    """Delete the Node object of a node that is off: the garbage collector then deletes the pod unchanged."""
    pod["status"]["phase"] = "Failed"
    pod["status"]["conditions"] = [
        {"type": "DisruptionTarget", "status": "True", "reason": "DeletionByPodGC", "message": "node is gone"}
    ]


def remove(scene, pod):
    """Remove the pod before an operator sees its end."""
    scene.objects["pods"].remove(pod)


def delete(scene, pod):
    """Delete the pod, as a person does."""
    pod["metadata"]["deletionTimestamp"] = scene.stamp(60)
    scene.end(pod, 75)


@pytest.mark.parametrize("take", [evict, preempt, lose_with_its_node, remove, delete])
@pytest.mark.parametrize("looks", [True, False], ids=["seen", "seen late"])
def test_a_disruption_is_counted_and_reported_once_and_is_no_failure(training, take, looks):
    """Each disruption counts once, whatever its cause, even if the operator sees only the next pod."""
    scene, pod = training(backoffLimit=0)
    take(scene, pod)
    told = disrupted(scene.settle(5)) if looks else []
    scene.pass_(5)
    scene.running_pod()

    told += disrupted(scene.settle(5))

    replica = scene.replica()
    assert (replica.phase, replica.reason, replica.attempt) == (Phase.RUNNING, "Training", 2)
    assert (replica.restarts.disruption, replica.restarts.trainer) == (1, 0)
    assert last(scene)[0::2] == (1, "Disrupted")
    assert len(told) == 1
    assert told[0].startswith(f"pod {pod['metadata']['name']} was disrupted (")


def test_a_pod_that_was_deleted_and_did_not_save_in_time_is_a_failure(training):
    """The Job counts a failure, because the pod has no condition DisruptionTarget: a person deleted it."""
    scene, pod = training()
    pod["metadata"]["deletionTimestamp"] = scene.stamp(60)
    scene.end(pod, 137)
    scene.count_failures(1)
    scene.settle(5)
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert last(scene) == (1, 137, "TrainerFailed")
    assert "the pod was deleted, and the trainer did not save in time" in scene.replica().last_attempt.message
    assert (scene.replica().restarts.trainer, scene.replica().restarts.disruption) == (1, 0)


def test_two_disruptions_in_a_row_are_two_events(training):
    """The replica did not train between the two disruptions, but each of them must emit an event."""
    scene, pod = training()
    evict(scene, pod)
    told = disrupted(scene.settle(5))
    evict(scene, scene.running_pod())

    told += disrupted(scene.settle(5))

    assert len(set(told)) == 2
    assert (last(scene)[0], scene.replica().restarts.disruption) == (2, 1)


def test_of_attempts_that_nobody_saw_the_last_is_kept(training, last_word):
    """Two attempts ended while no operator ran, and a user needs the reason of the later one."""
    scene, pod = training()
    scene.end(pod, 70, last_word(reason="Unexpected: first"))
    scene.pass_(15)
    scene.end(scene.running_pod(), 70, last_word(reason="Unexpected: second"))
    scene.pass_(15)
    scene.running_pod()

    scene.settle()

    assert last(scene) == (2, 70, "TrainerFailed")
    assert scene.replica().last_attempt.message == "Unexpected: second"


def test_an_older_pod_that_is_still_there_is_not_taken_for_the_last(training, last_word):
    """The last pod was deleted, but a failed pod of an earlier attempt still exists."""
    scene, pod = training()
    scene.end(pod, 70, last_word())
    scene.count_failures(1)
    scene.settle(5)
    scene.pass_(5)
    second = scene.running_pod()
    scene.settle(5)
    scene.objects["pods"].remove(second)
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert last(scene) == (2, None, "Disrupted")


def test_a_failed_pod_that_was_tidied_away_is_not_called_disrupted(training):
    """Somebody deleted the failed pod, but the Job has counted its failure.

    So the status must report a failure.
    """
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.count_failures(1)
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert last(scene) == (1, None, "TrainerFailed")


def test_a_suspended_attempt_ended_by_suspension(training):
    """Kubernetes deleted the pod because a user suspended the job, so no disruption is reported."""
    scene, pod = training()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    delete(scene, pod)

    decision = scene.settle(5)

    assert last(scene) == (1, 75, "Suspended")
    assert disrupted(decision) == []


def test_an_attempt_that_kueue_took_back_says_so(make_scene):
    """Kueue suspended the Job to admit another one. The user must see this cause, and not a disruption."""
    scene = make_scene(scheduling={"queueName": "robots"})
    scene.kueue = True
    scene.settle()
    scene.job()["spec"]["suspend"] = False
    pod = scene.running_pod()
    scene.settle()

    scene.job()["spec"]["suspend"] = True
    delete(scene, pod)
    decision = scene.settle(5)

    taken = "waits in queue robots for Kueue, which evicted it; it continues when it is admitted again"
    assert last(scene) == (1, 75, "Queued")
    assert scene.replica().last_attempt.message == scene.replica().message == taken
    assert [each.message for each in decision.events if each.reason == "Queued"] == [taken]
    assert disrupted(decision) == []


def test_the_last_lines_of_an_attempt_that_we_stopped_come_after_the_end(training, last_word):
    """A replica fails as soon as the operator stops its Job.

    The last lines arrive when its trainer ends, and the status still gets them.
    """
    scene, pod = training(activeDeadlineSeconds=60)
    scene.step(60)
    scene.settle()
    assert scene.status.phase is Phase.FAILED
    pod["metadata"]["deletionTimestamp"] = scene.stamp(60)
    scene.end(pod, 75, last_word(reason="Interrupted: SIGTERM received", log=("checkpoint written",)))

    decision = scene.settle(5)

    assert last(scene) == (1, 75, "DeadlineExceeded")
    assert scene.replica().last_attempt.log == ("checkpoint written",)
    assert (decision.events, decision.actions) == ((), ())
    before = scene.raw["status"]
    scene.objects["pods"].clear()
    scene.settle(600)
    assert scene.raw["status"] == before


def test_a_replica_whose_last_pod_is_gone_ended_for_the_reason_of_its_job(training):
    """If somebody has deleted the pod, only the Job's condition still has the exit code."""
    scene, _ = training()
    scene.objects["pods"].clear()
    words = "Container trainer for pod default/x failed with exit code 81 matching FailJob rule at index 2"
    scene.end_job("Failed", 0, "PodFailurePolicy", words)

    scene.settle()

    assert (last(scene)[0], last(scene)[2]) == (1, "Diverged")


def test_the_end_of_an_attempt_is_kept_where_its_pod_goes_after_the_job_has_failed(training):
    """The operator may see the changes of Jobs and pods in any order, and the result must be the same."""
    scene, _ = training(activeDeadlineSeconds=60)
    scene.step(60)
    scene.settle()
    assert scene.status.phase is Phase.FAILED
    scene.objects["pods"].clear()

    scene.settle(5)

    assert last(scene) == (1, None, "DeadlineExceeded")
    assert scene.replica().last_attempt.message == scene.replica().message
