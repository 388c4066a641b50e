"""The API server itself refuses wrong TrainingJobs, so they never reach the operator.

Every message names the field. If one of our own rules refuses, the message contains the remedy.
"""

import itertools
import json
from pathlib import Path

import pytest
import yaml

from tests.jobs import changed, example

STRICT = "/apis/palaestra.dev/v1alpha1/namespaces/default/trainingjobs?fieldValidation=Strict"
ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "manifests" / "examples").glob("*.yaml"))
MINIMAL = example("minimal")
FROZEN = "cannot be changed; make a new TrainingJob"
COLLECT, EVALUATE = {"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}
numbers = itertools.count(1)


@pytest.fixture(scope="session")
def defined(control_plane, installed):  # noqa: ARG001 - it defines TrainingJobs
    """Return the control plane after it has the definition of TrainingJobs."""
    return control_plane


@pytest.fixture(scope="session")
def create(defined):
    """Return a function that sends a TrainingJob without kubectl's checks, and returns code and output."""

    def created(job):
        done = defined.kubectl("create", "--raw", STRICT, "-f", "-", sent=json.dumps(job))
        return done.returncode, done.stdout + done.stderr

    return created


@pytest.fixture(scope="session")
def apply(defined):
    """Return a function that applies objects with kubectl, as a user does, and returns code and output."""

    def applied(*objects):
        sent = json.dumps({"apiVersion": "v1", "kind": "List", "items": list(objects)})
        done = defined.kubectl("apply", "-f", "-", sent=sent)
        return done.returncode, done.stdout + done.stderr

    return applied


def changed_job(**changes):
    """Return the minimal example with a new name, and with changes by path (`__` stands for a dot)."""
    job = changed(MINIMAL, "metadata.name", f"job-{next(numbers)}")
    for path, value in changes.items():
        job = changed(job, path.replace("__", "."), value)
    return job


WRONG = [
    ("metadata.name", "n" * 49, "metadata.name: Too long"),
    ("metadata.name", "9-lives", "metadata.name"),
    ("spec.replicas", 0, "spec.replicas: Invalid value: 0"),
    ("spec.replicas", 101, "spec.replicas: Invalid value: 101"),
    ("spec.replicas", "two", "spec.replicas: Invalid value"),
    ("spec.seed", -1, "spec.seed: Invalid value: -1"),
    ("spec.backoffLimit", -1, "spec.backoffLimit"),
    ("spec.suspend", "yes", "spec.suspend"),
    ("spec.activeDeadlineSeconds", 0, "spec.activeDeadlineSeconds"),
    ("spec.ttlSecondsAfterFinished", -1, "spec.ttlSecondsAfterFinished"),
    ("spec.steps", 5, 'unknown field "spec.steps"'),
    ("spec.simulators", [], "spec.simulators"),
    ("spec.simulators", [COLLECT, COLLECT], "spec.simulators[1]: Duplicate value"),
    ("spec.simulators", [EVALUATE], "spec.simulators: Invalid value.*no group has role Collect; add one"),
    (
        "spec.simulators",
        [COLLECT | {"count": 16}, EVALUATE | {"count": 16}, COLLECT | {"name": "more"}],
        "spec.simulators: Invalid value.*more than 32 simulators in one pod; lower the counts",
    ),
    ("spec.simulators", [COLLECT], "spec.trainer.evaluation.*no group has role Evaluate; add one"),
    ("spec.simulators.0", {"name": "collect"}, "spec.simulators[0].role: Required value"),
    ("spec.simulators.0.role", "Eval", "spec.simulators[0].role: Unsupported value"),
    ("spec.simulators.0.count", 17, "spec.simulators[0].count"),
    ("spec.simulators.0.name", "Collect_1", "spec.simulators[0].name"),
    ("spec.simulators.0.name", "c" * 21, "spec.simulators[0].name: Too long"),
    ("spec.simulators.0.driver", "gazebo", "spec.simulators[0].driver: Unsupported value"),
    ("spec.simulators.0.image", "two words", "spec.simulators[0].image"),
    ("spec.simulators.0.command", ["run"], "spec.simulators[0].command.*is for driver command"),
    (
        "spec.simulators.0.driver",
        "command",
        "spec.simulators[0].image.*is required with driver command; name the image",
    ),
    ("spec.simulators.0.world", {}, "spec.simulators[0].world.*needs exactly one of inline, configMap"),
    (
        "spec.simulators.0.world",
        {"builtin": "arena", "file": "/w.wbt"},
        "spec.simulators[0].world.*needs exactly one of",
    ),
    ("spec.simulators.0.world", {"configMap": {"name": "c"}}, "world.configMap.key: Required value"),
    ("spec.simulators.0.world", {"builtin": "house"}, "world.builtin: Unsupported value"),
    ("spec.simulators.0.world", {"file": "../x.wbt"}, "world.file"),
    ("spec.simulators.0.recycle", {}, "spec.simulators[0].recycle.*sets no limit; set afterResets, after"),
    ("spec.simulators.0.recycle", {"aboveMemory": "400"}, "spec.simulators[0].recycle.aboveMemory"),
    ("spec.simulators.0.recycle", {"afterMinutes": 0}, "spec.simulators[0].recycle.afterMinutes"),
    ("spec.simulators.0.standby", "yes", "spec.simulators[0].standby"),
    ("spec.simulators.0.minSimulators", 2, "minSimulators.*is more than count; lower it or raise"),
    ("spec.simulators.0.env", [{"name": "A"}], "env[0].*needs exactly one of value and secretKeyRef"),
    (
        "spec.simulators.0.env",
        [{"name": "ROS_IP", "value": "x"}],
        "env[0].name.*Palaestra sets the",
    ),
    ("spec.simulators.0.env", [{"name": "A-B", "value": "x"}], "env[0].name"),
    ("spec.simulators.0.resources", {"requests": {"cpu": "lots"}}, "resources.requests.cpu"),
    (
        "spec.simulators.0.env",
        [{"name": "PROXY", "value": "http://me:secret@proxy:3128"}],
        "env[0].value.*contains a password in an address; put the value into a Secret",
    ),
    ("spec.simulators.0.options", ["--to=http://me:s@h"], "simulators[0].options.*contains a password"),
    ("spec.trainer.command", ["curl", "http://me:s@h"], "spec.trainer.command.*contains a password"),
    ("spec.trainer.steps", 0, "spec.trainer.steps"),
    ("spec.trainer.environment.id", "Move To Target", "spec.trainer.environment.id"),
    ("spec.trainer.environment.reward", "Medium", "spec.trainer.environment.reward: Unsupported value"),
    ("spec.trainer.algorithm.name", "DDQN", "spec.trainer.algorithm.name"),
    ("spec.trainer.evaluation", {"stopAtSuccessRate": 0}, "stopAtSuccessRate"),
    (
        "spec.trainer.evaluation",
        {"everySteps": 0, "stopAtSuccessRate": 0.9},
        "stopAtSuccessRate.*has no effect while everySteps is 0",
    ),
    (
        "spec.trainer.evaluation",
        {"everySteps": 0, "confirmEpisodes": 10},
        "confirmEpisodes.*has no effect while everySteps is 0",
    ),
    ("spec.trainer.checkpoint", {"keep": 0}, "spec.trainer.checkpoint.keep"),
    ("spec.storage", {"size": "much"}, "spec.storage.size"),
    (
        "spec.storage",
        {"ephemeral": True, "existingClaim": "c"},
        "ephemeral.*cannot be combined with existing",
    ),
    (
        "spec.trainer",
        {"initialPolicy": {"claim": "c", "path": "/a/model.zip"}},
        "initialPolicy.path.*must be relative with a claim and absolute without one",
    ),
    ("spec.trainer", {"initialPolicy": {"claim": "c", "path": "../a.zip"}}, "initialPolicy.path"),
    ("spec.storage", {"resumeFrom": "uid"}, "resumeFrom.*needs existingClaim; name the claim"),
    (
        "spec.storage",
        {"existingClaim": "c", "retain": "Delete"},
        "retain.*is never deleted with the job; use Keep",
    ),
    ("spec.network", {"egress": "Half"}, "spec.network.egress: Unsupported value"),
    ("spec.scheduling", {"tolerations": [{"value": "x"}]}, "tolerations[0].key: Required value"),
    ("spec.scheduling", {"podLabels": {"palaestra.dev/job": "x"}}, "podLabels.*Palaestra sets the keys"),
    ("spec.scheduling", {"podLabels": {"a.b/c": "two words"}}, "podLabels"),
]


@pytest.mark.parametrize(
    ("path", "value", "message"), WRONG, ids=[f"{path}={value}" for path, value, _ in WRONG]
)
def test_a_wrong_manifest_is_refused_with_the_name_of_the_field(create, path, value, message):
    """No operator runs here, so the API server alone refuses the manifest."""
    code, said = create(changed(changed_job(), path, value))

    assert code == 1
    assert_says(said, message)


def test_suspending_a_queued_job_by_hand_is_refused(create):
    """Kueue suspends and resumes a queued job, so a user must not do that as well."""
    code, said = create(changed_job(spec__suspend=True, spec__scheduling__queueName="team"))

    assert code == 1
    assert_says(said, "spec.suspend.*because Kueue then suspends and resumes the job; remove one of them")


def test_a_driver_that_is_a_command_needs_one(create):
    """The driver `command` starts the job's own program, so the job must name the program's command."""
    code, said = create(
        changed_job(spec__simulators__0__driver="command", spec__simulators__0__image="mine:1")
    )

    assert code == 1
    assert_says(said, "spec.simulators[0].command.*is for driver command only, .*; set both")


def groups_with_worlds(*lengths):
    """Return groups of simulators with inline worlds of this many characters."""
    return [
        {"name": f"g{place}", "role": "Collect", "world": {"inline": "x" * length}}
        for place, length in enumerate(lengths)
    ]


def test_inline_worlds_are_bounded_together(create):
    """Each world is small enough, but a few such jobs would fill the operator's cache."""
    fits, too_much = (180_000,) * 5, (180_000,) * 4 + (180_001,)
    evaluation = {"spec__trainer__evaluation": {"everySteps": 0}}
    accepted, _ = create(changed_job(spec__simulators=groups_with_worlds(*fits), **evaluation))
    code, said = create(changed_job(spec__simulators=groups_with_worlds(*too_much), **evaluation))

    assert accepted == 0
    assert code == 1
    assert_says(said, "spec.simulators.*more than 900,000 characters together; put the worlds into")


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_is_accepted(apply, example):
    """Users copy the examples and expect that they work."""
    code, said = apply(*yaml.safe_load_all(example.read_text()))

    assert code == 0, said


def test_an_empty_spec_is_accepted_and_completed(apply, defined):
    """The API server sets the defaults, so a user sees them in the stored job."""
    job = changed_job(spec={})
    code, said = apply(job)
    stored = yaml.safe_load(defined.kubectl("get", "tj", job["metadata"]["name"], "-o", "yaml").stdout)

    assert code == 0, said
    assert stored["spec"]["replicas"] == 1
    assert [group["role"] for group in stored["spec"]["simulators"]] == ["Collect", "Evaluate"]


MAY_CHANGE = [
    ("spec.suspend", True),
    ("spec.activeDeadlineSeconds", 60),
    ("spec.stallDeadlineSeconds", 60),
    ("spec.ttlSecondsAfterFinished", 60),
    ("spec.simulators.0.startDeadlineSeconds", 7),
    ("metadata.labels", {"team": "a"}),
]
MAY_NOT_CHANGE = [
    ("spec.replicas", 2),
    ("spec.seed", 2),
    ("spec.backoffLimit", 0),
    ("spec.managedBy", "example.com/other"),
    ("spec.simulators", [COLLECT, {"name": "judge", "role": "Evaluate"}]),
    ("spec.simulators", [COLLECT, EVALUATE, {"name": "more", "role": "Collect"}]),
    ("spec.simulators.0.count", 2),
    ("spec.simulators.0.recycle", {"afterMinutes": 5}),
    ("spec.simulators.0.standby", True),
    ("spec.simulators.0.minSimulators", 1),
    ("spec.simulators.0.image", "another:1"),
    ("spec.simulators.0.world", {"file": "/other.wbt"}),
    ("spec.trainer.steps", 7),
    ("spec.trainer.algorithm.name", "A2C"),
    ("spec.trainer.algorithm.hyperparameters", {"learning_rate": 0.1}),
    ("spec.trainer.environment.options", {"max_steps": 7}),
    ("spec.scheduling.affinity", {"nodeAffinity": {}}),
    ("spec.storage", {"size": "2Gi"}),
    ("spec.scheduling", {"queueName": "team"}),
    ("spec.network", {"egress": "Closed"}),
]


@pytest.mark.parametrize(("path", "value"), MAY_CHANGE, ids=[path for path, _ in MAY_CHANGE])
def test_what_may_change_changes(apply, path, value):
    """docs/reference/trainingjob.md lists exactly these fields as mutable."""
    job = changed_job()
    apply(job)

    code, said = apply(changed(job, path, value))

    assert code == 0, said
    assert "configured" in said


@pytest.mark.parametrize(
    ("path", "value"), MAY_NOT_CHANGE, ids=[f"{path}={value}" for path, value in MAY_NOT_CHANGE]
)
def test_what_may_not_change_is_refused_with_the_remedy(apply, path, value):
    """Nobody could explain the result of a run whose settings changed in the middle."""
    job = changed_job()
    apply(job)

    code, said = apply(changed(job, path, value))

    assert code == 1
    assert_says(said, f"{path.split('.')[1]}.*{FROZEN}")


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("spec.trainer.steps", 7),
        ("spec.trainer.image", "another:1"),
        ("spec.trainer.algorithm.name", "A2C"),
        ("spec.storage.size", "2Gi"),
        ("spec.network.egress", "Closed"),
        ("spec.scheduling.queueName", "team"),
    ],
    ids=str,
)
def test_the_refusal_of_a_change_names_the_field_that_was_changed(apply, path, value):
    """With only `spec.trainer: cannot be changed`, a user would have to compare forty fields."""
    job = changed_job()
    apply(job)

    code, said = apply(changed(job, path, value))

    assert code == 1
    assert_says(said, f"{path}: .*{FROZEN}")


def assert_says(said, message):
    """Assert that the parts of a message (separated by `.*`) occur in the output in this order."""
    rest = said
    for part in message.split(".*"):
        assert part in rest, f"{part!r} is not in {said!r}"
        rest = rest.partition(part)[2]
