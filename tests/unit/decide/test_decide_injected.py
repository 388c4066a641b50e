"""A service mesh or an agent adds a container to a pod, before the trainer or next to it."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Replace, Stop
from palaestra.decide.eviction import OUTLIVED_S

PROXY = {"name": "istio-proxy", "image": "proxy"}


def add_proxy(scene, pod):
    """Add a running proxy before the trainer, as Istio does without native sidecars."""
    pod["spec"]["containers"].insert(0, PROXY)
    running = {"running": {"startedAt": scene.node_stamp()}}
    pod["status"]["containerStatuses"].insert(0, {"name": "istio-proxy", "ready": True, "state": running})


@pytest.fixture
def with_proxy(training):
    """`with_proxy()` returns a job that trains in a pod with a proxy, and that pod."""

    def make(**spec):
        scene, pod = training(**spec)
        add_proxy(scene, pod)
        scene.poll(pod)
        scene.settle()
        return scene, pod

    return make


def end_trainer(scene, pod, code, message=""):
    """End the trainer; the proxy keeps running, so the pod does not end."""
    proxy = pod["status"]["containerStatuses"][0]
    scene.container(pod, "trainer", code=code, message=message)
    others = [each for each in pod["status"]["containerStatuses"] if each is not proxy]
    pod["status"]["containerStatuses"] = [proxy, *others]


def test_a_pod_that_a_proxy_keeps_alive_says_so(with_proxy, last_word):
    """The pod's simulators keep running and its Job does not end, so the user needs the reason."""
    scene, pod = with_proxy()
    end_trainer(scene, pod, 0, last_word(step=100))

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.RUNNING, "KeptAlive")
    assert "container istio-proxy keeps the pod alive" in scene.replica().message
    assert (scene.replica().last_attempt.exit_code, scene.replica().last_attempt.reason) == (0, "Succeeded")


def test_a_job_ends_with_its_trainer_and_its_pod_is_ended_after_a_bound(with_proxy, last_word):
    """The trainer's exit code decides the result, even if the API server reports the Job as failed."""
    scene, pod = with_proxy()
    end_trainer(scene, pod, 0, last_word(step=100))
    scene.settle()

    early = scene.settle(OUTLIVED_S - 1)
    decision = scene.settle(2)
    scene.end_job("Failed", reason="DeadlineExceeded")
    scene.settle()

    assert not early.actions
    [stop] = [action for action in decision.actions if isinstance(action, Stop)]
    assert stop.patch["spec"] == {"activeDeadlineSeconds": 1}
    assert (scene.status.phase, scene.replica().reason) == (Phase.SUCCEEDED, "Succeeded")
    assert scene.replica().message.startswith("the training is complete: 100 steps")


@pytest.mark.parametrize(("code", "reason"), [(80, "SimulatorBudgetSpent"), (2, "ConfigurationRefused")])
def test_an_end_that_is_not_retried_is_the_trainers_too(with_proxy, last_word, code, reason):
    """The Job's failure policy applies only after all containers have ended, which the proxy prevents."""
    scene, pod = with_proxy()
    end_trainer(scene, pod, code, last_word(reason=f"{reason}: it"))
    scene.settle()

    scene.settle(OUTLIVED_S + 1)

    assert (scene.replica().phase, scene.replica().reason) == (Phase.FAILED, reason)


def test_a_trainer_that_is_retried_gets_a_new_pod_and_counts_once(with_proxy):
    """Only an eviction of the pod ends the proxy, so that the next pod can start."""
    scene, pod = with_proxy()
    end_trainer(scene, pod, 1)
    scene.settle()

    decision = scene.settle(OUTLIVED_S + 1)

    assert [action.times for action in decision.actions if isinstance(action, Replace)] == [1]
    assert "deletionTimestamp" in pod["metadata"]


def test_a_proxy_that_fails_after_the_trainer_was_done_fails_no_training(with_proxy, last_word):
    """A proxy that exits with an error makes its pod fail, and the Job would train again."""
    scene, pod = with_proxy()
    end_trainer(scene, pod, 0, last_word(step=100))
    pod["status"]["phase"] = "Failed"

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.SUCCEEDED, "Succeeded")


def test_a_job_that_failed_because_of_a_proxy_has_succeeded(with_proxy, last_word):
    """With `backoffLimit: 0` the Job fails before the operator sees the end of the pod."""
    scene, pod = with_proxy(backoffLimit=0)
    end_trainer(scene, pod, 0, last_word(step=100))
    pod["status"]["phase"] = "Failed"
    scene.end_job("Failed", reason="BackoffLimitExceeded")

    scene.settle()

    assert (scene.status.phase, scene.replica().reason) == (Phase.SUCCEEDED, "Succeeded")


def test_the_memory_of_a_proxy_is_not_that_of_a_simulator(training):
    """The remedy for a simulator would make the user raise the wrong memory limit."""
    scene, pod = training()
    pod["spec"]["initContainers"].insert(0, {**PROXY, "restartPolicy": "Always"})
    scene.container(pod, "istio-proxy", waiting="CrashLoopBackOff", code=137, reason="OOMKilled", restarts=3)

    scene.settle()

    assert scene.replica().memory_kills == ()
    assert scene.replica().reason == "SidecarCrashLoop"
