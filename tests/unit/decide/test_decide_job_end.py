"""The trainer's exit code, its termination message and the Job's conditions determine how a replica ended."""

import pytest

from palaestra.api.status import Phase
from palaestra_protocol.pod.status import EvaluationStatus, SuccessInterval


@pytest.mark.parametrize(
    ("code", "reason", "begin"),
    [
        (2, "ConfigurationRefused", "the trainer refuses its configuration (exit code 2): Why: because"),
        (80, "SimulatorBudgetSpent", "the simulators failed too often (exit code 80): Why: because"),
        (81, "Diverged", "the learner diverged (exit code 81): Why: because"),
    ],
)
def test_an_exit_code_that_forbids_another_try_is_the_reason(training, last_word, code, reason, begin):
    """Kubernetes does not retry after these exit codes.

    The user reads the cause in the trainer's own words.
    """
    scene, pod = training()
    scene.end(pod, code, last_word(step=40, reason="Why: because"))
    scene.end_job("Failed", 0, "PodFailurePolicy", "Container trainer ... matching FailJob rule")

    scene.settle()

    assert (scene.status.phase, scene.replica().reason) == (Phase.FAILED, reason)
    assert scene.replica().message == begin
    assert scene.replica().step == 40
    assert scene.replica().restarts.trainer == 0


def test_the_exit_code_is_read_from_the_jobs_words_when_the_pod_is_gone(training):
    """A user may have deleted the pod, but the message of the Job's condition has the exit code."""
    scene, _ = training()
    scene.objects["pods"].clear()
    words = (
        "Container trainer for pod default/job-0-x failed with exit code 81 matching FailJob rule at index 2"
    )
    scene.end_job("Failed", 0, "PodFailurePolicy", words)

    scene.settle()

    assert scene.replica().reason == "Diverged"


def test_a_spent_backoff_limit_tells_of_the_last_failure(accepted, last_word):
    """A limit of n allows n + 1 pods, which are the attempts 1 to n + 1."""
    scene = accepted(backoffLimit=2)
    attempts = []
    for number in (1, 2, 3):
        pod = scene.running_pod()
        scene.settle(15)
        attempts.append(scene.replica().attempt)
        scene.end(pod, 70, last_word(reason=f"Unexpected: error {number}"))
        scene.count_failures(number)
        scene.settle(15)
    scene.end_job("Failed", 0, "BackoffLimitExceeded", "Job has reached the specified backoff limit")
    scene.settle()

    assert attempts == [1, 2, 3]
    assert scene.replica().reason == "BackoffLimitSpent"
    assert scene.replica().message == (
        "3 pods failed, more than backoffLimit allows; the last: exit code 70, Unexpected: error 3"
    )
    assert scene.replica().restarts.trainer == 2


def test_a_trainer_that_was_killed_for_its_memory_is_reported_with_its_limit(training):
    """Exit code 137 alone does not explain the end, so the message must name the memory limit."""
    scene, pod = training(trainer={"resources": {"limits": {"memory": "2Gi"}}})
    scene.end(pod, 137, reason="OOMKilled")
    scene.end_job("Failed", 0, "BackoffLimitExceeded")

    scene.settle()

    assert scene.replica().reason == "TrainerOutOfMemory"
    assert "was killed (limit 2Gi, 1 so far); raise spec.trainer" in scene.replica().message


def test_a_simulator_that_hung_each_time_is_distinguished_from_a_stalled_run(training, last_word):
    """Both kinds of end have exit code 82, and only the trainer's termination message has the cause."""
    scene, pod = training()
    scene.end(pod, 82, last_word(reason="SimulatorHung: collect-0: no answer within 600 s"))
    scene.end_job("Failed", 0, "BackoffLimitExceeded")

    scene.settle()

    assert scene.replica().reason == "SimulatorHung"
    assert scene.replica().message.startswith("SimulatorHung: collect-0: no answer within 600 s; ")


def test_a_full_volume_is_reported_with_its_remedy(training, last_word):
    """A person can free space or request a larger volume, so the message must name this remedy."""
    scene, pod = training(backoffLimit=0)
    scene.end(pod, 1, last_word(reason="StorageFull: checkpoints/5: disk full"))
    scene.end_job("Failed", 0, "BackoffLimitExceeded")

    scene.settle()

    assert scene.replica().reason == "StorageFull"
    assert scene.replica().message == (
        "the volume of the run is full: checkpoints/5: disk full; "
        "free some space, or request more with spec.storage.size"
    )


@pytest.mark.parametrize("word", [True, False])
def test_a_trainer_that_stalled_each_time_is_reported(training, last_word, word):
    """The trainer's watchdog ends a stalled trainer with exit code 82, with or without a message."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.end(pod, 82, last_word(reason="Stalled: collect-0 hangs") if word else "")
    scene.end_job("Failed", 0, "BackoffLimitExceeded")

    scene.settle()

    what = "Stalled: collect-0 hangs" if word else "no environment step for 60 s"
    assert scene.replica().message == f"{what}; read the stacks in the trainer's log"


def test_the_message_about_an_eviction_for_storage_quotes_the_kubelet(training):
    """The status of the pod has the kubelet's message, which names the full volume."""
    scene, pod = training()
    words = "Usage of EmptyDir volume exceeds the limit; ephemeral-storage"
    pod["status"] |= {"phase": "Failed", "reason": "Evicted", "message": words}
    scene.end_job("Failed", 0, "BackoffLimitExceeded")

    scene.settle()

    assert scene.replica().reason == "EphemeralStorage"
    assert words in scene.replica().message


def test_another_failure_of_the_job_is_quoted(training):
    """A person may have set a deadline on the Job, and the user must see this cause."""
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.end_job("Failed", 0, "DeadlineExceeded", "Job was active longer than specified deadline")

    scene.settle()

    assert scene.replica().message == (
        "the Job failed: DeadlineExceeded: Job was active longer than specified deadline"
    )


def test_a_job_fails_when_that_is_certain(training, last_word):
    """The condition FailureTarget comes before Failed.

    On a lost node, Failed would never come, because the Job waits for its pods.
    """
    scene, pod = training()
    scene.end(pod, 2, last_word())
    scene.end_job("FailureTarget", 0, "PodFailurePolicy")

    scene.settle()

    assert scene.status.phase is Phase.FAILED


def test_why_it_was_stopped_comes_before_what_followed(training, last_word):
    """To stop a Job, the operator gives it a deadline of one second, which interrupts the pod.

    The Job's deadline and the interruption are consequences and must not become the reason.
    """
    scene, pod = training(activeDeadlineSeconds=60)
    scene.step(60)
    scene.end(pod, 75, last_word(reason="Interrupted: SIGTERM received"))
    scene.end_job("Failed", 0, "DeadlineExceeded")

    scene.settle()

    assert scene.replica().reason == "DeadlineExceeded"
    assert scene.replica().message.startswith("the job was active for 60 s")


def test_a_mark_that_nobody_knows_stops_all_the_same(training):
    """A person or a newer release may have written this annotation."""
    scene, _ = training()
    scene.job()["metadata"]["annotations"] = {"palaestra.dev/stopped": "Weather: rain"}

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.FAILED, "JobFailed")
    assert scene.replica().message == "rain"


def test_success_is_reported_with_its_interval(training, last_word):
    """When a training has ended, most people read only this message."""
    scene, pod = training()
    interval = SuccessInterval(low=0.9, high=0.98, episodes=100)
    scene.end(pod, 0, last_word(step=100, success_rate=0.95, success_interval=interval))
    scene.end_job("Complete")

    scene.settle(1)

    assert scene.replica().message == (
        "the training is complete: 100 steps, success rate 0.95 (0.90 to 0.98, 100 episodes)"
    )
    assert scene.replica().success_interval.episodes == 100


def test_what_the_trainer_said_last_stays_in_the_status(training, last_word, simulator):
    """The trainer's termination message has the final values. A training that has ended has no speed."""
    scene, pod = training()
    scene.poll(pod, step=50, target=100, mean_return=1.5, steps_per_second=20.0, simulators=(simulator(),))
    scene.settle(1)
    evaluation = EvaluationStatus(step=100, success_rate=0.8, mean_return=3.5)
    scene.end(pod, 0, last_word(step=100, success_rate=0.9, last_evaluation=evaluation))
    scene.end_job("Complete")

    scene.settle(1)

    replica = scene.replica()
    assert (replica.step, replica.target, replica.success_rate) == (100, 100, 0.9)
    assert (replica.last_evaluation.step, replica.last_evaluation.mean_return) == (100, 3.5)
    assert (replica.mean_return, replica.steps_per_second) == (1.5, None)


def complete(training, *, word="", **spec):
    """Return the status of a job whose trainer has ended with exit code 0."""
    scene, pod = training(**spec)
    scene.end(pod, 0, word)
    scene.end_job("Complete")
    scene.settle()
    return scene.status


def test_an_exit_code_0_without_a_report_is_no_complete_training(training, last_word):
    """A library that calls `exit(0)` leaves no model. A user's own program need not report its end."""
    silent = complete(training)
    reported = complete(training, word=last_word(reason="Completed: the training is complete"))
    own = complete(training, trainer={"command": ["python", "train.py"]})

    assert [each.phase for each in (silent, reported, own)] == [
        Phase.FAILED,
        Phase.SUCCEEDED,
        Phase.SUCCEEDED,
    ]
    assert silent.replicas[0].reason == "TrainerFailed"
    assert "exit code 0, and did not report that it was complete" in silent.replicas[0].message
