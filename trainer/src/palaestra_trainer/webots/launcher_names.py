"""The launchers that a program may choose by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.attached import Attached
from palaestra_trainer.webots.launching.docker_launcher import Docker
from palaestra_trainer.webots.launching.kubernetes_launcher import Kubernetes
from palaestra_trainer.webots.launching.launcher import Launcher, Place
from palaestra_trainer.webots.launching.local_simulator import ThisMachine

LauncherName = Literal["process", "docker", "kubernetes", "attach"]

_LAUNCHERS: Mapping[str, Callable[[], Place | Launcher]] = MappingProxyType(
    {"process": ThisMachine, "docker": Docker, "kubernetes": Kubernetes, "attach": Attached}
)


def launcher_named(name: str) -> Place | Launcher:
    """Return a new launcher with its default settings.

    Raises:
        ConfigurationError: no launcher has this name.
    """
    if name not in _LAUNCHERS:
        names = ", ".join(f'"{known}"' for known in _LAUNCHERS)
        raise ConfigurationError(f'launcher: "{name}" is not a launcher; choose one of {names}')
    return _LAUNCHERS[name]()
