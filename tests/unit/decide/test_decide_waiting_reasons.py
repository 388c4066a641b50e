"""The status shows at once why a replica waits, with the message of the program that reports the problem."""

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
    ],
)
def test_the_message_about_refused_pods_quotes_the_api_server(accepted, words):
    """A quota, Pod Security, a webhook or a LimitRange may refuse the pods.

    Only an event on the Job has the cause.
    """
    scene = accepted()
    refused(scene, words)

    scene.settle()

    assert scene.replica().reason == "PodsRefused"
    assert scene.replica().message == f"no pod can be created: {words}"
    assert scene.status.phase is Phase.PENDING


MASTER, TRAINER = "spec.rosMaster.resources", "spec.trainer.resources"
SIMULATORS = "spec.simulators[].resources"
EVERY = f"{MASTER}, {SIMULATORS} and {TRAINER}"


@pytest.mark.parametrize(
    ("words", "fields"),
    [
        ("failed quota: q: must specify limits.cpu for: install-sidecar,ros-master", MASTER),
        ("failed quota: q: must specify limits.cpu for: sim-collect-0,sim-evaluate-0", SIMULATORS),
        (
            "failed quota: q: must specify limits.cpu for: ros-master; requests.cpu for: trainer",
            f"{MASTER} and {TRAINER}",
        ),
        (
            "minimum cpu usage per Container is 100m, but request is 25m",
            EVERY,
        ),
        (
            "memory max limit to request ratio per Container is 2, but provided ratio is 4.000000",
            EVERY,
        ),
        ("maximum cpu usage per Pod is 1, but limit is 2", EVERY),
    ],
)
def test_a_pod_refused_for_its_sizes_names_the_fields_that_set_them(accepted, words, fields):
    """The API server's message names containers such as `ros-master`, but a user can only set fields."""
    scene = accepted()
    refused(scene, f'Error creating: pods "job-0-x" is forbidden: {words}')

    scene.settle()

    assert scene.replica().message.endswith(
        f"{words}; set {fields} in a new job, or jobs.resources in the chart for all jobs"
    )


def test_a_pod_refused_for_a_webhooks_container_names_no_field_of_the_job(accepted):
    """A webhook added this container, so no field of a job sets its resources."""
    scene = accepted()
    refused(scene, "failed quota: q: must specify limits.cpu for: istio-proxy")

    scene.settle()

    assert scene.replica().message.endswith("limits.cpu for: istio-proxy")


def test_an_old_refusal_does_not_count(accepted):
    """The API server has accepted a pod since that event."""
    scene = accepted()
    refused(scene, "exceeded quota")
    scene.pass_(5)
    scene.running_pod()

    scene.settle()

    assert scene.replica().reason == "Training"


def test_the_message_about_an_unschedulable_pod_quotes_the_scheduler(accepted):
    """The scheduler's message names the missing resource."""
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
    """A pod has several containers, and the user must know whose image is wrong."""
    scene = accepted()
    scene.container(scene.new_pod(), "sim-collect-0", waiting=waiting)

    scene.settle()

    assert scene.replica().reason == "ImagePull"
    assert scene.replica().message.startswith("container sim-collect-0: image stub:1 cannot be pulled (")
    assert waiting.split(": ")[-1] in scene.replica().message


def test_a_container_that_the_node_cannot_make_is_named(accepted):
    """For example, a Secret may lack the key that the container uses."""
    scene = accepted()
    words = "couldn't find key token in Secret default/keys"
    scene.container(scene.new_pod(), "trainer", waiting=f"CreateContainerConfigError: {words}")

    scene.settle()

    assert scene.replica().reason == "ContainerRefused"
    assert words in scene.replica().message


def test_a_pod_that_is_not_gone_when_it_should_be_is_on_a_lost_node(training):
    """The pod may still write to the volume, so the operator must not force its deletion."""
    scene, pod = training()
    scene.delete(pod)
    assert scene.step().wake_after_s == 90
    assert scene.replica().reason == "Training"

    scene.settle(90)

    assert scene.replica().reason == "NodeLost"
    assert "node node-1 has not confirmed it; delete the Node object" in scene.replica().message


def test_a_simulator_that_is_killed_for_its_memory_is_named(training):
    """The trainer sees only a failed simulator, but the status of the container shows the memory kill."""
    group = {"name": "collect", "role": "Collect", "resources": {"limits": {"memory": "512Mi"}}}
    scene, pod = training(simulators=[group, {"name": "evaluate", "role": "Evaluate"}])
    scene.container(
        pod, "sim-collect-0", waiting="CrashLoopBackOff", code=137, reason="OOMKilled", restarts=2
    )
    scene.poll(pod)

    scene.settle()

    assert scene.replica().reason == "SimulatorOutOfMemory"
    assert scene.replica().message == (
        "container sim-collect-0 ran out of memory and was killed (limit 512Mi, 1 so far); "
        "raise spec.simulators[].resources.limits.memory"
    )


def test_between_two_pods_the_message_says_how_the_last_one_failed(training, last_word):
    """While no pod runs, the user reads in this message why the last pod failed."""
    scene, pod = training()
    scene.end(pod, 70, last_word(reason="Unexpected: KeyError"))
    scene.count_failures(1)

    decision = scene.settle()

    assert scene.replica().reason == "Retrying"
    assert "exit code 70, Unexpected: KeyError" in scene.replica().message
    assert [(each.type.value, each.reason.value) for each in decision.events] == [("Warning", "Retrying")]


def test_without_a_last_word_the_message_quotes_the_end_of_the_log(training):
    """A trainer that crashed wrote no message, so Kubernetes' copy of the end of its log has the cause."""
    scene, pod = training()
    scene.end(pod, 1, "Traceback (most recent call last):\n  ...\nMemoryError\n")

    scene.settle()

    assert "exit code 1, MemoryError" in scene.replica().message


def test_a_trainer_that_is_tried_again_after_it_ran_out_of_memory_says_so(training):
    """The next pod may fail in the same way, so the user must see the cause after the first failure."""
    scene, pod = training()
    scene.end(pod, 137, reason="OOMKilled")

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.PENDING, "Retrying")
    assert "the trainer was killed because it ran out of memory; the next pod" in scene.replica().message


def test_a_pod_that_the_cluster_took_is_no_failure(training):
    """Clusters evict pods all the time, so the operator emits no warning."""
    scene, pod = training()
    scene.take(pod, "preempted by a more important pod")

    decision = scene.settle()

    assert scene.replica().reason == "Disrupted"
    assert "preempted by a more important pod" in scene.replica().message
    assert [each.type.value for each in decision.events] == ["Normal"]


def test_a_trainer_that_stopped_and_nobody_says_why_is_interrupted(training, last_word):
    """The trainer stopped because the ROS master was lost, so the status must not report an eviction."""
    scene, pod = training()
    scene.end(pod, 75, last_word(reason="MasterLost: it does not answer"))

    scene.settle()

    assert scene.replica().reason == "Interrupted"
    assert "(exit code 75, MasterLost: it does not answer)" in scene.replica().message


def test_a_full_volume_is_reported_between_retries(training, last_word):
    """A user who reads the reason can free space before the last retry."""
    scene, pod = training()
    scene.end(pod, 1, last_word(reason="StorageFull: /run: no space left on device"))

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.PENDING, "StorageFull")


def test_the_message_about_a_volume_that_does_not_come_quotes_the_cluster(accepted):
    """Only an event on the pod has the cause, because the pod's status only shows that the pod starts."""
    scene = accepted()
    pod = scene.new_pod()
    words = 'Multi-Attach error for volume "pvc-1": still attached to node-2'
    scene.objects["events"].append(
        {
            "reason": "FailedAttachVolume",
            "message": words,
            "involvedObject": {"uid": pod["metadata"]["uid"]},
            "lastTimestamp": scene.stamp(),
        }
    )
    scene.settle()
    assert scene.replica().reason == "VolumeNotMounted"
    assert words in scene.replica().message

    pod["status"]["conditions"] = [{"type": "PodReadyToStartContainers", "status": "True"}]
    scene.settle()

    assert scene.replica().reason == "Starting"


def test_while_its_simulators_start_a_trainer_does_not_train(training):
    """The trainer itself reports that it still starts. A trainer without a status would count as training."""
    scene, pod = training()
    scene.poll(pod, phase="starting")

    scene.settle()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.RUNNING, "Starting")


@pytest.mark.parametrize("about", [0, None], ids=["of the replica", "of the whole job"])
def test_the_message_about_a_refused_object_quotes_the_api_server(make_scene, about, reasons):
    """If a quota refuses the claim, no Job exists whose events could show the cause."""
    scene = make_scene()
    scene.step()
    scene.denied = {about: 'persistentvolumeclaims "job-0" is forbidden: exceeded quota: volumes'}

    decision = scene.step()
    scene.objects["jobs"].clear()

    assert (scene.replica().phase, scene.replica().reason) == (Phase.PENDING, "PodsRefused")
    assert scene.replica().message.endswith("is forbidden: exceeded quota: volumes")
    assert scene.status.conditions[1].reason == "PodsRefused"
    assert "PodsRefused" in reasons(decision)
    scene.denied = {}
    scene.settle()
    assert scene.replica().reason == "Starting"


def test_a_refusal_of_one_replica_is_not_reported_for_another(make_scene):
    """The quota has enough space for the claim of only one replica."""
    scene = make_scene(replicas=2)
    scene.step()
    scene.denied = {1: "exceeded quota"}

    scene.step()

    assert [each.reason for each in scene.status.replicas] == ["Starting", "PodsRefused"]


def test_an_init_container_that_fails_is_named_with_its_last_line(accepted, command_groups):
    """The trainer never started, so it wrote no termination message."""
    scene = accepted(backoffLimit=0, simulators=command_groups)
    pod = scene.new_pod()
    scene.container(pod, "install-sidecar", code=1, message="cp: one\ncp: no space left on device\n")
    pod["status"]["phase"] = "Failed"
    scene.end_job("Failed", 0, "BackoffLimitExceeded")

    scene.settle()

    assert scene.replica().message.endswith(
        "the last: container install-sidecar: exit code 1, cp: no space left on device"
    )


@pytest.mark.parametrize(("limit", "code"), [(0, 70), (3, 2), (3, 80), (3, 81)])
def test_a_pod_that_was_the_last_is_not_called_tried_again(training, last_word, reasons, limit, code):
    """The limit or the exit code forbids another pod, so the status must not promise a retry."""
    scene, pod = training(backoffLimit=limit)
    scene.end(pod, code, last_word())

    decision = scene.settle()

    assert scene.replica().reason != "Retrying"
    assert "Retrying" not in reasons(decision)


def test_a_replica_on_a_lost_node_does_not_run(training):
    """The kubelet last reported a running pod, but its current state is unknown."""
    scene, pod = training()
    scene.delete(pod, 0)
    scene.settle()

    scene.settle(31)

    assert (scene.replica().reason, scene.status.phase, scene.status.running) == (
        "NodeLost",
        Phase.PENDING,
        "0/1",
    )
    assert scene.status.conditions[1].reason == "NodeLost"


def test_a_pod_that_is_not_there_and_was_not_asked_about_says_so(make_scene):
    """Without this message a user would think that nothing is wrong."""
    scene = make_scene()
    scene.settle()
    scene.objects["unasked"] = frozenset({scene.job()["metadata"]["uid"]})

    scene.settle()

    assert scene.replica().reason == "Starting"
    assert scene.replica().message == (
        "its pod is about to be created; the cause was not looked up, because too many other replicas wait; "
        "`kubectl describe` shows it"
    )
