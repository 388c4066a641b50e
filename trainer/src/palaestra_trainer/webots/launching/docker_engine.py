"""Connect to a Docker Engine, and report its refusals with their remedies.

This module and those that import it need the package docker, which is optional.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any

import docker
from docker.errors import APIError, DockerException, NotFound
from requests.exceptions import RequestException

from palaestra_trainer.errors import ConfigurationError, SimulatorHung

_CALL_S = 20
_STOP_S = 5
_REMEDIES = (
    ("No such image", "build or load it first: `make images`, or `docker pull` for an image of a registry"),
    ("could not select device driver", "install the NVIDIA Container Toolkit, or leave gpus out"),
    ("executable file not found", "use an image that has palaestra-sidecar"),
    ("bind source path does not exist", "the engine must run on the machine that has the world"),
)


def connected() -> Any:
    """Return a client of the Docker Engine that DOCKER_HOST names, or of the engine of this machine.

    Raises:
        ConfigurationError: no engine responds.
    """
    try:
        return docker.from_env(timeout=_CALL_S)
    except DockerException as error:
        where = os.environ.get("DOCKER_HOST") or "unix:///var/run/docker.sock"
        raise ConfigurationError(
            f"launcher docker: no Docker Engine responds at {where} ({_innermost(error)}); start it, set "
            "DOCKER_HOST, or give this user the right to use it"
        ) from error


@contextlib.contextmanager
def engine_errors(image: str) -> Iterator[None]:
    """Convert the errors of the Docker SDK in this block to ConfigurationError."""
    try:
        yield
    except (DockerException, RequestException) as error:
        fact = str(getattr(error, "explanation", None) or error)
        remedy = next((remedy for words, remedy in _REMEDIES if words in fact), None)
        raise ConfigurationError(
            f"launcher docker: {image}: {fact}{f'; {remedy}' if remedy else ''}"
        ) from error


def ended(container: Any) -> None:
    """End a container, and wait until the engine has removed it; a container that is gone is ignored.

    Raises:
        ConfigurationError: the engine does not respond.
        SimulatorHung: the engine cannot end the container.
    """
    with engine_errors(container.id), contextlib.suppress(NotFound):
        with contextlib.suppress(APIError):  # the container was never started, or is being removed
            container.stop(timeout=_STOP_S)  # the sidecar ends at SIGTERM
        with contextlib.suppress(APIError):
            container.remove(force=True)
        with contextlib.suppress(APIError):
            container.wait(condition="removed", timeout=_CALL_S)
        container.reload()
        raise SimulatorHung(container.name, "the Docker Engine cannot end its container")


def _innermost(error: BaseException) -> BaseException:
    while error.__context__ is not None:
        error = error.__context__
    return error
