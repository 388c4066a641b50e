"""What is wrong with a replica that goes on: shown at once, in the words of whoever knows."""

import pytest

from palaestra.api.status import Phase


def refused(scene, words, **event):
    """Let the API server refuse a pod of the Job."""
    scene.objects["events"].append(
        {
            "reason": "FailedCreate",
            "message": words,
            "involvedObject": {"uid": scene.job()["metadata"]["uid"]},
            "lastTimestamp": scene.stamp(),
            **event,
        }
    )


@pytest.mark.parametrize(
    "words",
    [
        'Error creating: pods "job-0-x" is forbidden: exceeded quota: compute',
        'Error creating: pods "job-0-x" is forbidden: violates PodSecurity "restricted:latest"',
        'Error creating: admission webhook "sizes.example.com" denied the request: too large',
        'Error creating: pods "job-0-x" is forbidden: minimum cpu usage per Container is 1',
    ],
)
def test_pods_that_are_refused_are_told_in_the_api_servers_words(accepted, words):
    """Quota, Pod Security, a webhook, a LimitRange: nothing but an event on the Job tells."""
    scene = accepted()
    refused(scene, words)

    scene.settle()

    assert scene.replica().reason == "PodsRefused"
    assert scene.replica().message == f"no pod can be made: {words}"
    assert scene.status.phase is Phase.PENDING


def test_an_old_refusal_does_not_count(accepted):
    """A pod was made since."""
    scene = accepted()
    refused(scene, "exceeded quota")
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert scene.replica().reason == "Training"


def test_no_node_is_told_in_the_schedulers_words(accepted):
    """They name what is short."""
    scene = accepted()
    pod = scene.new_pod()
    words = "0/3 nodes are available: 3 Insufficient nvidia.com/gpu."
    pod["status"]["conditions"] = [
        {"type": "PodScheduled", "status": "False", "reason": "Unschedulable", "message": words}
    ]

    scene.settle()

    assert scene.replica().reason == "Unschedulable"
    assert words in scene.replica().message


@pytest.mark.parametrize(
    "waiting", ["ErrImagePull: not found", "ImagePullBackOff: Back-off", "InvalidImageName"]
)
def test_an_image_that_does_not_come_is_named_with_its_container(accepted, waiting):
    """In a pod of four containers it is not clear whose it is."""
    scene = accepted()
    scene.container(scene.new_pod(), "sim-collect-0", waiting=waiting)

    scene.settle()

    assert scene.replica().reason == "ImagePull"
    assert scene.replica().message.startswith("container sim-collect-0: image stub:1 cannot be pulled (")
    assert waiting.split(": ")[-1] in scene.replica().message


def test_a_container_that_the_node_cannot_make_is_named(accepted):
    """As when the Secret lacks the key."""
    scene = accepted()
    words = "couldn't find key token in Secret default/keys"
    scene.container(scene.new_pod(), "trainer", waiting=f"CreateContainerConfigError: {words}")

    scene.settle()

    assert scene.replica().reason == "ContainerRefused"
    assert words in scene.replica().message


def test_a_pod_that_is_not_gone_when_it_should_be_is_on_a_lost_node(training):
    """Nothing is force-deleted: the pod may still write to the volume."""
    scene, pod = training()
    pod["metadata"]["deletionTimestamp"] = scene.stamp(60)
    assert scene.step().wake_after_s == 90
    assert scene.replica().reason == "Training"

    scene.settle(90)

    assert scene.replica().reason == "NodeLost"
    assert "node node-1 does not confirm it; delete the Node object" in scene.replica().message


def test_a_simulator_that_is_killed_for_its_memory_is_named(training):
    """The trainer only sees that it broke."""
    scene, pod = training()
    scene.container(
        pod, "sim-collect-0", waiting="CrashLoopBackOff", code=137, reason="OOMKilled", restarts=2
    )
    scene.poll(pod)

    scene.settle()

    assert scene.replica().reason == "SimulatorOutOfMemory"
    assert "container sim-collect-0 was killed for its memory 2 times" in scene.replica().message


def test_between_two_pods_it_is_told_how_the_last_one_failed(training, last_word):
    """With the trainer's own last word."""
    scene, pod = training()
    scene.end(pod, 70, last_word(reason="Unexpected: KeyError"))
    scene.count_failures(1)

    decision = scene.settle()

    assert scene.replica().reason == "Retrying"
    assert "exit code 70, Unexpected: KeyError" in scene.replica().message
    assert [(each.type.value, each.reason.value) for each in decision.events] == [("Warning", "Retrying")]


def test_without_a_last_word_the_end_of_the_log_is_told(training):
    """Kubernetes puts it into the termination message."""
    scene, pod = training()
    scene.end(pod, 1, "Traceback (most recent call last):\n  ...\nMemoryError\n")

    scene.settle()

    assert "exit code 1, MemoryError" in scene.replica().message


def test_a_trainer_that_is_tried_again_after_it_ran_out_of_memory_says_so(training):
    """The next pod may do better with less in its buffer; or not."""
    scene, pod = training()
    scene.end(pod, 137, reason="OOMKilled")

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.PENDING, "Retrying")
    assert "failed: the trainer was killed for its memory; another goes on" in scene.replica().message


def test_a_pod_that_the_cluster_took_is_no_failure(training):
    """And no warning: it is what clusters do."""
    scene, pod = training()
    scene.take(pod, "preempted by a more important pod")

    decision = scene.settle()

    assert scene.replica().reason == "Interrupted"
    assert "preempted by a more important pod" in scene.replica().message
    assert [each.type.value for each in decision.events] == ["Normal"]


def test_while_its_simulators_start_a_trainer_does_not_train(training):
    """By its own word; one that serves none is believed to train."""
    scene, pod = training()
    scene.poll(pod, phase="starting")

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.RUNNING, "Starting")
