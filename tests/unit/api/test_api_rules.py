"""Every rule: a change that breaks it, and the message that reports the change.

The API server refuses such a job with the same message: the models define the CEL expression of a rule next
to its check in Python.
"""

import re

import pytest
from pydantic import ValidationError

from palaestra.api import TrainingJob, WorldSource
from palaestra.api.model_walk import fields_of, walk

ROLES = ("Collect", "Collect", "Evaluate")

COPIES = {"simulators.0.driver": "mujoco", "simulators.0.batch": 8}

# For each rule: changes that break it, and the message that reports them.
BROKEN = {
    "no group collects": (
        {"simulators": [{"name": "evaluate", "role": "Evaluate"}]},
        "spec.simulators: no group has role Collect; add one",
    ),
    "too many simulators for a pod": (
        {"simulators": [{"name": f"g{n}", "role": ROLES[n], "count": 11} for n in range(3)]},
        "spec.simulators: has more than 32 simulators in one pod; lower the counts or use replicas",
    ),
    "more inline worlds than a ConfigMap holds": (
        {
            "simulators": [
                {"name": f"g{place}", "role": "Collect", "world": {"inline": "x" * 190_000}}
                for place in range(5)
            ],
            "trainer.evaluation": {"everySteps": 0},
        },
        (
            "spec.simulators: the inline worlds have more than 900,000 characters together; "
            "put the worlds into the images and name them with world.file"
        ),
    ),
    "nothing evaluates": (
        {"simulators": [{"name": "collect", "role": "Collect"}]},
        "spec.trainer.evaluation: no group has role Evaluate; add one, or set everySteps: 0",
    ),
    "suspended by two": (
        {"suspend": True, "scheduling.queueName": "robots"},
        (
            "spec.suspend: cannot be true with queueName, because Kueue then suspends and resumes the job; "
            "remove one of them"
        ),
    ),
    "copies next to other simulators": (
        {
            "simulators": [
                {"name": "many", "role": "Collect", "driver": "mujoco", "batch": 8},
                {"name": "one", "role": "Collect"},
                {"name": "evaluate", "role": "Evaluate"},
            ]
        },
        "spec.simulators: a group with batch must be the only one with role Collect; remove the others",
    ),
    "copies for a program of the user": (
        {**COPIES, "trainer.command": ["train"]},
        "spec.trainer.command: cannot be combined with simulators[].batch; remove one of them",
    ),
    "copies that are collected from asynchronously": (
        {**COPIES, "trainer.algorithm.name": "DQN", "trainer.collection": "Asynchronous"},
        (
            "spec.trainer.collection: Asynchronous is for several simulators; remove it, or remove "
            "simulators[].batch"
        ),
    ),
    "copies of a task without a batched form": (
        {**COPIES, "trainer.environment": {"id": "Deliver-v0"}},
        (
            "spec.trainer.environment.id: has no batched form; choose MoveToTargetEnv-v0 or a batched "
            "environment of your own, or remove simulators[].batch"
        ),
    ),
    "copies in another simulator": (
        {"simulators.0.batch": 8},
        "spec.simulators[0].batch: needs driver mujoco and role Collect; set them, or remove batch",
    ),
    "copies in several simulators": (
        {**COPIES, "simulators.0.standby": True},
        (
            "spec.simulators[0].batch: cannot be combined with count, standby, reset and recycle; "
            "remove them, or remove batch"
        ),
    ),
    "a driver without its command": (
        {"simulators.0.driver": "command", "simulators.0.image": "mine:1"},
        (
            "spec.simulators[0].command: is for driver command only, and is required with that driver; "
            "set both or neither"
        ),
    ),
    "a command without its driver": (
        {"simulators.0.command": ["simulate"]},
        (
            "spec.simulators[0].command: is for driver command only, and is required with that driver; "
            "set both or neither"
        ),
    ),
    "a program in no image": (
        {"simulators.0.driver": "command", "simulators.0.command": ["simulate"]},
        (
            "spec.simulators[0].image: is required with driver command; "
            "name the image that contains your program"
        ),
    ),
    "recycled at no limit": (
        {"simulators.0.recycle": {}},
        "spec.simulators[0].recycle: sets no limit; set afterResets, afterMinutes or aboveMemory",
    ),
    "two numbers of resets before a restart": (
        {"simulators.0.reset": "Restart", "simulators.0.recycle": {"afterResets": 24}},
        (
            "spec.simulators[0].recycle: contradicts reset: Restart, which restarts after each reset; "
            "remove one of them"
        ),
    ),
    "more than there are are enough": (
        {"simulators.0.count": 2, "simulators.0.minSimulators": 3},
        "spec.simulators[0].minSimulators: is more than count; lower it or raise count",
    ),
    "two worlds": (
        {"simulators.1.world": {"builtin": "arena", "file": "/worlds/hall.wbt"}},
        (
            "spec.simulators[1].world: needs exactly one of inline, configMap, builtin and file; "
            "set one of them"
        ),
    ),
    "no world": (
        {"simulators.1.world": {}},
        (
            "spec.simulators[1].world: needs exactly one of inline, configMap, builtin and file; "
            "set one of them"
        ),
    ),
    "a root that is not above the world": (
        {"simulators.1.world": {"file": "/worlds/hall.wbt", "root": "/world"}},
        (
            "spec.simulators[1].world: has a root that is not above file; "
            "set root to a folder above file, or remove it"
        ),
    ),
    "a root without a file": (
        {"simulators.1.world": {"builtin": "arena", "root": "/worlds"}},
        (
            "spec.simulators[1].world: has a root that is not above file; "
            "set root to a folder above file, or remove it"
        ),
    ),
    "a variable with two values": (
        {"trainer.env": [{"name": "A", "value": "1", "secretKeyRef": {"name": "keys", "key": "a"}}]},
        "spec.trainer.env[0]: needs exactly one of value and secretKeyRef; set one of them",
    ),
    "a variable that is ours": (
        {"simulators.0.env": [{"name": "ROS_MASTER_URI", "value": "http://elsewhere"}]},
        (
            "spec.simulators[0].env[0].name: Palaestra sets the variables that begin with "
            "PALAESTRA_ (except PALAESTRA_STUB_) or ROS_; choose another name"
        ),
    ),
    "an evaluation that never is": (
        {"trainer.evaluation": {"everySteps": 0, "stopAtSuccessRate": 0.9}},
        (
            "spec.trainer.evaluation.stopAtSuccessRate: has no effect while everySteps is 0; "
            "remove it or raise everySteps"
        ),
    ),
    "SAC with movements": (
        {"trainer.algorithm.name": "SAC"},
        (
            "spec.trainer.algorithm.name: SAC needs continuous actions; "
            "set environment.options.actions: continuous"
        ),
    ),
    "SAC with movements, for images": (
        {"trainer.algorithm.name": "SAC", "trainer.environment.id": "SeeTarget-v0"},
        (
            "spec.trainer.algorithm.name: SAC needs continuous actions; "
            "set environment.options.actions: continuous"
        ),
    ),
    **{
        f"{name} with movements": (
            {"trainer.algorithm.name": name},
            (
                f"spec.trainer.algorithm.name: {name} needs continuous actions; "
                "set environment.options.actions: continuous"
            ),
        )
        for name in ("TD3", "DDPG", "TQC", "CrossQ")
    },
    "PPO that collects asynchronously": (
        {"trainer.algorithm.name": "PPO", "trainer.collection": "Asynchronous"},
        (
            "spec.trainer.collection: Asynchronous needs an off-policy algorithm; remove the field, or use "
            "DQN, SAC or a similar one"
        ),
    ),
    "QRDQN with twists": (
        {
            "trainer.algorithm.name": "QRDQN",
            "trainer.environment.options": {"actions": "continuous"},
        },
        (
            "spec.trainer.algorithm.name: QRDQN needs discrete actions; "
            "set environment.options.actions: discrete"
        ),
    ),
    "DQN with twists": (
        {"trainer.environment.options": {"actions": "continuous"}},
        "spec.trainer.algorithm.name: DQN needs discrete actions; set environment.options.actions: discrete",
    ),
    "nothing normalized": (
        {"trainer.algorithm.normalize": {"observations": False, "rewards": False}},
        (
            "spec.trainer.algorithm.normalize: has no effect while observations and rewards are both false; "
            "remove it"
        ),
    ),
    "observations clipped that are not normalized": (
        {"trainer.algorithm.normalize": {"observations": False, "clipObservations": 5}},
        (
            "spec.trainer.algorithm.normalize.clipObservations: has no effect while observations is false; "
            "remove it"
        ),
    ),
    "rewards clipped that are not normalized": (
        {"trainer.algorithm.normalize": {"rewards": False, "clipRewards": 5}},
        "spec.trainer.algorithm.normalize.clipRewards: has no effect while rewards is false; remove it",
    ),
    "a claim for what is kept nowhere": (
        {"storage": {"ephemeral": True, "existingClaim": "runs"}},
        "spec.storage.ephemeral: cannot be combined with existingClaim; remove one of them",
    ),
    "a class for what is kept nowhere": (
        {"storage": {"ephemeral": True, "storageClassName": "fast"}},
        (
            "spec.storage.ephemeral: cannot be combined with storageClassName, as no claim is created; "
            "remove one of them"
        ),
    ),
    "a class for a claim that is there": (
        {"storage": {"existingClaim": "runs", "storageClassName": "fast"}},
        (
            "spec.storage.storageClassName: cannot be combined with existingClaim, which already has a "
            "class; remove one of them"
        ),
    ),
    "somebody else's claim deleted": (
        {"storage": {"existingClaim": "runs", "retain": "Delete"}},
        "spec.storage.retain: an existing claim is never deleted with the job; use Keep",
    ),
    "resumed from nowhere": (
        {"storage.resumeFrom": "5a0c"},
        "spec.storage.resumeFrom: needs existingClaim; name the claim that contains the run",
    ),
    "a path on a claim from its root": (
        {"trainer.initialPolicy": {"claim": "runs", "path": "/a/model.zip"}},
        "spec.trainer.initialPolicy.path: must be relative with a claim and absolute without one; change it",
    ),
    "a policy for a run that is resumed": (
        {
            "trainer.initialPolicy": {"path": "/a/model.zip"},
            "storage": {"existingClaim": "runs", "resumeFrom": "5a0c"},
        },
        "spec.trainer.initialPolicy: cannot be combined with storage.resumeFrom; remove one of them",
    ),
    "a label that is ours": (
        {"scheduling.podLabels": {"palaestra.dev/job": "other"}},
        (
            "spec.scheduling.podLabels: Palaestra sets the keys of palaestra.dev and kueue.x-k8s.io; "
            "remove them"
        ),
    ),
    "an annotation that is Kueue's": (
        {"scheduling.podAnnotations": {"kueue.x-k8s.io/queue": "other"}},
        (
            "spec.scheduling.podAnnotations: Palaestra sets the keys of palaestra.dev and kueue.x-k8s.io; "
            "remove them"
        ),
    ),
    "a priority above everybody's": (
        {"scheduling.priorityClassName": "system-node-critical"},
        (
            "spec.scheduling.priorityClassName: classes that begin with system- are for the cluster's own "
            "components; choose another"
        ),
    ),
    "a label that others select by": (
        {"scheduling.podLabels": {"app.kubernetes.io/name": "database"}},
        (
            "spec.scheduling.podLabels: Services and NetworkPolicies of other users may select pods by a "
            "label without your domain; use a key such as example.com/team"
        ),
    ),
    "an annotation that confines less": (
        {
            "scheduling.podAnnotations": {
                "container.apparmor.security.beta.kubernetes.io/trainer": "unconfined"
            }
        },
        (
            "spec.scheduling.podAnnotations: a job must not select AppArmor or seccomp profiles; "
            "remove those annotations"
        ),
    ),
    "a toleration of a control plane": (
        {"scheduling.tolerations": [{"key": "node-role.kubernetes.io/control-plane", "operator": "Exists"}]},
        (
            "spec.scheduling.tolerations[0].key: is a taint that reserves nodes for the cluster's own "
            "components; remove it"
        ),
    ),
    "a toleration of any value and one": (
        {"scheduling.tolerations": [{"key": "gpu", "operator": "Exists", "value": "a100"}]},
        "spec.scheduling.tolerations[0].value: has no effect with operator Exists; remove it or use Equal",
    ),
    "a toleration that ends without an effect": (
        {"scheduling.tolerations": [{"key": "gpu", "tolerationSeconds": 60}]},
        (
            "spec.scheduling.tolerations[0].tolerationSeconds: requires effect NoExecute; "
            "set that effect or remove it"
        ),
    ),
}


# The rules of all models, by a readable name.
RULES = {
    f"{model.__name__}.{rule.field}: {rule.message}": (model, rule)
    for _, model in walk(TrainingJob)
    for rule in model.rules
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_rule_is_reported_in_one_line(name, problems) -> None:
    """The line has a path, a fact and a remedy.

    Further errors that the same mistake causes would distract the author.
    """
    changes, line = BROKEN[name]

    assert problems(changes) == [line]


def test_every_rule_is_broken_by_an_example_here() -> None:
    """A rule that no example breaks could be wrong without a failing test."""
    told = {line.split(": ", 1)[1] for _, line in BROKEN.values()}

    assert {rule.message for _, rule in RULES.values()} == told


@pytest.mark.parametrize("name", RULES)
def test_a_rule_reads_only_fields_that_there_are(name) -> None:
    """If a field is renamed, the test finds its old name in the expression of the rule."""
    model, rule = RULES[name]
    known = {field for _, below in walk(model) for field in fields_of(below)}

    read = re.findall(r"\b(?:self|group)((?:[.]\w+)+)\b(?!\()", rule.cel)

    assert {piece for path in read for piece in path.split(".")} - {""} <= known
    assert set(rule.field.split(".")) - {""} <= known


@pytest.mark.parametrize("name", RULES)
def test_a_rule_is_one_fact_and_one_remedy(name) -> None:
    """Users read many of these messages, so all have one form.

    A fact is followed by a semicolon and an instruction without a full stop.
    """
    message = RULES[name][1].message

    fact, remedy = message.split("; ")

    assert fact
    assert remedy[0].islower()
    assert not message.endswith(".")


def test_only_what_lies_in_options_has_no_expression() -> None:
    """An API server cannot check the fields of free objects such as hyperparameters.

    All other rules have a CEL expression, so the API server checks them itself.
    """
    without = [rule.message for _, rule in RULES.values() if not rule.cel]

    algorithms = {message.split()[0] for message in without}
    assert algorithms == {"CrossQ", "DDPG", "DQN", "QRDQN", "SAC", "TD3", "TQC"}


def test_a_job_built_in_python_keeps_the_rules_too() -> None:
    """The models check the rules, so a job that does not come from a file is checked too."""
    with pytest.raises(ValidationError, match="needs exactly one of inline"):
        WorldSource()
