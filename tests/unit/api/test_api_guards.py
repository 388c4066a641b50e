"""Guards, the rules that a cluster applies to new jobs: which jobs break a guard, and which do not."""

import re

import pytest

from palaestra.api import TrainingJob, broken_guards, validate
from palaestra.api.model_walk import fields_of, walk
from tests.jobs import make_job

URI = "http://alice:S3CR%40ET@tracking.example.com:5000/mlflow"
IN_VALUE = "contains a password in an address; put the value into a Secret and use secretKeyRef"
ELSEWHERE = "contains a password in an address; pass it in an environment variable with secretKeyRef"
GROUP = {"name": "collect", "role": "Collect"}
OWN = {**GROUP, "driver": "command", "image": "my:1"}
GUARDS = {
    f"{'.'.join(path)}: {guard.field}": (model, guard)
    for path, model in walk(TrainingJob)
    for guard in model.guards
}

# The fields that may contain an address, and the message that reports its password.
BROKEN = {
    "a variable of the trainer": (
        {"trainer": {"env": [{"name": "MLFLOW_TRACKING_URI", "value": URI}]}},
        f"spec.trainer.env[0].value: {IN_VALUE}",
    ),
    "a variable of a simulator": (
        {"simulators": [{**GROUP, "env": [{"name": "PROXY", "value": f"via {URI}"}]}]},
        f"spec.simulators[0].env[0].value: {IN_VALUE}",
    ),
    "the option of a callback": (
        {"trainer": {"algorithm": {"callbacks": [{"name": "my:Tracker", "options": {"uri": URI}}]}}},
        f"spec.trainer.algorithm.callbacks[0].options: {ELSEWHERE}",
    ),
    "the option of an environment": (
        {"trainer": {"environment": {"id": "My-v0", "options": {"stores": [{"at": URI}]}}}},
        f"spec.trainer.environment.options: {ELSEWHERE}",
    ),
    "the option of a wrapper": (
        {"trainer": {"environment": {"wrappers": [{"name": "my:Wrapper", "options": {URI: 1}}]}}},
        f"spec.trainer.environment.wrappers[0].options: {ELSEWHERE}",
    ),
    "a program in the trainer": (
        {"trainer": {"command": ["bash", "-c", f"curl {URI}"]}},
        f"spec.trainer.command: {ELSEWHERE}",
    ),
    "a simulator of one's own": (
        {"simulators": [{**OWN, "command": ["sim", URI]}]},
        f"spec.simulators[0].command: {ELSEWHERE}",
    ),
    "an option of a simulator": (
        {"simulators": [{**GROUP, "options": [f"--to={URI}"]}]},
        f"spec.simulators[0].options: {ELSEWHERE}",
    ),
}


def job(spec):
    """Return a job that has no evaluation."""
    trainer = {"evaluation": {"everySteps": 0}, **spec.get("trainer", {})}
    return validate(make_job(**{"simulators": [GROUP], **spec, "trainer": trainer}))


@pytest.mark.parametrize("name", BROKEN)
def test_an_address_with_a_password_is_reported_without_it(name):
    """The message becomes part of the status, and more people may read the status than the spec."""
    spec, line = BROKEN[name]

    assert broken_guards(job(spec)) == (line,)


@pytest.mark.parametrize(
    "value",
    [
        "http://tracking.example.com:5000",
        "http://alice@tracking.example.com",
        "http://[::1]:5000/a@b",
        "https://host:443/users/a@b",
        "https://$USER:$TOKEN@host",
        "https://$USER:${TOKEN}@host",
        "https://{user}:{token}@host",
        "alice:secret@host",
        "see http://host and mail: me@host",
    ],
)
def test_an_address_without_a_password_is_not_reported(value):
    """A port, a user name, a mail address and a shell variable are not passwords."""
    assert broken_guards(job({"trainer": {"env": [{"name": "A", "value": value}]}})) == ()


def test_every_guard_is_broken_by_an_example_here():
    """A guard that no example breaks could be wrong without a failing test."""
    fields = {
        re.sub(r"\[\d+\]", "", line.split(": ")[0]).removeprefix("spec.") for _, line in BROKEN.values()
    }
    guarded = {
        ".".join((*path, guard.field)).removeprefix("spec.")
        for path, model in walk(TrainingJob)
        for guard in model.guards
    }

    assert fields == guarded


@pytest.mark.parametrize("name", GUARDS)
def test_a_guard_reads_a_field_of_its_object(name):
    """If a field is renamed, the test finds its old name in the expression of the guard."""
    model, guard = GUARDS[name]

    read = {*re.findall(r"\bself[.](\w+)", guard.cel), *guard.reads, guard.field}

    assert read <= set(fields_of(model))
