"""What keeps a job from starting, each with its reason; most of it somebody can mend, and then it starts."""

import pytest

from palaestra.api.status import Phase
from palaestra.decide import Create

OPEN = {"palaestra.dev/for-jobs": "true"}
GROUPS = [{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}]
WORLD = [{**GROUPS[0], "world": {"configMap": {"name": "worlds", "key": "hall.wbt"}}}, GROUPS[1]]
SECRET = {"env": [{"name": "TOKEN", "secretKeyRef": {"name": "keys", "key": "token"}}]}


def config_map(data=None, labels=None):
    """Return a ConfigMap."""
    return {"metadata": {"name": "worlds", "labels": OPEN if labels is None else labels}, "data": data or {}}


def held(scene):
    """Return reason and message of the condition Accepted, which must be False."""
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
            "spec.simulators[0].world.configMap: there is no ConfigMap worlds here; "
            "create it and the job starts",
            id="no ConfigMap",
        ),
        pytest.param(
            {"simulators": WORLD},
            {("ConfigMap", "worlds"): config_map({"other.wbt": ""})},
            "WorldMissing",
            "spec.simulators[0].world.configMap.key: ConfigMap worlds has no key hall.wbt; "
            "create it and the job starts",
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
            "spec.trainer.env[0].secretKeyRef: there is no Secret keys here; create it and the job starts",
            id="no Secret",
        ),
        pytest.param(
            {"simulators": [{**GROUPS[0], **SECRET}, GROUPS[1]]},
            {("Secret", "keys"): {"metadata": {"name": "keys"}}},
            "SecretNotForJobs",
            "spec.simulators[0].env[0].secretKeyRef: Secret keys is not for jobs, or the operator may not "
            'see that it is; label it palaestra.dev/for-jobs: "true" and bind the role '
            "palaestra-job-secrets in this namespace",
            id="a Secret of somebody else",
        ),
        pytest.param(
            {"storage": {"existingClaim": "runs"}},
            {},
            "ClaimMissing",
            "spec.storage.existingClaim: there is no PersistentVolumeClaim runs here; "
            "create it and the job starts",
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
            {"scheduling": {"queueName": "robots"}},
            {},
            "NoKueue",
            "spec.scheduling.queueName: this cluster has no Kueue; install it, or make a job without a queue",
            id="a queue without Kueue",
        ),
    ],
)
def test_a_job_is_held_with_a_reason_and_creates_nothing(make_scene, spec, there, reason, message):
    """Field, fact and remedy; the job pends and may start later."""
    scene = make_scene(**spec)
    scene.there = there

    decision = scene.settle()

    assert held(scene) == (reason, message)
    assert decision.actions == ()
    assert [(each.reason, each.message) for each in decision.events if each.replica is None] == [
        (reason, message)
    ]
    assert scene.status.phase is Phase.PENDING


def test_a_job_starts_when_its_world_appears(make_scene):
    """Nobody has to touch the job."""
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
    """It is read again until the job was accepted."""
    scene = make_scene(simulators=WORLD)
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": "no world"})
    scene.settle()
    assert held(scene)[0] == "WorldInvalid"

    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    scene.settle()

    assert scene.status.conditions[0].status == "True"


def test_what_nobody_can_mend_fails_at_once(make_scene):
    """A spec does not change."""
    scene = make_scene(simulators=[{**GROUPS[0], "world": {"inline": "no world"}}, GROUPS[1]])

    decision = scene.settle()

    assert scene.status.phase is Phase.FAILED
    assert held(scene)[0] == "WorldInvalid"
    assert scene.status.conditions[-1].message.startswith("spec.simulators[0].world.inline:")
    assert decision.actions == ()


def test_a_world_that_goes_away_later_does_not_matter_to_a_running_job(make_scene):
    """Its copy is in the job's own ConfigMap."""
    scene = make_scene(simulators=WORLD)
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    scene.settle()
    scene.running_pod()
    scene.settle()

    scene.there.clear()
    decision = scene.settle()

    assert (scene.status.phase, decision.actions, decision.events) == (Phase.RUNNING, (), ())


def test_a_label_that_was_taken_away_keeps_a_new_pod_from_it(make_scene):
    """What was not created yet is held like before; the replicas that run go on."""
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


@pytest.mark.parametrize("deleting", [False, True])
def test_a_job_of_somebody_else_is_left_alone(make_scene, deleting):
    """It has our name: perhaps of a TrainingJob that was there before, and is being collected."""
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
