"""After an upgrade of the definition, the API server still accepts changes of older jobs."""

import json

import pytest

from palaestra.api import TrainingJob
from palaestra.api.crd import crd
from palaestra.api.model_walk import walk
from tests.waiting import eventually

# The tests use a group of their own. Other tests on this API server use the real definition, and `kubectl
# describe` finds a short name in all groups.
GROUP = "earlier.example.com"
NAMES = {
    "plural": "earlierjobs",
    "singular": "earlierjob",
    "kind": "EarlierJob",
    "listKind": "EarlierJobList",
}
KIND = f"{NAMES['plural']}.{GROUP}"
PASSWORD = {"env": [{"name": "PROXY", "value": "http://me:secret@proxy:3128"}]}
GUARDS = {guard.message for _, model in walk(TrainingJob) for guard in model.guards}


def definition():
    """Return the present definition with another group and name."""
    found = crd()
    return {
        **found,
        "metadata": {"name": KIND},
        "spec": {**found["spec"], "group": GROUP, "names": NAMES},
    }


def without_guards(schema):
    """Return a schema without the present guards, as in an earlier release."""
    if isinstance(schema, list):
        return [without_guards(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: without_guards(value) for key, value in schema.items()}
    if rules := schema.get("x-kubernetes-validations"):
        kept["x-kubernetes-validations"] = [rule for rule in rules if rule["message"] not in GUARDS]
    return kept


def job(name):
    """Return a job whose spec violates a guard."""
    return {
        "apiVersion": f"{GROUP}/v1alpha1",
        "kind": NAMES["kind"],
        "metadata": {"name": name, "namespace": "default"},
        "spec": {"trainer": PASSWORD},
    }


@pytest.fixture
def apply(control_plane):
    """Return a function that applies an object as a user does, and returns exit code and output."""

    def applied(obj):
        done = control_plane.kubectl("apply", "--server-side", "-f", "-", sent=json.dumps(obj))
        return done.returncode, done.stdout + done.stderr

    yield applied
    control_plane.kubectl("delete", "crd", KIND, "--ignore-not-found")


def test_a_job_with_a_password_can_still_be_changed_and_its_status_written(control_plane, apply):
    """The API server does not apply a new rule to unchanged fields (ratcheting)."""
    apply(without_guards(definition()))
    eventually(lambda: apply(job("earlier"))[0] == 0)
    apply(definition())
    eventually(lambda: "contains a password in an address" in apply(job("new"))[1])

    def patch(content, *options):
        words = ("patch", KIND, "earlier", "--namespace=default", "--type=merge", f"--patch={content}")
        return control_plane.kubectl(*words, *options)

    suspended = patch('{"spec": {"suspend": true}}')
    written = patch('{"status": {"phase": "Suspended"}}', "--subresource=status")

    assert (suspended.returncode, written.returncode) == (0, 0), suspended.stderr + written.stderr
    assert apply(job("earlier"))[0] == 0
