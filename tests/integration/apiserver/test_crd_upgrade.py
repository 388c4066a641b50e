"""The definition of this release with jobs of an earlier one: the API server accepts their changes."""

import json

import pytest

from palaestra.api import TrainingJob
from palaestra.api.crd import crd
from palaestra.api.model_walk import walk
from tests.waiting import eventually

# The group is a separate one, because the other tests on this API server use the definition itself, and
# `kubectl describe` lists a short name in all groups.
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
    """Return the definition of this release under another group and name."""
    found = crd()
    return {
        **found,
        "metadata": {"name": KIND},
        "spec": {**found["spec"], "group": GROUP, "names": NAMES},
    }


def without_guards(schema):
    """Return a schema as in a release without today's guards."""
    if isinstance(schema, list):
        return [without_guards(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: without_guards(value) for key, value in schema.items()}
    if rules := schema.get("x-kubernetes-validations"):
        kept["x-kubernetes-validations"] = [rule for rule in rules if rule["message"] not in GUARDS]
    return kept


def job(name):
    """Return a job whose spec breaks a guard."""
    return {
        "apiVersion": f"{GROUP}/v1alpha1",
        "kind": NAMES["kind"],
        "metadata": {"name": name, "namespace": "default"},
        "spec": {"trainer": PASSWORD},
    }


@pytest.fixture
def apply(control_plane):
    """Apply an object as a user does, and return the exit code and kubectl's output."""

    def applied(obj):
        done = control_plane.kubectl("apply", "--server-side", "-f", "-", sent=json.dumps(obj))
        return done.returncode, done.stdout + done.stderr

    yield applied
    control_plane.kubectl("delete", "crd", KIND, "--ignore-not-found")


def test_a_job_with_a_password_can_still_be_changed_and_its_status_written(control_plane, apply):
    """Validation ratchets: a later rule does not apply to unchanged fields."""
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
