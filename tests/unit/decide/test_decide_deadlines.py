"""One patch with the reason stops a replica whose deadline has passed, or replaces its pod."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Replace, Stop


def stops(decision):
    """Return the reasons of the replicas that a decision stops."""
    return [each.reason.value for each in decision.actions if isinstance(each, Stop)]


def replaced(decision):
    """Return the reasons of the replicas whose pods a decision replaces."""
    return [each.reason.value for each in decision.actions if isinstance(each, Replace)]


def test_a_stop_is_one_patch_that_outlives_its_writer(training):
    """An operator that is killed between two patches would stop the Job and lose the reason."""
    scene, _ = training(activeDeadlineSeconds=60)

    (stop,) = scene.step(60).actions

    assert stop.patch == {
        "metadata": {"annotations": {"palaestra.dev/stopped": f"DeadlineExceeded: {stop.message}"}},
        "spec": {"activeDeadlineSeconds": 1},
    }


def test_a_replica_has_failed_once_its_job_carries_the_mark(training):
    """The patch may fail, so the status reports the failure only after the Job has the annotation."""
    scene, _ = training(activeDeadlineSeconds=60)
    scene.step(60)
    assert scene.status.phase is Phase.RUNNING

    decision = scene.settle()

    assert (scene.status.phase, scene.replica().reason) == (Phase.FAILED, "DeadlineExceeded")
    assert decision.actions == ()


def test_suspended_time_does_not_count_for_the_active_deadline(training):
    """The job was suspended for ten of eleven minutes, in which it could not train."""
    scene, _ = training(activeDeadlineSeconds=120)
    scene.raw["spec"]["suspend"] = True
    scene.settle(60)
    scene.objects["pods"].clear()
    scene.settle()
    scene.settle(600)
    scene.raw["spec"]["suspend"] = False
    scene.settle()
    scene.running_pod()

    assert stops(scene.step(59)) == []
    assert stops(scene.step(1)) == ["DeadlineExceeded"]


def test_time_in_which_a_hold_keeps_a_job_from_being_planned_does_not_count(make_scene):
    """A job cannot train without its Secret, so the deadline starts when somebody has created the Secret."""
    secret = {"env": [{"name": "TOKEN", "secretKeyRef": {"name": "keys", "key": "token"}}]}
    scene = make_scene(activeDeadlineSeconds=60, trainer=secret)
    scene.settle()
    scene.settle(3600)
    assert (scene.status.phase, scene.replica().reason) == (Phase.PENDING, "SecretMissing")

    labels = {"palaestra.dev/for-jobs": "true"}
    scene.there[("Secret", "keys")] = {"metadata": {"name": "keys", "labels": labels}}
    scene.settle()
    scene.running_pod()

    assert stops(scene.step(59)) == []
    assert stops(scene.step(1)) == ["DeadlineExceeded"]


def test_the_active_deadline_may_be_raised_and_is_woken_for(training):
    """A user may change this field while the job runs.

    The next reconcile must then be at the new deadline.
    """
    scene, _ = training(activeDeadlineSeconds=60)
    assert scene.step(10).wake_after_s == 50

    scene.raw["spec"]["activeDeadlineSeconds"] = 100

    assert scene.step(50).wake_after_s == 40


def test_a_stalled_trainer_gets_a_new_pod_when_its_watchdog_has_not_ended_it(training):
    """The trainer's own watchdog should exit with code 82. The operator acts only after a grace period."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, last_progress_age_s=179.0)

    assert replaced(scene.step()) == []
    assert replaced(scene.step(1)) == ["Stalled"]


def test_a_trainer_that_cannot_be_reached_is_not_stalled(training):
    """The operator does not know the state of this trainer, which may well train."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, last_progress_age_s=0.0)

    assert replaced(scene.step(3600)) == []


def test_an_environment_that_steps_and_teaches_nothing_is_stalled(training):
    """The trainer responds, but its step count does not change.

    The deadline measures progress, not only whether the process is alive.
    """
    scene, pod = training(stallDeadlineSeconds=60)
    found = []
    for _ in range(19):
        scene.pass_(10)
        scene.poll(pod, step=50, last_progress_age_s=0.5)
        found += replaced(scene.step())

    assert found == ["Stalled"]
    assert "for more than 60 s" in scene.job()["metadata"]["annotations"]["palaestra.dev/replaced"]


def test_an_environment_that_never_stepped_is_stalled_too(training):
    """The trainer reports the phase `training`, but stays at step 0."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, step=0)
    scene.settle()
    scene.pass_(180)
    scene.poll(pod, step=0)

    assert replaced(scene.step()) == ["Stalled"]


def test_a_run_that_comes_forward_slowly_is_not_stalled(training):
    """One step a minute is slow, but it is progress."""
    scene, pod = training(stallDeadlineSeconds=60)
    for step in range(1, 20):
        scene.pass_(60)
        scene.poll(pod, step=step, last_progress_age_s=1.0)

        assert replaced(scene.step()) == []


@pytest.mark.parametrize("tells_ages", [True, False])
def test_an_evaluation_that_steps_is_progress(training, tells_ages):
    """An evaluation does not change the training's step count, so only its own steps show progress."""
    scene, pod = training(stallDeadlineSeconds=60)
    for _ in range(30):
        scene.pass_(60)
        stood = scene.node_stamp()
        ages = {"last_progress_age_s": 0.5} if tells_ages else {}
        scene.poll(pod, step=50, phase="evaluating", last_progress=stood, **ages)
        assert replaced(scene.step()) == []

    scene.pass_(180)
    ages = {"last_progress_age_s": 180.5} if tells_ages else {}
    scene.poll(pod, step=50, phase="evaluating", last_progress=stood, **ages)

    assert replaced(scene.step()) == ["Stalled"]


def test_the_next_attempt_has_the_whole_time_again(training, last_word):
    """The next attempt starts at the old step count, so the wait for progress must start again."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, step=50, last_progress_age_s=0.5)
    scene.settle()
    scene.pass_(170)
    scene.end(pod, 75, last_word(step=50, attempt=1))
    scene.settle()
    newest = scene.running_pod()
    scene.settle(20)
    scene.poll(newest, step=50, attempt=2)

    assert stops(scene.step()) == []
    assert scene.replica().last_progress == scene.now


def test_pods_that_are_taken_without_progress_are_capped(accepted, last_word):
    """Kubernetes has no limit for pods that exit with 75, so it would retry such a trainer for ever.

    The operator stops after the sixth pod: Kubernetes would by then wait five minutes before each new pod.
    """
    scene = accepted()
    pods = 0
    while scene.status.phase is not Phase.FAILED:
        pod = scene.running_pod()
        pods += 1
        scene.end(pod, 75, last_word(step=7, reason="Interrupted: SIGTERM received"))
        scene.settle(5)
        assert pods < 20

    assert scene.replica().reason == "NoProgress"
    assert (pods, scene.replica().attempt) == (6, 6)


def test_pods_that_fill_their_storage_again_and_again_are_reported_with_the_cause(accepted):
    """Kubernetes counts no eviction as a failure, so only the operator can stop these retries."""
    scene = accepted()
    while scene.status.phase is not Phase.FAILED:
        pod = scene.running_pod()
        scene.poll(pod, step=7)
        scene.settle()
        scene.take(pod, "the node evicts it")
        pod["status"] |= {"reason": "Evicted", "message": "usage of ephemeral-storage exceeds 1Gi"}
        scene.settle(5)
        assert scene.replica().reason == "EphemeralStorage"

    assert "usage of ephemeral-storage exceeds 1Gi" in scene.replica().message


def test_pods_that_are_taken_while_they_come_forward_are_not_capped(accepted, last_word):
    """A cluster of spot nodes evicts many pods, but the training advances."""
    scene = accepted()
    for number in range(20):
        pod = scene.running_pod()
        scene.settle(5)
        scene.end(pod, 75, last_word(step=number * 10 + 1, attempt=number + 1))
        scene.settle(5)

    assert (scene.replica().fruitless, scene.replica().restarts.disruption) == (0, 19)


def test_a_failed_replica_whose_job_appears_late_is_stopped_all_the_same(make_scene):
    """The operator had just created the Job, and its cache did not have the Job when the deadline passed."""
    scene = make_scene(activeDeadlineSeconds=60)
    scene.settle()
    jobs, scene.objects["jobs"] = scene.objects["jobs"], []
    scene.step(60)
    assert scene.status.phase is Phase.FAILED

    scene.objects["jobs"] = jobs

    assert stops(scene.step()) == ["DeadlineExceeded"]
    assert scene.settle().actions == ()


@pytest.mark.parametrize("how", ["unreachable", "deleted", "ended"])
def test_a_crash_loop_of_before_is_not_held_against_a_pod_that_trained(training, how):
    """An operator that has just started has not polled the trainer yet.

    The sidecars of an ending pod exit with errors, which look like a crash loop.
    """
    scene, pod = training()
    scene.poll(pod, phase="training", step=50)
    scene.settle(5)
    scene.polled.clear()
    scene.container(pod, "sim-collect-0", waiting="CrashLoopBackOff", code=143, restarts=5)
    if how == "deleted":
        scene.delete(pod, 1060)
    if how == "ended":
        scene.container(pod, "trainer", code=75)

    assert stops(scene.step(1000)) == []
