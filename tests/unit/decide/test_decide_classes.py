"""Some problems end by themselves, some need a new pod, and only few end the replica."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Replace, Stop

NIGHT_S = 21_600  # the default of startTimeoutSeconds


def stops(decision):
    """Return the reasons of the replicas that a decision stops."""
    return [each.reason.value for each in decision.actions if isinstance(each, Stop)]


def replacements(decision):
    """Return the replacements of pods in a decision."""
    return [each for each in decision.actions if isinstance(each, Replace)]


def forget(scene):
    """Create the next pod on a node that never starts the trainer, and decide after the grace time."""
    pod = scene.running_pod()
    scene.container(pod, "trainer", waiting="PodInitializing")
    scene.settle()
    return pod, scene.step(300)


def end(scene, pod):
    """Let an evicted pod end, and delete it."""
    pod["status"]["phase"] = "Failed"
    scene.settle(5)
    scene.objects["pods"].remove(pod)
    scene.pass_(5)


@pytest.mark.parametrize(
    ("container", "state", "reason"),
    [
        ("sim-collect-0", {"waiting": "ImagePullBackOff: no such image"}, "ImagePull"),
        ("sim-collect-0", {"waiting": "CreateContainerError: no such file"}, "ContainerRefused"),
        ("sim-collect-0", {"waiting": "CrashLoopBackOff", "code": 3, "restarts": 9}, "SidecarCrashLoop"),
        (
            "sim-collect-0",
            {"waiting": "CrashLoopBackOff", "code": 137, "reason": "OOMKilled", "restarts": 9},
            "SimulatorOutOfMemory",
        ),
    ],
)
def test_a_container_that_a_kubelet_retries_ends_nothing_and_is_reported(
    training, last_word, container, state, reason
):
    """A registry that is unavailable for a day must not end a run at step 3,000,000."""
    scene, pod = training()
    scene.end(pod, 75, last_word(step=3_000_000))
    scene.settle(5)
    second = scene.new_pod()
    scene.container(second, container, **state)
    found = [*stops(scene.settle(5)), *replacements(scene.step(60)), *stops(scene.settle(86_400))]

    assert found == []
    assert (scene.replica().phase, scene.replica().reason) == (Phase.PENDING, reason)
    assert scene.replica().message.startswith("container sim-collect-0")
    assert (scene.replica().restarts.trainer, scene.replica().restarts.operator) == (0, 0)


def test_a_name_that_no_image_can_have_is_final(accepted):
    """The name is not valid in any registry, so a retry cannot help."""
    scene = accepted()
    scene.container(scene.new_pod(), "sim-collect-0", waiting="InvalidImageName: bad")

    assert stops(scene.step()) == ["ImagePull"]


def test_a_simulator_that_does_not_start_is_reported_and_left_to_the_trainer(training, simulator):
    """The trainer has a restart budget for simulators, so the operator does not stop the replica itself."""
    scene, pod = training()
    told = {"phase": "starting", "simulators": (simulator(state="failed", last_fault="did not come up"),)}
    scene.poll(pod, **told)
    scene.settle()
    assert scene.replica().reason == "Starting"
    scene.pass_(60)
    scene.poll(pod, **told)

    assert stops(scene.settle()) == []
    assert (scene.replica().phase, scene.replica().reason) == (Phase.RUNNING, "SimulatorStartDeadline")
    assert scene.replica().message.startswith(
        "sim-collect-0 is not up within 60 s of its container's start: did not come up; "
    )


@pytest.mark.parametrize("seconds", [None, 100])
def test_the_wait_for_a_first_step_is_bounded_and_names_what_it_waits_for(accepted, seconds):
    """A job with a typo in its image must not hold quota for ever."""
    spec = {} if seconds is None else {"startTimeoutSeconds": seconds}
    scene = accepted(**spec)
    scene.container(scene.new_pod(), "trainer", waiting="ErrImagePull: not found")
    scene.settle()
    bound = seconds or NIGHT_S

    assert stops(scene.step(bound - 1)) == []
    assert stops(scene.step(1)) == ["ImagePull"]
    scene.settle()
    assert (scene.replica().phase, scene.replica().reason) == (Phase.FAILED, "ImagePull")
    assert scene.replica().message.startswith(f"no step within {bound} s, as long as startTimeoutSeconds")


def test_a_wait_for_nothing_that_has_a_name_is_bounded_too(accepted):
    """For example, Kubernetes may never create a pod for the Job."""
    scene = accepted(startTimeoutSeconds=100)

    assert stops(scene.step(100)) == ["StartTimeout"]


@pytest.mark.parametrize("before_s", [0, 1, 59])
def test_a_reason_that_a_kubelet_does_not_show_for_a_moment_is_the_reason_all_the_same(accepted, before_s):
    """A restarted kubelet does not report the pull error for a moment.

    The user must still read that the image is wrong.
    """
    scene = accepted(startTimeoutSeconds=100)
    pod = scene.new_pod()
    scene.container(pod, "trainer", waiting="ImagePullBackOff: not found")
    scene.settle()

    scene.container(pod, "trainer", waiting="ContainerCreating")
    found = [*stops(scene.settle(100 - before_s)), *stops(scene.settle(before_s))]

    assert found == ["ImagePull"]
    assert scene.replica().reason == "ImagePull"
    assert "allows; a moment ago: " in scene.replica().message


def test_a_trouble_that_has_passed_is_not_the_reason(accepted):
    """The image was pulled long before the timeout, so the earlier pull error is not the cause."""
    scene = accepted(startTimeoutSeconds=1000)
    pod = scene.new_pod()
    scene.container(pod, "trainer", waiting="ImagePullBackOff: not found")
    scene.settle()

    scene.container(pod, "trainer", waiting="ContainerCreating")
    scene.settle(939)

    assert stops(scene.settle(61)) == ["StartTimeout"]


def test_time_in_a_queue_or_suspended_is_no_wait_for_a_first_step(make_scene):
    """A job may wait in a queue for a week before it is admitted."""
    scene = make_scene(scheduling={"queueName": "robots"}, startTimeoutSeconds=100)
    scene.kueue = True
    scene.settle()

    assert stops(scene.settle(3600)) == []
    scene.job()["spec"]["suspend"] = False
    scene.settle()
    assert stops(scene.settle(99)) == []
    assert stops(scene.step(1)) == ["StartTimeout"]


def test_a_trainer_that_runs_and_reports_nothing_waits_for_no_step(training):
    """A user's own program may serve no status.

    The operator does not know its steps, so it must not stop the program.
    """
    scene, _ = training(startTimeoutSeconds=100)

    assert stops(scene.settle(100)) == []
    assert stops(scene.settle(86_400)) == []


def test_what_no_kubelet_heals_gets_a_new_pod_and_is_counted(accepted):
    """The operator marks the Job before it evicts the pod.

    The replica counts an attempt, but the Job counts no failure.
    """
    scene = accepted()
    pod, decision = forget(scene)

    (replacement,) = replacements(decision)
    assert (replacement.pod, replacement.uid, replacement.times) == ("job-0-0", "pod-0", 1)
    mark = f"1 pod-0 TrainerNotStarted: {replacement.message}"
    assert replacement.patch == {"metadata": {"annotations": {"palaestra.dev/replaced": mark}}}
    end(scene, pod)
    scene.running_pod()
    scene.settle()
    restarts = scene.replica().restarts
    assert (restarts.operator, restarts.disruption, restarts.trainer) == (1, 0, 0)
    assert scene.replica().attempt == 2
    assert scene.replica().last_attempt.reason == "TrainerNotStarted"


def test_a_pod_that_is_marked_and_lives_is_evicted_again(accepted):
    """The operator may be killed after it wrote the mark and before it evicted the pod.

    After its restart the operator evicts the pod, and counts the replacement once.
    """
    scene = accepted()
    scene.budget = True
    forget(scene)
    scene.restart()

    (again,) = replacements(scene.step())

    assert (again.times, again.marked) == (1, True)
    assert scene.replica().reason == "TrainerNotStarted"


def test_a_disruption_budget_that_allows_no_eviction_is_reported(accepted):
    """The operator retries the eviction. If it deleted the pod instead, it would ignore the budget."""
    scene = accepted()
    scene.budget = True
    forget(scene)
    scene.denied = {0: "Cannot evict pod as it would violate the pod's disruption budget."}

    scene.step()

    assert scene.replica().message.endswith(
        "; it is not replaced yet: Cannot evict pod as it would violate the pod's disruption budget."
    )


def test_a_pod_that_is_being_deleted_is_not_replaced_again(accepted):
    """A second eviction of the same pod would count a replacement that did not happen."""
    scene = accepted()
    forget(scene)

    assert replacements(scene.settle(30)) == []


@pytest.mark.parametrize("limit", [0, 2])
def test_pods_are_replaced_as_often_as_the_limit_allows(accepted, limit):
    """After `backoffLimit` replacements the replica fails, with the reason TrainerNotStarted."""
    scene = accepted(backoffLimit=limit)
    for _ in range(limit):
        pod, decision = forget(scene)
        assert len(replacements(decision)) == 1
        end(scene, pod)
    _, last = forget(scene)

    assert (stops(last), replacements(last)) == (["TrainerNotStarted"], [])


def test_dropped_restart_policies_are_found_out_at_once(accepted):
    """A pod without these restart policies never starts its trainer.

    With an early message, a person can fix the webhook while the replica still has retries.
    """
    scene = accepted()
    pod = scene.new_pod()
    del pod["spec"]["initContainers"][1]["restartPolicy"]

    (replacement,) = replacements(scene.step())

    assert replacement.reason == "RestartPolicyDropped"


@pytest.mark.parametrize(
    "mark",
    ["", "x", "1", "1 pod-0", "-1 pod-0 Stalled: it", "1 pod-0 Stalled", "9999999999 pod-0 Stalled: it", 3],
)
def test_a_mark_that_is_not_ours_is_none(accepted, mark):
    """Another program may write any value into this annotation."""
    scene = accepted()
    scene.running_pod()
    scene.job()["metadata"]["annotations"] = {"palaestra.dev/replaced": mark}

    assert replacements(scene.settle()) == []
    assert scene.replica().reason == "Training"


def take(scene, pod, seconds=5):
    """Let the cluster evict a pod, and let time pass until it is gone."""
    scene.take(pod)
    scene.settle(seconds)


@pytest.mark.parametrize(("limit", "pods"), [(None, 6), (2, 2), (0, None)])
def test_pods_that_are_taken_without_a_step_are_bounded_by_the_limit(training, limit, pods):
    """A run without progress must not use a cluster for ever.

    `noProgressLimit` counts the evicted pods since the last progress, and 0 means no limit.
    """
    spec = {} if limit is None else {"noProgressLimit": limit}
    scene, pod = training(**spec)
    scene.poll(pod, step=7)
    scene.settle()
    made = 0
    while scene.status.phase is not Phase.FAILED and made < 12:
        take(scene, pod)
        made += 1
        if scene.status.phase is not Phase.FAILED:
            pod = scene.running_pod()
            scene.settle(5)

    assert made == (pods or 12)


def test_a_program_that_reports_nothing_is_never_without_progress(training):
    """The operator cannot know whether such a program makes progress, so it never stops the program."""
    scene, pod = training()
    for _ in range(20):
        take(scene, pod)
        pod = scene.running_pod()
        scene.settle(5)

    assert scene.replica().phase is Phase.RUNNING
    assert (scene.replica().fruitless, scene.replica().restarts.disruption) == (0, 20)


def test_pods_whose_trainer_did_not_start_are_not_without_progress(training):
    """A full cluster may preempt many pods while they pull their images."""
    scene, pod = training()
    scene.poll(pod, step=7)
    scene.settle()
    take(scene, pod)
    for _ in range(20):
        pod = scene.new_pod()
        scene.settle(5)
        pod["status"] |= {"phase": "Failed", "conditions": [{"type": "DisruptionTarget", "status": "True"}]}
        scene.settle(5)

    assert scene.replica().phase is Phase.PENDING
    assert scene.replica().fruitless == 1
