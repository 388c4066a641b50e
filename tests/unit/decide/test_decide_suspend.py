"""The operator's reaction when another user or program suspends or resumes one of its Jobs."""

from copy import deepcopy

import pytest

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide import SetSuspend, as_data
from palaestra.decide.suspend import BY_SPEC
from palaestra.observe import Suspended

SUSPEND_SET = "palaestra.dev/suspend-set"
SUSPENDED = "palaestra.dev/suspended"


def by_kueue(scene, *, suspend):
    """Let Kueue suspend or resume the Job, and let the operator see Kueue as the field's manager."""
    scene.job()["spec"]["suspend"] = suspend
    scene.switchers[scene.job()["metadata"]["uid"]] = "kueue"


def without_annotation(scene):
    """Remove the annotation of the Job as another program may, and reconcile."""
    scene.job()["metadata"].pop("annotations", None)
    scene.settle()


def test_a_job_that_somebody_else_suspends_is_left_suspended(training):
    """Kueue with `manageJobsWithoutQueueName` suspends a resumed Job again.

    This caused 22 patches a second.
    """
    scene, _ = training()
    by_kueue(scene, suspend=True)
    scene.objects["pods"].clear()

    assert scene.settle().actions == ()
    assert (scene.status.phase, scene.replica().reason) == (Phase.SUSPENDED, "Suspended")
    assert scene.replica().message == (
        "suspended by kueue, not by spec.suspend; the replica continues when Job job-0 is resumed"
    )


def test_a_suspension_by_another_manager_emits_an_event(training, reasons):
    """Without the event a user would wait for the job and not know why it does not run."""
    scene, _ = training()
    by_kueue(scene, suspend=True)
    scene.objects["pods"].clear()

    assert Reason.SUSPENDED in reasons(scene.settle())


def test_a_suspension_by_an_unknown_manager_is_reported_as_such(training):
    """The API server need not record the manager of a field."""
    scene, _ = training()
    scene.job()["spec"]["suspend"] = True
    scene.objects["pods"].clear()

    scene.settle()

    assert scene.replica().message.startswith("suspended by somebody else, ")


def test_a_job_that_another_manager_resumes_is_left_running_and_reported(training):
    """A queue has admitted the Job although its author suspended the TrainingJob."""
    scene, _ = training(suspend=False)
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    by_kueue(scene, suspend=False)

    assert scene.settle().actions == ()
    assert scene.replica().message == "attempt 1 trains; resumed by kueue although spec.suspend is true"


@pytest.mark.parametrize("suspended", [True, False])
def test_the_author_is_heeded_whatever_somebody_else_has_set(suspended, training):
    """The operator writes `suspend` when the author's value differs from the last value that it wrote."""
    scene, _ = training()
    by_kueue(scene, suspend=suspended)
    scene.settle()
    scene.raw["spec"]["suspend"] = True

    [action] = scene.step().actions

    assert isinstance(action, SetSuspend)
    assert action.suspend is True
    assert scene.job()["metadata"]["annotations"][SUSPEND_SET] == "true"
    assert scene.settle().actions == ()


def test_what_was_set_is_written_by_the_same_patch():
    """With two patches, an operator killed in between would take its own change for another manager's."""
    mark = Suspended(pod="pod-0", lived=True)

    patch = SetSuspend(job="job-0", replica=0, suspend=True, mark=mark).patch

    annotations = {SUSPEND_SET: "true", SUSPENDED: "pod-0 lived"}
    assert patch == {"metadata": {"annotations": annotations}, "spec": {"suspend": True}}


def test_a_job_without_its_annotation_is_made_as_its_spec_asks_once(training):
    """Without the annotation the operator does not know its last value.

    It then writes the value of the spec once.
    """
    scene, _ = training()
    without_annotation(scene)
    by_kueue(scene, suspend=True)
    scene.objects["pods"].clear()

    assert scene.step().actions == (SetSuspend(job="job-0", replica=0, suspend=False),)

    by_kueue(scene, suspend=True)

    assert scene.settle().actions == ()
    assert scene.replica().message.startswith("suspended by kueue, ")


def test_the_author_suspends_and_resumes_a_job_without_its_annotation(training):
    """The first write of the operator adds the annotation again."""
    scene, _ = training()
    without_annotation(scene)
    scene.raw["spec"]["suspend"] = True
    scene.raw["metadata"]["generation"] = 2

    suspended = scene.settle().actions
    scene.raw["spec"]["suspend"] = False
    scene.raw["metadata"]["generation"] = 3
    resumed = scene.settle().actions

    assert [each.suspend for each in (*suspended, *resumed)] == [True, False]


WORLD = '#VRML_SIM R2023b utf8\nRobot { name "robotino" controller "ros" }\n'
GROUPS = [{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}]
SECRET = {"env": [{"name": "TOKEN", "secretKeyRef": {"name": "keys", "key": "token"}}]}
THERE = {
    ("Secret", "keys"): {"metadata": {"name": "keys"}},
    ("PersistentVolumeClaim", "runs"): {"metadata": {"name": "runs"}},
    ("ConfigMap", "worlds"): {"metadata": {"name": "worlds"}, "data": {"hall.wbt": WORLD}},
}
USES = [
    pytest.param("Secret", "keys", {"trainer": SECRET}, id="a Secret"),
    pytest.param("Secret", "keys", {"imagePullSecrets": [{"name": "keys"}]}, id="a pull Secret"),
    pytest.param("PersistentVolumeClaim", "runs", {"storage": {"existingClaim": "runs"}}, id="a claim"),
    pytest.param(
        "ConfigMap",
        "worlds",
        {
            "simulators": [
                {**GROUPS[0], "world": {"configMap": {"name": "worlds", "key": "hall.wbt"}}},
                GROUPS[1],
            ]
        },
        id="a world",
    ),
]


def open_to_jobs(kind, name, labels=None):
    """Return an object that jobs may use, or the same object with other labels."""
    found = deepcopy(THERE[(kind, name)])
    found["metadata"]["labels"] = {"palaestra.dev/for-jobs": "true"} if labels is None else labels
    return found


def to_be_resumed(make_scene, kind, name, spec):
    """Return a scene in which a suspended job is about to be resumed and needs the given object."""
    scene = make_scene(**spec)
    scene.there[(kind, name)] = open_to_jobs(kind, name)
    scene.settle()
    scene.raw["spec"]["suspend"] = True
    scene.raw["metadata"]["generation"] = 2
    scene.settle()
    scene.raw["spec"]["suspend"] = False
    scene.raw["metadata"]["generation"] = 3
    return scene


@pytest.mark.parametrize("annotated", [True, False])
@pytest.mark.parametrize(("kind", "name", "spec"), USES)
def test_a_job_is_not_resumed_with_what_is_for_jobs_no_more(make_scene, annotated, kind, name, spec):
    """An administrator removed the label, so no new pod may use the object.

    A resumed job creates a new pod.
    """
    scene = to_be_resumed(make_scene, kind, name, spec)
    scene.there[(kind, name)] = open_to_jobs(kind, name, {})
    if not annotated:
        without_annotation(scene)

    held = scene.settle()
    stood = scene.status
    scene.settle()
    scene.there[(kind, name)] = open_to_jobs(kind, name)
    freed = scene.step()

    word = {"PersistentVolumeClaim": "Claim"}.get(kind, kind)
    assert held.actions == ()
    assert (stood.phase, stood.replicas[0].reason) == (Phase.SUSPENDED, f"{word}NotForJobs")
    assert (stood.active_since, stood.conditions[0].status) == (None, "True")
    assert freed.actions == (SetSuspend(job="job-0", replica=0, suspend=False),)


@pytest.mark.parametrize(("kind", "name", "spec"), USES)
def test_only_a_world_may_be_gone_when_a_job_is_resumed(make_scene, kind, name, spec):
    """The job's own ConfigMap has a copy of the world, but pods cannot start without a Secret or a claim."""
    scene = to_be_resumed(make_scene, kind, name, spec)
    scene.there.clear()

    decision = scene.settle()

    assert bool(decision.actions) is (kind == "ConfigMap")


def test_suspending_asks_for_no_label(make_scene):
    """A user must always be able to suspend a job, even if the label of an object is missing."""
    scene = to_be_resumed(make_scene, "Secret", "keys", {"trainer": SECRET})
    scene.settle()
    scene.there.clear()
    scene.raw["spec"]["suspend"] = True

    assert scene.settle().actions == (SetSuspend(job="job-0", replica=0, suspend=True),)


@pytest.mark.parametrize("annotated", [True, False])
def test_a_refused_patch_of_a_job_is_sent_again(training, annotated):
    """The API server may refuse the patch after the status is written, so the operator must retry it."""
    scene, _ = training()
    if not annotated:
        without_annotation(scene)
    scene.raw["spec"]["suspend"] = True
    scene.raw["metadata"]["generation"] = 2

    scene.raw["status"] = as_data(scene.decide().status)  # the status was written, the patch was refused
    again = scene.settle()

    assert [each.suspend for each in again.actions] == [True]
    assert scene.status.observed_generation == 2


def test_a_job_is_suspended_once_its_pod_has_ended(training):
    """The trainer saves a checkpoint for up to a minute.

    A person who reads `Suspended` too early and stops the node would lose this checkpoint.
    """
    scene, pod = training()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    scene.delete(pod)
    scene.settle(5)

    assert (scene.status.phase, scene.replica().reason) == (Phase.PENDING, "Suspending")
    assert (
        scene.replica().message
        == f"pod {pod['metadata']['name']} saves a checkpoint and ends; suspended by {BY_SPEC}"
    )

    scene.objects["pods"].clear()
    scene.settle(5)

    assert (scene.status.phase, scene.replica().reason) == (Phase.SUSPENDED, "Suspended")


def test_a_job_that_is_resumed_before_its_pod_has_ended_does_not_run(training, last_word):
    """`kubectl wait --for=condition=Running` must not return for a pod that is about to end."""
    scene, pod = training()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    scene.delete(pod)
    scene.raw["spec"]["suspend"] = False
    events = [*scene.settle(1).events]

    assert (scene.status.phase, scene.replica().reason) == (Phase.PENDING, "Suspending")

    scene.end(pod, 75, last_word())
    events += scene.settle(1).events
    scene.objects["pods"].clear()
    scene.pass_(1)
    scene.running_pod()
    events += scene.settle().events

    assert scene.status.phase is Phase.RUNNING
    assert scene.replica().last_attempt.reason == "Suspended"
    assert Reason.DISRUPTED not in {each.reason for each in events}
    assert (scene.replica().restarts.suspension, scene.replica().restarts.disruption) == (1, 0)


def test_a_suspended_pod_on_a_lost_node_is_reported_as_lost(training):
    """The trainer on this node cannot save.

    Before the job can be resumed, somebody must delete the Node object.
    """
    scene, pod = training()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    scene.delete(pod)
    scene.settle(1)
    scene.settle(600)

    assert scene.replica().reason == "NodeLost"
