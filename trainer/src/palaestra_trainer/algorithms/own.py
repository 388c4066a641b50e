"""Classes that a job names as `module:Class`: algorithms, policies and parts of policies.

The module is imported from where Python finds it: the image, or PYTHONPATH.
"""

from __future__ import annotations

import importlib
import re
from typing import Any

from palaestra_trainer.errors import ConfigurationError

NAME = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


def names_class(value: Any) -> bool:
    """Return whether a value is text of the form `module:Class`."""
    return isinstance(value, str) and NAME.fullmatch(value) is not None


def class_named(name: str, field: str, base: type[Any]) -> type[Any]:
    """Return the class that `name` names, a subclass of `base`.

    Args:
        name: `module:Class`.
        field: field of the job, for messages.
        base: the class that it must be a subclass of.

    Raises:
        ConfigurationError: it cannot be imported, or is not such a class.
    """
    module, _, attribute = name.partition(":")
    try:
        found = getattr(importlib.import_module(module), attribute)
    except Exception as error:  # an import runs the user's code, which may raise anything
        raise ConfigurationError(
            f"{field}: {name} cannot be imported ({type(error).__name__}: {error}); "
            "install its package in the image, or add its folder to PYTHONPATH"
        ) from error
    if not (isinstance(found, type) and issubclass(found, base)):
        raise ConfigurationError(
            f"{field}: {name} is no subclass of {base.__name__}; name a class that is one"
        )
    return found
