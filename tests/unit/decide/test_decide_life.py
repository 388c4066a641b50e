"""The life of a job: its objects in the order of their creation, its status and its events."""

from datetime import UTC, datetime

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide import Create, SetSuspend, Stop, accept, prepare
from palaestra.observe import Objects, Suspended, observe

START = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)


def kinds(decision):
    """Return the kinds of the objects that a decision creates."""
    return [each.object["kind"] for each in decision.actions if isinstance(each, Create)]


def test_nothing_is_created_before_the_status_holds_the_images(make_scene):
    """After any write, an operator of another release may take over and must plan the same objects."""
    scene = make_scene()

    first = scene.step()
    second = scene.step()

    assert first.actions == ()
    assert first.status.release.trainer == "trainer:1"
    assert kinds(second) == ["NetworkPolicy", "ConfigMap", "PersistentVolumeClaim", "Job"]


MUJOCO = [
    {"name": "collect", "role": "Collect", "driver": "mujoco"},
    {"name": "evaluate", "role": "Evaluate"},
]


def test_a_newer_release_plans_mujoco_with_the_image_of_the_old_one(make_scene):
    """A job keeps its simulator for its whole life, so the image of MuJoCo must not change either."""
    scene = make_scene(simulators=MUJOCO)
    scene.step()
    scene.layout = type(scene.layout)(images=type(scene.layout.images).of_release("2"))

    scene.step()

    _, collect, _ = scene.job()["spec"]["template"]["spec"]["initContainers"]
    assert collect["image"] == "mujoco:1"


def test_a_newer_release_plans_with_the_images_of_the_old_one(make_scene):
    """A job keeps the images that the status got when the operator accepted the job."""
    scene = make_scene(replicas=2)
    scene.step()
    scene.layout = type(scene.layout)(images=type(scene.layout.images).of_release("2"))

    scene.step()

    containers = scene.job(1)["spec"]["template"]["spec"]["containers"]
    assert [each["image"] for each in containers] == ["trainer:1"]


def test_a_newer_release_leaves_what_is_there_alone(training):
    """The running pods mount the old ConfigMaps, even if the new release would choose other names."""
    scene, _ = training()
    scene.layout = type(scene.layout)(images=type(scene.layout.images).of_release("2"))
    scene.objects["config_maps"][0]["metadata"]["name"] = "named-by-an-older-release"
    volume = scene.job()["spec"]["template"]["spec"]["volumes"][0]
    volume["configMap"]["name"] = "named-by-an-older-release"

    assert scene.step().actions == ()


def test_a_config_map_that_somebody_deleted_is_made_again(training):
    """The next pod of the Job needs the ConfigMap to start."""
    scene, _ = training()
    scene.objects["config_maps"].clear()

    assert kinds(scene.step()) == ["ConfigMap"]


def test_only_a_replica_that_lacks_an_object_is_planned(accepted):
    """To plan complete replicas again would delay the reconciles of other jobs."""
    scene = accepted(replicas=3)
    scene.objects["config_maps"].pop(1)
    job = accept(scene.raw)

    prepared = prepare(job, observe(job, Objects(**scene.objects)), scene.layout)

    assert prepared.plan.replicas.keys() == {1}


def test_a_job_that_trains_says_so(training):
    """Users read the phase and the columns, and programs read the conditions. All of them must agree."""
    scene, _ = training()

    held = {each.type.value: each.status.value for each in scene.status.conditions}
    assert (scene.status.phase, scene.status.running) == (Phase.RUNNING, "1/1")
    assert held == {
        "Accepted": "True", "Running": "True", "Suspended": "False", "Succeeded": "False", "Failed": "False",
    }  # fmt: skip
    assert scene.replica().attempt == 1


def test_a_job_succeeds_when_all_its_replicas_have(accepted, last_word):
    """One successful replica does not complete the job.

    At the end, the status has the values that the trainers reported last.
    """
    scene = accepted(replicas=2)
    pods = [scene.running_pod(index) for index in (0, 1)]
    scene.settle()
    for index, pod in enumerate(pods):
        scene.end(pod, 0, last_word(step=100, success_rate=0.9 - index / 10))
        scene.end_job("Complete", index)

    decision = scene.settle(60)

    assert (scene.status.phase, scene.status.running) == (Phase.SUCCEEDED, "2/2")
    assert (scene.status.step, scene.status.success_rate) == (100, 0.8)
    assert scene.status.completion_time == scene.now
    assert Reason.SUCCEEDED in [each.reason for each in decision.events]


def test_the_last_word_is_waited_for(training, last_word):
    """The operator may see the Job's end before its pod's end.

    Only the pod has the last values of the trainer.
    """
    scene, pod = training()
    scene.end_job("Complete")
    decision = scene.step(1)
    assert scene.status.phase is Phase.RUNNING
    assert decision.wake_after_s == 30

    scene.end(pod, 0, last_word(step=7))
    scene.step(1)

    assert (scene.status.phase, scene.replica().step) == (Phase.SUCCEEDED, 7)


def test_the_last_word_is_not_waited_for_for_ever(training):
    """The pod may be deleted, or it may stay on a lost node and never report its end."""
    scene, _ = training()
    scene.end_job("Complete")
    scene.step()

    scene.step(30)

    assert scene.status.phase is Phase.SUCCEEDED


def test_a_replica_that_failed_does_not_stop_the_others(accepted):
    """The replicas are independent trainings."""
    scene = accepted(replicas=2)
    pods = [scene.running_pod(index) for index in (0, 1)]
    scene.settle()
    scene.end(pods[0], 81, "NaN")
    scene.end_job("Failed", 0, "PodFailurePolicy")

    decision = scene.settle()

    assert (scene.status.phase, scene.status.running) == (Phase.RUNNING, "1/2")
    assert scene.replica(0).phase is Phase.FAILED
    assert not [each for each in decision.actions if isinstance(each, Stop)]


def test_a_job_with_a_failed_replica_fails_when_the_last_has_ended(accepted, last_word):
    """The other replicas may still succeed.

    At the end, the message has the number of failed replicas and the reason of the first one.
    """
    scene = accepted(replicas=2)
    pods = [scene.running_pod(index) for index in (0, 1)]
    scene.end(pods[0], 81, last_word(reason="Diverged: NaN"))
    scene.end_job("Failed", 0, "PodFailurePolicy")
    scene.end(pods[1], 0, last_word(step=100))
    scene.end_job("Complete", 1)

    scene.settle()

    failed = scene.status.conditions[-1]
    assert (scene.status.phase, failed.reason) == (Phase.FAILED, Reason.SOME_REPLICAS_FAILED)
    assert failed.message.startswith("1 of 2 replicas failed; the first: replica 0, Diverged: ")


def test_a_replica_that_has_ended_is_never_planned_again(training, last_word):
    """If a person or a cleanup deletes the Job of a finished replica, the replica must not train again."""
    scene, pod = training(replicas=1)
    scene.end(pod, 0, last_word(step=100))
    scene.end_job("Complete")
    scene.settle()
    for objects in scene.objects.values():
        objects.clear()

    assert scene.settle().actions == ()
    assert scene.status.phase is Phase.SUCCEEDED


def test_a_job_that_somebody_deleted_is_made_again_once_its_pods_are_gone(training):
    """Two pods of one replica would write to one volume."""
    scene, _ = training()
    scene.objects["jobs"].clear()
    assert kinds(scene.step()) == []
    assert scene.replica().message == "waits for pod job-0-0 to end"

    scene.objects["pods"].clear()

    assert kinds(scene.settle()) == ["Job"]


def test_suspending_is_one_patch_of_each_job_that_goes_on(training):
    """One patch of the Job is enough, because Kubernetes then deletes the pods.

    The job's active time must stop.
    """
    scene, _ = training()
    scene.raw["spec"]["suspend"] = True

    decision = scene.step(60)
    scene.objects["pods"].clear()
    scene.settle()

    mark = Suspended(pod="pod-0", lived=True)
    assert decision.actions == (SetSuspend(job="job-0", replica=0, suspend=True, mark=mark),)
    assert (scene.status.phase, scene.replica().reason) == (Phase.SUSPENDED, "Suspended")
    assert (scene.status.active_seconds, scene.status.active_since) == (60, None)


def test_resuming_goes_on_and_counts_on(training):
    """The next pod counts as a restart by suspension, not as a disruption."""
    scene, _ = training()
    scene.raw["spec"]["suspend"] = True
    scene.settle(60)
    scene.objects["pods"].clear()
    scene.settle()
    scene.settle(600)
    scene.raw["spec"]["suspend"] = False

    decision = scene.step()
    scene.job()["status"] = {
        "conditions": [{"type": "Suspended", "status": "False", "lastTransitionTime": scene.stamp()}]
    }
    scene.pass_(1)
    scene.running_pod()
    scene.settle()

    assert decision.actions == (SetSuspend(job="job-0", replica=0, suspend=False),)
    assert (scene.status.phase, scene.replica().attempt) == (Phase.RUNNING, 2)
    assert (scene.replica().restarts.suspension, scene.replica().restarts.disruption) == (1, 0)
    assert scene.status.active_seconds == 60


def test_a_job_that_is_born_suspended_is_planned_suspended(accepted):
    """A user can inspect the objects of the job, but no pod runs."""
    scene = accepted(suspend=True)

    assert scene.job()["spec"]["suspend"] is True
    assert scene.status.phase is Phase.SUSPENDED
    assert scene.settle().actions == ()


def test_with_a_queue_suspension_is_left_to_kueue(make_scene):
    """Kueue suspends and resumes the Job, and the operator must not write `suspend`."""
    scene = make_scene(scheduling={"queueName": "robots"})
    scene.kueue = True
    scene.settle()
    assert (scene.status.phase, scene.replica().reason) == (Phase.SUSPENDED, "Queued")
    assert scene.replica().message == "waits in queue robots for Kueue"

    scene.job()["spec"]["suspend"] = False

    assert scene.settle().actions == ()
    assert scene.status.phase is Phase.PENDING


def test_a_queue_that_kueue_gave_a_job_is_heeded_too(accepted):
    """Kueue may add the default queue of a namespace to a Job.

    If the operator resumed such a Job, Kueue would suspend it again without end.
    """
    scene = accepted()
    scene.job()["metadata"]["labels"]["kueue.x-k8s.io/queue-name"] = "default"
    scene.job()["spec"]["suspend"] = True

    assert scene.settle().actions == ()
    assert scene.replica().message == "waits in queue default for Kueue"


def test_a_suspension_that_kueue_ignores_is_reported(training):
    """In a queue only Kueue suspends a Job, even in the default queue of the namespace."""
    scene, _ = training()
    scene.job()["metadata"]["labels"]["kueue.x-k8s.io/queue-name"] = "default"
    scene.raw["spec"]["suspend"] = True

    assert scene.settle().actions == ()
    assert scene.replica().message == (
        "attempt 1 trains; spec.suspend has no effect, because queue default starts and stops it"
    )


def test_a_job_is_deleted_when_its_time_to_live_is_over(training, last_word):
    """The operator schedules a reconcile for that time, because an ended job no longer changes."""
    scene, pod = training(ttlSecondsAfterFinished=60)
    scene.end(pod, 0, last_word(step=100))
    scene.end_job("Complete")
    assert scene.step().wake_after_s == 60
    assert not scene.deleted

    scene.step(60)

    assert scene.deleted


def test_the_time_to_live_may_be_given_after_the_end(training, last_word):
    """A user may set this field of an ended job, and its status must then have the new generation."""
    scene, pod = training()
    scene.end(pod, 0, last_word(step=100))
    scene.end_job("Complete")
    scene.settle(5)
    scene.raw["spec"]["ttlSecondsAfterFinished"] = 0
    scene.raw["metadata"]["generation"] = 2

    scene.step(5)

    assert scene.deleted
    assert scene.status.observed_generation == 2


def test_a_pod_that_only_says_to_be_the_replicas_is_waited_for(accepted, last_word):
    """The pod has the labels of the replica, but not its owner.

    The pod may write to the volume, so the operator waits for its end. It must not trust the pod's report.
    """
    scene = accepted()
    pod = scene.running_pod()
    scene.end(pod, 0, last_word(step=9, success_rate=1.0))
    pod["status"]["phase"] = "Running"
    pod["metadata"]["ownerReferences"] = []
    scene.objects["jobs"].clear()

    decision = scene.settle()

    assert kinds(decision) == []
    assert (scene.replica().attempt, scene.replica().step) == (0, None)
    assert scene.replica().message == "waits for pod job-0-0 to end"
    scene.objects["pods"].clear()
    assert "Job" in kinds(scene.settle())
