"""Fixtures: an API server that misbehaves, a real API server, and clients of both."""

import itertools
import json
import os
from types import SimpleNamespace

import pytest

from palaestra.cluster import Timeouts, connect
from palaestra.cluster.resources import NAMESPACES
from palaestra.cluster.timeouts import Backoff
from tests.integration.apiserver.server import serving

HASTE = Timeouts(
    connect_s=1, call_s=1, silence_s=0.5, again=Backoff(first_s=0.05, cap_s=0.2, chance=lambda: 0.0)
)
numbers = itertools.count(1)


def write_kubeconfig(path, server, user):
    """Write a kubeconfig with the contexts `usual`, which is the current one, and `other`."""
    content = {
        "clusters": [{"name": "here", "cluster": {"server": server}}],
        "users": [{"name": "me", "user": user}, {"name": "other", "user": {"token": "other-token"}}],
        "contexts": [
            {"name": "usual", "context": {"cluster": "here", "user": "me"}},
            {"name": "other", "context": {"cluster": "here", "user": "other"}},
        ],
        "current-context": "usual",
    }
    path.write_text(json.dumps(content))
    return str(path)


@pytest.fixture
def rude(tmp_path):
    """Return a server whose responses a test prepares, and a client of it with short timeouts."""
    with serving() as (address, script):
        kubeconfig = write_kubeconfig(tmp_path / "kubeconfig", address, {"token": "my-token"})
        api = connect(kubeconfig, limits=HASTE)
        yield SimpleNamespace(address=address, script=script, api=api, kubeconfig=kubeconfig)
        api.close()


@pytest.fixture(scope="session")
def real(control_plane):
    """Return a client of a real API server, as administrator."""
    api = connect(str(control_plane.kubeconfig))
    yield api
    api.close()


@pytest.fixture
def namespace(real):
    """Return the name of a new namespace for the test."""
    name = f"test-{next(numbers)}-{os.getpid()}"
    real.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": name}})
    return name
