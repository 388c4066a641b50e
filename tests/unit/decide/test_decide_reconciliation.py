"""kstatus reads the conditions `Reconciling` and `Stalled` for `helm --wait`, Flux and Argo CD."""

from palaestra.api.reasons import Reason
from palaestra.api.status import ConditionStatus, Phase
from palaestra.decide import JobRefused, reject

NO_WORLD = [
    {"name": "collect", "role": "Collect", "world": {"configMap": {"name": "worlds", "key": "hall.wbt"}}},
    {"name": "evaluate", "role": "Evaluate"},
]


def gaps(status):
    """Return reason and message of `Reconciling` and `Stalled`; each of them must be true or absent."""
    found = {each.type.value: each for each in status.conditions[5:]}
    assert all(each.status is ConditionStatus.TRUE for each in found.values())
    return {kind: (each.reason, each.message) for kind, each in found.items()}


def test_a_job_that_trains_is_as_its_spec_asks(training):
    """A job runs for hours, so `helm --wait` returns when it trains, as for a Kubernetes Job."""
    scene, _ = training()

    assert gaps(scene.status) == {}


def test_a_job_that_has_succeeded_is_as_its_spec_asks(training, last_word):
    """The job stays in the Git repository after its end, where it must count as complete."""
    scene, pod = training()
    scene.end(pod, 0, last_word(reason="Completed: the training is complete"))
    scene.end_job("Complete")
    scene.settle()

    assert scene.status.phase is Phase.SUCCEEDED
    assert gaps(scene.status) == {}


def test_a_job_whose_pod_cannot_start_is_on_its_way(accepted):
    """An image is often pushed a moment later, and the kubelet retries the pull by itself."""
    scene = accepted()
    scene.container(scene.new_pod(), "trainer", waiting="ImagePullBackOff: no such image")
    scene.settle()

    assert gaps(scene.status) == {"Reconciling": ("ImagePull", scene.replica().message)}


def test_a_job_that_lacks_a_world_is_stalled_until_the_world_is_there(make_scene):
    """Without `Stalled`, `helm install --wait` returned at once, and the release counted as deployed."""
    scene = make_scene(simulators=NO_WORLD)
    scene.settle()

    assert gaps(scene.status) == {"Stalled": ("WorldMissing", scene.replica().message)}

    world = '#VRML_SIM R2023b utf8\nRobot { name "robotino" controller "ros" }\n'
    opened = {"name": "worlds", "labels": {"palaestra.dev/for-jobs": "true"}}
    scene.there["ConfigMap", "worlds"] = {"metadata": opened, "data": {"hall.wbt": world}}
    scene.settle()

    assert gaps(scene.status).keys() == {"Reconciling"}


def test_a_job_that_failed_is_stalled_with_the_whole_reason(training, last_word):
    """Helm and Flux print only the message of this condition."""
    scene, pod = training()
    scene.end(pod, 81, last_word(reason="Diverged: NaN"))
    scene.end_job("Failed", 0, "PodFailurePolicy")
    scene.settle()

    [failed] = [each for each in scene.status.conditions if each.type.value == "Failed"]
    assert scene.status.phase is Phase.FAILED
    assert gaps(scene.status) == {"Stalled": (failed.reason, failed.message)}


def test_a_job_that_was_refused_is_stalled(make_scene):
    """Nobody can change the spec, so the job can never start."""
    scene = make_scene()

    status = reject(scene.raw, JobRefused(Reason.INVALID_SPEC, "spec.seed: too large"), scene.now).status

    assert status is not None
    assert gaps(status) == {"Stalled": ("InvalidSpec", "spec.seed: too large")}


def test_a_job_that_is_to_be_suspended_is_as_its_spec_asks_once_its_pod_is_gone(training):
    """A release with `suspend: true` must be complete only after the trainer has written its checkpoint."""
    scene, pod = training()
    scene.raw["spec"]["suspend"] = True
    scene.raw["metadata"]["generation"] = 2
    scene.step()

    assert gaps(scene.status).keys() == {"Reconciling"}

    scene.delete(pod)
    scene.settle()

    assert gaps(scene.status)["Reconciling"][0] == "Suspending"

    scene.objects["pods"].clear()
    scene.settle()

    assert scene.status.phase is Phase.SUSPENDED
    assert gaps(scene.status) == {}


def test_a_job_that_waits_in_a_queue_is_on_its_way(make_scene):
    """The author wants a training, and Kueue will admit the job sooner or later."""
    scene = make_scene(scheduling={"queueName": "trainings"})
    scene.kueue = True
    scene.settle()

    assert gaps(scene.status).keys() == {"Reconciling"}
    assert gaps(scene.status)["Reconciling"][0] == "Queued"


def test_a_condition_that_goes_on_keeps_its_time(accepted):
    """Flux shows since when a condition holds, so a reconcile must not reset this time."""
    scene = accepted()
    scene.container(scene.new_pod(), "trainer", waiting="ImagePullBackOff: no such image")
    scene.settle()
    before = scene.status.conditions[5].last_transition_time

    scene.settle(30)

    assert scene.status.conditions[5].last_transition_time == before


def test_a_job_in_a_queue_is_on_its_way_whatever_its_spec_says_of_a_suspension(training):
    """In the default queue of a namespace, `suspend` has no effect: the job starts when Kueue admits it."""
    scene, _ = training(suspend=False)
    scene.raw["spec"]["suspend"] = True
    scene.job()["metadata"]["labels"]["kueue.x-k8s.io/queue-name"] = "default"
    scene.settle()

    why = scene.replica().message
    assert "spec.suspend has no effect" in why
    assert gaps(scene.status) == {"Reconciling": ("Training", why)}

    scene.job()["spec"]["suspend"] = True
    scene.objects["pods"].clear()
    scene.settle()

    assert gaps(scene.status)["Reconciling"][0] == "Queued"


def test_a_job_that_failed_before_the_condition_was_known_gets_it(training, last_word):
    """A failed job without the condition would count as complete for ever."""
    scene, pod = training()
    scene.end(pod, 81, last_word(reason="Diverged: NaN"))
    scene.end_job("Failed", 0, "PodFailurePolicy")
    scene.settle()
    whole = scene.raw["status"]["conditions"]
    scene.raw["status"]["conditions"] = whole[:5]

    scene.settle()

    assert scene.raw["status"]["conditions"] == whole
