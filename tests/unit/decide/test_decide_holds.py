"""A hold keeps a job from starting and has a reason; when a person removes the cause, the job starts."""

import re
from dataclasses import replace

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Create
from palaestra.plan import Allowed
from tests.e2e.pod_metadata import METADATA

INITIAL = {"initialPolicy": {"claim": "runs", "path": "a/model.zip"}}
OPEN = {"palaestra.dev/for-jobs": "true"}
GROUPS = [{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}]
WORLD = [{**GROUPS[0], "world": {"configMap": {"name": "worlds", "key": "hall.wbt"}}}, GROUPS[1]]
SECRET = {"env": [{"name": "TOKEN", "secretKeyRef": {"name": "keys", "key": "token"}}]}


def config_map(data=None, labels=None):
    """Return a ConfigMap."""
    return {"metadata": {"name": "worlds", "labels": OPEN if labels is None else labels}, "data": data or {}}


def held(scene):
    """Require that the condition Accepted is False, and return its reason and its message."""
    accepted = scene.status.conditions[0]
    assert (accepted.type.value, accepted.status.value) == ("Accepted", "False")
    return accepted.reason, accepted.message


@pytest.mark.parametrize(
    ("spec", "there", "reason", "message"),
    [
        pytest.param(
            {"simulators": WORLD},
            {},
            "WorldMissing",
            "spec.simulators[0].world.configMap: ConfigMap worlds does not exist in this namespace; "
            'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
            id="no ConfigMap",
        ),
        pytest.param(
            {"simulators": WORLD},
            {("ConfigMap", "worlds"): config_map({"other.wbt": ""})},
            "WorldMissing",
            "spec.simulators[0].world.configMap.key: ConfigMap worlds has no key hall.wbt; "
            "add it and the job starts",
            id="no such key",
        ),
        pytest.param(
            {"simulators": WORLD},
            {("ConfigMap", "worlds"): config_map({"hall.wbt": ""}, {"palaestra.dev/for-jobs": "yes"})},
            "ConfigMapNotForJobs",
            "spec.simulators[0].world.configMap: ConfigMap worlds is not for jobs; "
            'label it palaestra.dev/for-jobs: "true"',
            id="a ConfigMap of somebody else",
        ),
        pytest.param(
            {"trainer": SECRET},
            {},
            "SecretMissing",
            "spec.trainer.env[0].secretKeyRef: Secret keys does not exist in this namespace; "
            'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
            id="no Secret",
        ),
        pytest.param(
            {"simulators": [{**GROUPS[0], **SECRET}, GROUPS[1]]},
            {("Secret", "keys"): {"metadata": {"name": "keys"}}},
            "SecretNotForJobs",
            "spec.simulators[0].env[0].secretKeyRef: Secret keys is not for jobs, or the operator has no "
            'permission to read its labels; label it palaestra.dev/for-jobs: "true" and bind the role '
            "palaestra-job-secrets in this namespace",
            id="a Secret of somebody else",
        ),
        pytest.param(
            {"imagePullSecrets": [{"name": "keys"}]},
            {("Secret", "keys"): {"metadata": {"name": "keys"}}},
            "SecretNotForJobs",
            "spec.imagePullSecrets[0]: Secret keys is not for jobs, or the operator has no "
            'permission to read its labels; label it palaestra.dev/for-jobs: "true" and bind the role '
            "palaestra-job-secrets in this namespace",
            id="a pull Secret of somebody else",
        ),
        pytest.param(
            {"storage": {"existingClaim": "runs"}},
            {},
            "ClaimMissing",
            "spec.storage.existingClaim: PersistentVolumeClaim runs does not exist in this namespace; "
            'create it with the label palaestra.dev/for-jobs: "true" and the job starts',
            id="no claim",
        ),
        pytest.param(
            {"storage": {"existingClaim": "runs"}},
            {("PersistentVolumeClaim", "runs"): {"metadata": {"labels": {}}}},
            "ClaimNotForJobs",
            "spec.storage.existingClaim: PersistentVolumeClaim runs is not for jobs; "
            'label it palaestra.dev/for-jobs: "true"',
            id="a claim of somebody else",
        ),
        pytest.param(
            {"trainer": {"initialPolicy": {"claim": "policies", "path": "a/model.zip"}}},
            {("PersistentVolumeClaim", "policies"): {"metadata": {"labels": {}}}},
            "ClaimNotForJobs",
            "spec.trainer.initialPolicy.claim: PersistentVolumeClaim policies is not for jobs; "
            'label it palaestra.dev/for-jobs: "true"',
            id="a policy without the label",
        ),
        pytest.param(
            {"scheduling": {"queueName": "robots"}},
            {},
            "NoKueue",
            "spec.scheduling.queueName: this cluster has no Kueue; install it, "
            "or create a job without a queue",
            id="a queue without Kueue",
        ),
    ],
)
def test_a_job_is_held_with_a_reason_and_creates_nothing(make_scene, spec, there, reason, message):
    """The author can remove the cause, so the job waits.

    The message has the field, the fact and the remedy.
    """
    scene = make_scene(**spec)
    scene.there = there

    decision = scene.settle()

    assert held(scene) == (reason, message)
    assert decision.actions == ()
    assert [(each.reason, each.message) for each in decision.events if each.replica is None] == [
        (reason, message)
    ]
    assert scene.status.phase is Phase.PENDING
    elsewhere = {each.message for each in scene.status.conditions[1:5]}
    assert elsewhere == {"the job is Pending; see the condition Accepted"}
    [stalled] = scene.status.conditions[5:]
    assert (stalled.type, stalled.reason, stalled.message) == ("Stalled", reason, message)


WEBOTS = [{"name": "own", "role": "Collect"}, {"name": "wild", "role": "Evaluate", "driver": "webots"}]


def test_a_job_with_webots_needs_an_image_of_it(make_scene):
    """Palaestra publishes no image of Webots.

    Otherwise the pods would wait for an image that no registry has.
    """
    scene = make_scene(simulators=WEBOTS)
    scene.layout = replace(scene.layout, has_webots_image=False)

    decision = scene.settle()

    message = (
        "spec.simulators[1].image: is missing, and the chart's value images.webots.repository is empty; set "
        "one of them"
    )
    assert held(scene) == ("NoImage", message)
    assert decision.actions == ()


@pytest.mark.parametrize("own", [True, False], ids=["of the job", "of the installation"])
def test_a_job_with_an_image_of_webots_is_planned(make_scene, own):
    """The job or the installation may name the image."""
    scene = make_scene(simulators=[WEBOTS[0], WEBOTS[1] | ({"image": "webots:1"} if own else {})])
    scene.layout = replace(scene.layout, has_webots_image=not own)

    scene.settle()

    assert scene.status.conditions[0].status.value == "True"


def test_an_accepted_job_keeps_its_image_of_webots(make_scene):
    """An administrator may remove the chart's value while jobs run."""
    scene = make_scene(simulators=WEBOTS)
    scene.settle()
    scene.layout = replace(scene.layout, has_webots_image=False)

    scene.settle()

    assert scene.status.conditions[0].status.value == "True"


@pytest.mark.parametrize(
    ("spec", "kind", "name"),
    [
        ({"simulators": WORLD}, "ConfigMap", "worlds"),
        ({"trainer": SECRET}, "Secret", "keys"),
        ({"imagePullSecrets": [{"name": "keys"}]}, "Secret", "keys"),
        ({"storage": {"existingClaim": "runs"}}, "PersistentVolumeClaim", "runs"),
        ({"trainer": INITIAL}, "PersistentVolumeClaim", "runs"),
    ],
)
def test_what_is_made_as_the_message_of_the_missing_one_says_is_not_refused_next(
    make_scene, spec, kind, name
):
    """A person who creates the object as the message asks must not get a second message about a label."""
    scene = make_scene(**spec)
    scene.settle()
    label = re.search(r'with the label (\S+): "(\S+)"', held(scene)[1])

    made = {"metadata": {"name": name, "labels": dict([label.groups()])}, "data": {"hall.wbt": WORLD_TEXT}}
    scene.there[(kind, name)] = made
    scene.settle()

    assert scene.status.conditions[0].status == "True"


def test_a_job_starts_when_its_world_appears(make_scene):
    """Nobody has to change or restart the job."""
    scene = make_scene(simulators=WORLD)
    scene.settle()

    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    decision = scene.settle()

    assert scene.status.conditions[0].status == "True"
    assert [each.object["kind"] for each in decision.actions if isinstance(each, Create)][-1] == "Job"


WORLD_TEXT = """#VRML_SIM R2023b utf8
WorldInfo { }
Robot { name "one" supervisor TRUE controller "ros" }
"""


def test_a_world_that_is_none_can_be_mended_in_its_config_map(make_scene):
    """The operator reads the ConfigMap again until it accepts the job."""
    scene = make_scene(simulators=WORLD)
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": "no world"})
    scene.settle()
    assert held(scene)[0] == "WorldInvalid"

    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    scene.settle()

    assert scene.status.conditions[0].status == "True"


def test_what_nobody_can_mend_fails_at_once(make_scene):
    """The world is in the spec, which nobody can change."""
    scene = make_scene(simulators=[{**GROUPS[0], "world": {"inline": "no world"}}, GROUPS[1]])

    decision = scene.settle()

    assert scene.status.phase is Phase.FAILED
    assert held(scene)[0] == "WorldInvalid"
    assert scene.status.conditions[-1].message.startswith("spec.simulators[0].world.inline:")
    assert decision.actions == ()


def test_a_password_in_the_spec_fails_at_once_and_is_not_repeated(make_scene):
    """Every user who may read TrainingJobs can see the password, so it is already compromised."""
    option = {"name": "my:Tracker", "options": {"uri": "http://me:secret@tracking.example.com"}}
    scene = make_scene(trainer={"algorithm": {"callbacks": [option]}})

    decision = scene.settle()

    assert (scene.status.phase, decision.actions) == (Phase.FAILED, ())
    reason, message = held(scene)
    assert reason == "InvalidSpec"
    assert message == (
        "spec.trainer.algorithm.callbacks[0].options: contains a password in an address; "
        "pass it in an environment variable with secretKeyRef"
    )


def test_a_world_that_goes_away_later_does_not_matter_to_a_running_job(make_scene):
    """The job's own ConfigMap has a copy of the world."""
    scene = make_scene(simulators=WORLD)
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    scene.settle()
    scene.running_pod()
    scene.settle()

    scene.there.clear()
    decision = scene.settle()

    assert (scene.status.phase, decision.actions, decision.events) == (Phase.RUNNING, (), ())


def test_a_label_that_was_taken_away_keeps_a_new_pod_from_it(make_scene):
    """A new pod must not use the object, so the replica without a Job is held.

    The other replica runs and continues.
    """
    scene = make_scene(simulators=WORLD, replicas=2)
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    scene.settle()
    scene.running_pod(0)
    scene.objects["jobs"].pop()
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT}, {})

    decision = scene.settle()

    assert decision.actions == ()
    assert (scene.replica(0).phase, scene.replica(1).reason) == (Phase.RUNNING, "ConfigMapNotForJobs")
    assert scene.status.conditions[0].status == "True"


@pytest.mark.parametrize("attempt", METADATA, ids=[each.name for each in METADATA])
def test_no_label_and_no_annotation_reaches_a_pod_unless_it_is_allowed(make_scene, attempt):
    """The author may lack the permission to create pods, and other programs obey labels and annotations."""
    scene = make_scene(scheduling={attempt.path.rpartition(".")[2]: attempt.value})

    decision = scene.settle()

    [key] = attempt.value
    value = "jobs.allowed" + attempt.path.rpartition(".")[2].replace("pod", "Pod")
    message = (
        f"{attempt.path}: key {key} is not allowed in this cluster; allow it with the chart's value {value}, "
        "or create a new TrainingJob without it"
    )
    assert held(scene) == (attempt.told, message), attempt.gain
    assert decision.actions == ()
    assert scene.status.phase is Phase.PENDING


@pytest.mark.parametrize(
    ("allowed", "key", "holds"),
    [
        pytest.param((), "example.com/team", True, id="nothing"),
        pytest.param(("example.com/team",), "example.com/team", False, id="the key"),
        pytest.param(("example.com/teams",), "example.com/team", True, id="a longer key"),
        pytest.param(("example.com/",), "example.com/team", False, id="the domain"),
        pytest.param(("example.com/",), "www.example.com/team", True, id="a domain above"),
        pytest.param(("com/",), "example.com/team", True, id="the end of the domain"),
        pytest.param(("note",), "note", False, id="a key without domain"),
        pytest.param(("note/",), "note", True, id="a key that is called as a domain"),
    ],
)
def test_a_key_is_allowed_by_itself_or_by_its_whole_domain(make_scene, allowed, key, holds):
    """A subdomain may belong to somebody else, so allowing a domain does not allow its subdomains."""
    scene = make_scene(scheduling={"podAnnotations": {key: "x"}})
    scene.layout = replace(scene.layout, allowed=Allowed(pod_annotations=allowed))

    scene.settle()

    assert (scene.status.conditions[0].reason == "PodMetadataNotAllowed") is holds


def test_a_job_starts_when_its_labels_are_allowed_and_keeps_them_when_they_no_longer_are(make_scene):
    """An administrator restarts the operator with the new value.

    The operator does not check an accepted job again.
    """
    scene = make_scene(scheduling={"podLabels": {"example.com/team": "robots"}})
    scene.settle()
    assert held(scene)[0] == "PodMetadataNotAllowed"

    allowed = Allowed(pod_labels=("example.com/",))
    default, scene.layout = scene.layout, replace(scene.layout, allowed=allowed)
    decision = scene.settle()
    labels = decision.actions[-1].object["spec"]["template"]["metadata"]["labels"]
    scene.layout = default
    scene.objects["jobs"].clear()
    again = scene.settle()

    assert labels["example.com/team"] == "robots"
    assert scene.status.conditions[0].status == "True"
    assert again.actions[-1].object["spec"]["template"]["metadata"]["labels"] == labels


@pytest.mark.parametrize("deleting", [False, True])
def test_a_job_of_somebody_else_is_left_alone(make_scene, deleting):
    """A Job of this name may belong to an earlier TrainingJob, whose objects are still being deleted."""
    scene = make_scene()
    scene.step()
    metadata = {"name": "job-0", "uid": "x", "ownerReferences": [{"uid": "other"}]}
    scene.objects["jobs"].append(
        {"metadata": metadata | ({"deletionTimestamp": scene.stamp()} if deleting else {})}
    )

    decision = scene.settle()
    message = scene.replica().message
    scene.objects["jobs"].clear()
    after = scene.settle()

    assert scene.replica().reason != "NameTaken"
    assert ("is being deleted" in message) is deleting
    assert all(each.object["kind"] != "Job" for each in decision.actions)
    assert after.actions[-1].object["kind"] == "Job"
