"""Packages that only one launcher needs, each an extra of palaestra-trainer with the name of the launcher."""

from __future__ import annotations

import importlib.util

from palaestra_trainer.errors import ConfigurationError


def require_package(name: str) -> None:
    """Check that the package of the launcher `name` is installed.

    Raises:
        ConfigurationError: the package is missing; the message names the extra.
    """
    if importlib.util.find_spec(name) is None:
        raise ConfigurationError(
            f"launcher {name}: the Python package {name} is not installed; install palaestra-trainer[{name}]"
        )
