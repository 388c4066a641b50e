"""Memory kills of containers are counted apart from crashes, each with the memory limit of its container."""

import pytest

from palaestra.decide import fitted
from palaestra.observe.cache_trim import SIZE

FULL = {"metadata": {"annotations": {SIZE: "1400000"}}}  # the spec leaves almost no bytes for the status
GROUP = {"name": "collect", "role": "Collect", "resources": {"limits": {"memory": "512Mi"}}}
GROUPS = [GROUP, {"name": "evaluate", "role": "Evaluate"}]


@pytest.fixture
def scene_and_pod(training):
    """Return a job that trains, and its pod; the collecting simulator has a memory limit."""
    return training(simulators=GROUPS)


def kill(scene, pod, name="sim-collect-0", restarts=1):
    """Let the kernel kill a container; the kubelet restarts it before the next reconcile."""
    ended = {"exitCode": 137, "reason": "OOMKilled", "finishedAt": scene.stamp()}
    scene.container(pod, name, running=True, restarts=restarts)
    for each in pod["status"]["initContainerStatuses"]:
        if each["name"] == name:
            each["lastState"] = {"terminated": ended}


def told(decision):
    """Return the messages of the events about memory."""
    return [each.message for each in decision.events if each.reason.endswith("OutOfMemory")]


def kills(scene):
    """Return the container, the count and the limit of each memory kill."""
    return [(each.container, each.times, each.limit) for each in scene.replica().memory_kills]


def test_a_memory_kill_of_a_simulator_that_is_back_at_once_is_reported(scene_and_pod):
    """After a first kill, the kubelet restarts the container without a delay, so the kill is easy to miss."""
    scene, pod = scene_and_pod
    kill(scene, pod)

    decision = scene.settle(1)

    assert scene.replica().reason == "Training"
    [message] = told(decision)
    assert message == (
        "container sim-collect-0 ran out of memory and was killed (limit 512Mi, 1 so far); "
        "raise spec.simulators[].resources.limits.memory"
    )
    assert kills(scene) == [("sim-collect-0", 1, "512Mi")]


def test_each_kill_is_counted_once(scene_and_pod):
    """The count shows how often memory was too small in all attempts.

    A reconcile without a new kill must not raise it.
    """
    scene, pod = scene_and_pod
    kill(scene, pod)
    first = told(scene.settle(1))
    assert told(scene.settle(30)) == []
    kill(scene, pod, restarts=2)
    scene.settle(1)
    scene.take(pod)
    scene.settle(5)
    kill(scene, scene.running_pod())

    last = told(scene.settle(5))

    assert kills(scene) == [("sim-collect-0", 3, "512Mi")]
    assert len(first) == 1
    assert "3 so far" in last[0]


def test_a_kill_is_one_event_also_where_the_status_has_no_room(scene_and_pod):
    """A full status drops the record of the kill, so each reconcile would report the kill again."""
    scene, pod = scene_and_pod
    kill(scene, pod)
    scene.settle(1)
    repeated = []
    for _ in range(3):
        scene.raw["status"] = fitted(FULL, scene.raw["status"])
        repeated += told(scene.step(30))
    kill(scene, pod, restarts=2)

    last = told(scene.settle(1))

    assert repeated == []
    assert len(last) == 1
    assert "2 so far" in last[0]


def test_a_simulator_that_crashed_was_not_killed_for_its_memory(scene_and_pod):
    """Both ends have exit code 137, and only the reason `OOMKilled` shows a memory kill."""
    scene, pod = scene_and_pod
    scene.container(pod, "sim-collect-0", waiting="CrashLoopBackOff", code=137, restarts=3)

    scene.settle()

    assert scene.replica().reason == "SidecarCrashLoop"
    assert kills(scene) == []


def test_a_kill_that_is_the_replicas_reason_is_one_event(scene_and_pod):
    """The operator finds the kill as the reason of the replica and in the container, but reports it once."""
    scene, pod = scene_and_pod
    scene.container(
        pod, "sim-collect-0", waiting="CrashLoopBackOff", code=137, reason="OOMKilled", restarts=1
    )

    decision = scene.settle(1)

    assert scene.replica().reason == "SimulatorOutOfMemory"
    assert len(told(decision)) == 1


def test_without_a_limit_it_was_its_node_that_ran_short(scene_and_pod):
    """A webhook may have removed the limits. The message must then name the node's memory as the cause."""
    scene, pod = scene_and_pod
    for each in pod["spec"]["initContainers"]:
        del each["resources"]["limits"]
    kill(scene, pod)

    decision = scene.settle(1)

    assert "(no limit, so its node ran out of memory, 1 so far)" in told(decision)[0]


def test_the_trainers_kills_are_counted_too(training):
    """The pod of a killed trainer fails, and the restart count of the next pod's container starts at zero."""
    scene, pod = training(trainer={"resources": {"limits": {"memory": "1Gi"}}})
    scene.end(pod, 137, reason="OOMKilled")
    decision = scene.settle(1)
    scene.pass_(10)
    scene.end(scene.running_pod(), 137, reason="OOMKilled")

    scene.settle(1)

    assert kills(scene) == [("trainer", 2, "1Gi")]
    assert told(decision)[0].startswith(
        "the trainer ran out of memory and was killed (limit 1Gi, 1 so far); "
    )


def test_a_spent_budget_names_the_memory_that_its_simulators_lacked(training, last_word):
    """The trainer sees only dead simulators, so the operator must add the memory limit as the cause."""
    scene, pod = training()
    for each in pod["spec"]["initContainers"]:
        each["resources"] = {"limits": {"memory": "150Mi"}}
    scene.end(pod, 80, last_word(reason="SimulatorBudgetSpent: collect-0: 11 restarts (dead 10)"))
    scene.container(pod, "sim-collect-0", code=137, reason="OOMKilled")
    scene.end_job("Failed", reason="PodFailurePolicy")

    scene.settle()

    for told in (scene.replica(), scene.replica().last_attempt):
        assert told.reason == "SimulatorBudgetSpent"
        assert told.message.endswith(
            "(dead 10); sim-collect-0 ran out of memory and was killed (limit 150Mi); "
            "raise spec.simulators[].resources.limits.memory"
        )
