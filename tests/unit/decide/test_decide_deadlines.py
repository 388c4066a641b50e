"""Until when a replica has time; then it is stopped, by one patch that says why."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Stop


def stops(decision):
    """Return the reasons of the replicas that a decision stops."""
    return [each.reason.value for each in decision.actions if isinstance(each, Stop)]


def test_a_stop_is_one_patch_that_outlives_its_writer(training):
    """Annotation and deadline together: half of it would be lost with the operator."""
    scene, _ = training(activeDeadlineSeconds=60)

    (stop,) = scene.step(60).actions

    assert stop.patch == {
        "metadata": {"annotations": {"palaestra.dev/stopped": f"DeadlineExceeded: {stop.message}"}},
        "spec": {"activeDeadlineSeconds": 1},
    }


def test_a_replica_has_failed_once_its_job_carries_the_mark(training):
    """And not before: the patch may have failed."""
    scene, _ = training(activeDeadlineSeconds=60)
    scene.step(60)
    assert scene.status.phase is Phase.RUNNING

    decision = scene.settle()

    assert (scene.status.phase, scene.replica().reason) == (Phase.FAILED, "DeadlineExceeded")
    assert decision.actions == ()


def test_suspended_time_does_not_count_for_the_active_deadline(training):
    """Of ten minutes, one was active."""
    scene, _ = training(activeDeadlineSeconds=120)
    scene.raw["spec"]["suspend"] = True
    scene.settle(60)
    scene.objects["pods"].clear()
    scene.settle(600)
    scene.raw["spec"]["suspend"] = False
    scene.settle()
    scene.running_pod()

    assert stops(scene.step(59)) == []
    assert stops(scene.step(1)) == ["DeadlineExceeded"]


def test_the_active_deadline_may_be_raised_and_is_woken_for(training):
    """It is one of the fields that may change."""
    scene, _ = training(activeDeadlineSeconds=60)
    assert scene.step(10).wake_after_s == 50

    scene.raw["spec"]["activeDeadlineSeconds"] = 100

    assert scene.step(50).wake_after_s == 40


def test_a_job_that_waits_for_something_has_a_deadline_too(make_scene):
    """Nothing waits for ever that was given a bound; there is nothing to stop."""
    scene = make_scene(scheduling={"queueName": "robots"}, activeDeadlineSeconds=60)
    scene.settle()

    decision = scene.settle(60)

    assert scene.status.phase is Phase.FAILED
    assert scene.replica().reason == "DeadlineExceeded"
    assert stops(decision) == []


@pytest.mark.parametrize(
    ("waiting", "reason"),
    [
        ("ImagePullBackOff: no such image", "ImagePull"),
        ("CreateContainerError: no such file", "ContainerRefused"),
    ],
)
def test_what_does_not_come_has_the_start_deadline_of_its_group(accepted, waiting, reason):
    """From when it was first told: a registry may be away for a while."""
    groups = [{"name": "collect", "role": "Collect", "startDeadlineSeconds": 20}]
    scene = accepted(simulators=[*groups, {"name": "evaluate", "role": "Evaluate"}])
    scene.pass_(600)
    scene.container(scene.new_pod(), "sim-collect-0", waiting=waiting)
    assert scene.step().wake_after_s == 20

    assert stops(scene.step(19)) == []
    assert stops(scene.step(1)) == [reason]


def test_a_crash_loop_before_the_training_ends_at_the_start_deadline(accepted):
    """Kubernetes would restart the sidecar for ever and call the pod running."""
    scene = accepted()
    pod = scene.running_pod()
    scene.container(pod, "sim-collect-0", waiting="CrashLoopBackOff", code=3, restarts=3)

    assert stops(scene.step(59)) == []
    assert scene.replica().reason == "SidecarCrashLoop"
    assert stops(scene.step(1)) == ["SidecarCrashLoop"]
    scene.settle()
    assert scene.replica().message == (
        "container sim-collect-0 has crashed 3 times (exit code 3); read its log"
    )


def test_a_crash_loop_while_it_trains_is_the_trainers_to_judge(training):
    """It has a budget of faults for that."""
    scene, pod = training()
    scene.container(pod, "sim-collect-0", waiting="CrashLoopBackOff", code=3, restarts=5)
    scene.pass_(600)
    scene.poll(pod, phase="training", step=50)

    assert stops(scene.step()) == []
    assert scene.replica().reason == "SidecarCrashLoop"


def test_a_crash_loop_for_memory_is_told_as_what_it_is(accepted):
    """The remedy is another one."""
    scene = accepted()
    pod = scene.running_pod()
    scene.container(
        pod, "sim-collect-0", waiting="CrashLoopBackOff", code=137, reason="OOMKilled", restarts=3
    )

    assert stops(scene.step(60)) == ["SimulatorOutOfMemory"]


def test_a_simulator_that_does_not_start_is_named(training, simulator):
    """By the trainer's word, counted from the start of its container."""
    scene, pod = training()
    told = (simulator(state="failed", last_fault="collect-0: did not come up"), simulator(name="evaluate-0"))
    scene.pass_(59)
    scene.poll(pod, phase="starting", simulators=told)

    assert stops(scene.step()) == []
    assert stops(scene.step(1)) == ["SimulatorStartDeadline"]
    scene.settle()
    assert scene.replica().message.startswith(
        "sim-collect-0 is not up within 60 s of its container's start: collect-0: did not come up; "
    )


def test_a_slow_trainer_does_not_make_its_simulators_late(training, simulator):
    """Until it has told of a failed start, it may not have begun to start them."""
    scene, pod = training()
    scene.pass_(100)
    scene.poll(pod, phase="starting", simulators=(simulator(state="starting"),))

    decision = scene.step()
    assert (stops(decision), decision.wake_after_s) == ([], 20)
    assert stops(scene.step(20)) == ["SimulatorStartDeadline"]


def test_a_trainer_that_cannot_be_reached_says_nothing_about_its_simulators(training, simulator):
    """Unknown is not late: an old answer is no word of what is now."""
    scene, pod = training()
    scene.poll(pod, phase="starting", simulators=(simulator(state="failed", last_fault="it"),))
    scene.settle()

    assert stops(scene.step(100)) == []


def test_a_node_that_forgets_the_trainer_is_found_out(accepted):
    """Kubernetes issue 132826: all sidecars run, and the main container never starts."""
    scene = accepted()
    pod = scene.running_pod()
    scene.container(pod, "trainer", waiting="PodInitializing")
    assert scene.step().wake_after_s == 300

    assert stops(scene.step(300)) == ["TrainerNotStarted"]


def test_dropped_restart_policies_are_found_out_at_once(accepted):
    """Such a pod hangs in Init for ever."""
    scene = accepted()
    pod = scene.new_pod()
    del pod["spec"]["initContainers"][1]["restartPolicy"]

    assert stops(scene.step()) == ["RestartPolicyDropped"]


def test_a_stalled_trainer_is_stopped_when_its_watchdog_has_not_done_it(training):
    """By its own word, with a grace in which it ends itself (exit code 82)."""
    scene, pod = training(stallDeadlineSeconds=60)
    moved = scene.stamp()
    scene.pass_(179)
    scene.poll(pod, last_progress=moved)

    assert stops(scene.step()) == []
    assert stops(scene.step(1)) == ["Stalled"]


def test_a_trainer_that_cannot_be_reached_is_not_stalled(training):
    """It is unknown; it may well train."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, last_progress=scene.stamp())

    assert stops(scene.step(3600)) == []


def test_an_environment_that_steps_and_teaches_nothing_is_stalled(training):
    """It answers, and the step count does not move: the deadline measures progress, not liveness."""
    scene, pod = training(stallDeadlineSeconds=60)
    found = []
    for _ in range(19):
        scene.pass_(10)
        scene.poll(pod, step=50, last_progress=scene.stamp())
        found += stops(scene.step())

    assert found == ["Stalled"]
    assert "for more than 60 s" in scene.job()["metadata"]["annotations"]["palaestra.dev/stopped"]


def test_an_environment_that_never_stepped_is_stalled_too(training):
    """Its trainer says that it trains, and has nothing to show for it."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, step=0)
    scene.settle()
    scene.pass_(180)
    scene.poll(pod, step=0)

    assert stops(scene.step()) == ["Stalled"]


def test_a_run_that_comes_forward_slowly_is_not_stalled(training):
    """One step in a minute is progress."""
    scene, pod = training(stallDeadlineSeconds=60)
    for step in range(1, 20):
        scene.pass_(60)
        scene.poll(pod, step=step, last_progress=scene.stamp(-1))

        assert stops(scene.step()) == []


def test_an_evaluation_that_steps_is_progress(training):
    """Nothing is learned from it, by intention; one that does not step is none."""
    scene, pod = training(stallDeadlineSeconds=60)
    for _ in range(30):
        scene.pass_(60)
        scene.poll(pod, step=50, phase="evaluating", last_progress=scene.stamp())
        assert stops(scene.step()) == []

    stood = scene.stamp()
    scene.pass_(180)
    scene.poll(pod, step=50, phase="evaluating", last_progress=stood)

    assert stops(scene.step()) == ["Stalled"]


def test_the_next_attempt_has_the_whole_time_again(training, last_word):
    """It goes on at the step at which the last one ended."""
    scene, pod = training(stallDeadlineSeconds=60)
    scene.poll(pod, step=50, last_progress=scene.stamp())
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
    """A trainer that always exits 75 would be tried for ever: Kubernetes has no bound for it.

    The last one is not waited for: by then Kubernetes waits five minutes before each new pod.
    """
    scene = accepted()
    pods = 0
    while scene.status.phase is not Phase.FAILED:
        pod = scene.running_pod()
        pods += 1
        scene.end(pod, 75, last_word(reason="Interrupted: SIGTERM received"))
        scene.settle(5)
        assert pods < 20

    assert scene.replica().reason == "NoProgress"
    assert (pods, scene.replica().attempt) == (6, 6)


def test_pods_that_fill_their_storage_again_and_again_are_told_so(accepted):
    """An eviction is no failure to Kubernetes, whatever its cause."""
    scene = accepted()
    while scene.status.phase is not Phase.FAILED:
        pod = scene.running_pod()
        scene.take(pod, "the node evicts it")
        pod["status"] |= {"reason": "Evicted", "message": "usage of ephemeral-storage exceeds 1Gi"}
        scene.settle(5)
        assert scene.replica().reason == "EphemeralStorage"

    assert "usage of ephemeral-storage exceeds 1Gi" in scene.replica().message


def test_pods_that_are_taken_while_they_come_forward_are_not_capped(accepted, last_word):
    """A cluster of spot nodes trains too."""
    scene = accepted()
    for number in range(20):
        pod = scene.running_pod()
        scene.settle(5)
        scene.end(pod, 75, last_word(step=number * 10 + 1, attempt=number + 1))
        scene.settle(5)

    assert (scene.replica().fruitless, scene.replica().restarts.disruption) == (0, 19)


def test_a_failed_replica_whose_job_appears_late_is_stopped_all_the_same(make_scene):
    """It was created just before the status was written, and not seen yet."""
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
    """An operator that has just started has heard nothing yet, and sidecars end with their pod."""
    scene, pod = training()
    scene.poll(pod, phase="training", step=50)
    scene.settle(5)
    scene.polled.clear()
    scene.container(pod, "sim-collect-0", waiting="CrashLoopBackOff", code=143, restarts=5)
    if how == "deleted":
        pod["metadata"]["deletionTimestamp"] = scene.stamp(1060)
    if how == "ended":
        scene.container(pod, "trainer", code=75)

    assert stops(scene.step(1000)) == []
