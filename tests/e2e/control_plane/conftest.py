"""A real API server without nodes, with TrainingJobs defined in it."""

import json
from pathlib import Path

import pytest

from tests.control_plane.fixture import control_plane

__all__ = ["control_plane"]

STRICT = "/apis/palaestra.dev/v1alpha1/namespaces/default/trainingjobs?fieldValidation=Strict"
ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def defined(control_plane):
    """The control plane after `kubectl apply -f manifests/crd.yaml`."""
    applied = control_plane.kubectl("apply", "-f", str(ROOT / "manifests" / "crd.yaml"))
    assert applied.returncode == 0, applied.stderr
    established = control_plane.kubectl(
        "wait", "--for=condition=Established", "crd/trainingjobs.palaestra.dev", "--timeout=30s"
    )
    assert established.returncode == 0, established.stderr
    return control_plane


@pytest.fixture(scope="session")
def create(defined):
    """Send one TrainingJob as it stands, past the checks of kubectl; returns exit code and what was said."""

    def created(job):
        done = defined.kubectl("create", "--raw", STRICT, "-f", "-", sent=json.dumps(job))
        return done.returncode, done.stdout + done.stderr

    return created


@pytest.fixture(scope="session")
def apply(defined):
    """Apply objects as a person does, with kubectl; returns the exit code and what it said."""

    def applied(*objects):
        sent = json.dumps({"apiVersion": "v1", "kind": "List", "items": list(objects)})
        done = defined.kubectl("apply", "-f", "-", sent=sent)
        return done.returncode, done.stdout + done.stderr

    return applied
