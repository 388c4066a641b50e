"""The operator's reaction when somebody else suspends or resumes one of its Jobs."""

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
    """Let Kueue suspend or resume the Job, and the operator find out that it was Kueue."""
    scene.job()["spec"]["suspend"] = suspend
    scene.switchers[scene.job()["metadata"]["uid"]] = "kueue"


def without_annotation(scene):
    """Let somebody remove the annotation of the Job, and its status be written."""
    scene.job()["metadata"].pop("annotations", None)
    scene.settle()


def test_a_job_that_somebody_else_suspends_is_left_suspended(training):
    """Kueue with manageJobsWithoutQueueName suspends it again at once, which made 22 patches a second."""
    scene, _ = training()
    by_kueue(scene, suspend=True)
    scene.objects["pods"].clear()

    assert scene.settle().actions == ()
    assert (scene.status.phase, scene.replica().reason) == (Phase.SUSPENDED, "Suspended")
    assert scene.replica().message == (
        "suspended by kueue, not by spec.suspend; it continues when Job job-0 is resumed"
    )


def test_a_suspension_by_another_manager_emits_an_event(training, reasons):
    """Otherwise a user would wait for the job and not know the reason."""
    scene, _ = training()
    by_kueue(scene, suspend=True)
    scene.objects["pods"].clear()

    assert Reason.SUSPENDED in reasons(scene.settle())


def test_a_suspension_by_an_unknown_manager_is_reported_as_such(training):
    """An API server need not record the manager of a field."""
    scene, _ = training()
    scene.job()["spec"]["suspend"] = True
    scene.objects["pods"].clear()

    scene.settle()

    assert scene.replica().message.startswith("suspended by somebody else, ")


def test_a_job_that_another_manager_resumes_is_left_running_and_reported(training):
    """Its queue has admitted it, although its author has suspended it."""
    scene, _ = training(suspend=False)
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    by_kueue(scene, suspend=False)

    assert scene.settle().actions == ()
    assert scene.replica().message == "attempt 1 trains; resumed by kueue although spec.suspend is true"


@pytest.mark.parametrize("suspended", [True, False])
def test_the_author_is_heeded_whatever_somebody_else_has_set(suspended, training):
    """The operator writes the value of the TrainingJob when it differs from the value that it wrote last."""
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
    """An operator that is killed between two patches would take its own change for somebody else's."""
    mark = Suspended(pod="pod-0", lived=True)

    patch = SetSuspend(job="job-0", replica=0, suspend=True, mark=mark).patch

    annotations = {SUSPEND_SET: "true", SUSPENDED: "pod-0 lived"}
    assert patch == {"metadata": {"annotations": annotations}, "spec": {"suspend": True}}


def test_a_job_without_its_annotation_is_made_as_its_spec_asks_once(training):
    """Nobody knows any more what the operator set last; from then on the annotation is there again."""
    scene, _ = training()
    without_annotation(scene)
    by_kueue(scene, suspend=True)
    scene.objects["pods"].clear()

    assert scene.step().actions == (SetSuspend(job="job-0", replica=0, suspend=False),)

    by_kueue(scene, suspend=True)

    assert scene.settle().actions == ()
    assert scene.replica().message.startswith("suspended by kueue, ")


def test_the_author_suspends_and_resumes_a_job_without_its_annotation(training):
    """From then on it has the annotation."""
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
    """Return an object that a job may use, unless it is given other labels."""
    found = deepcopy(THERE[(kind, name)])
    found["metadata"]["labels"] = {"palaestra.dev/for-jobs": "true"} if labels is None else labels
    return found


def to_be_resumed(make_scene, kind, name, spec):
    """Return a scene in which a suspended job that uses an object is about to be resumed."""
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
    """A removed label applies to new pods, and the next pod of the job is new."""
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
    """The job's own ConfigMap has a copy of a world; without a Secret or a claim, pods would not start."""
    scene = to_be_resumed(make_scene, kind, name, spec)
    scene.there.clear()

    decision = scene.settle()

    assert bool(decision.actions) is (kind == "ConfigMap")


def test_suspending_asks_for_no_label(make_scene):
    """Stopping is always allowed."""
    scene = to_be_resumed(make_scene, "Secret", "keys", {"trainer": SECRET})
    scene.settle()
    scene.there.clear()
    scene.raw["spec"]["suspend"] = True

    assert scene.settle().actions == (SetSuspend(job="job-0", replica=0, suspend=True),)


@pytest.mark.parametrize("annotated", [True, False])
def test_a_refused_patch_of_a_job_is_sent_again(training, annotated):
    """The status that is written after the refusal must not make it look like somebody else's doing."""
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
    """Its trainer saves a checkpoint for up to a minute.

    A person who stops the node before that would lose it.
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
    """`kubectl wait --for=condition=Running` would return for a pod that is about to end."""
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
    """Its trainer can save nothing; somebody must delete the Node object before the job can be resumed."""
    scene, pod = training()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    scene.delete(pod)
    scene.settle(1)
    scene.settle(600)

    assert scene.replica().reason == "NodeLost"
