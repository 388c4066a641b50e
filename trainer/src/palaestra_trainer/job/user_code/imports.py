"""Import the code of a job's author: robots, environments, algorithms, policies and callbacks.

A job names a class as `module:Class`. Python finds the module in the image or in PYTHONPATH. An import runs
the author's code, which may raise any exception. So every exception becomes a ConfigurationError with the
name, the fact and the remedy.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from palaestra_trainer.errors import ConfigurationError, fact_of

_INSTALL = "install its package in the image, or add its folder to PYTHONPATH"
NAME = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


def names_class(value: Any) -> bool:
    """Return whether a value is text of the form `module:Class`."""
    return isinstance(value, str) and NAME.fullmatch(value) is not None


def class_named(name: str, field: str, base: type[Any]) -> type[Any]:
    """Import the class `name`, check that it is a subclass of `base`, and return it.

    Args:
        name: `module:Class`.
        field: field of the job, for messages.
        base: the class that the named class must extend.

    Raises:
        ConfigurationError: the class cannot be imported, or is not a subclass of `base`.
    """
    found = object_named(name, f"{field}: {name}")
    if not (isinstance(found, type) and issubclass(found, base)):
        raise ConfigurationError(f"{field}: {name} is not a subclass of {base.__name__}; name a subclass")
    return found


def object_named(name: str, subject: str) -> Any:
    """Import and return the object `name`.

    Args:
        name: `module:object`.
        subject: beginning of error messages, a field of the job and its value.

    Raises:
        ConfigurationError: the import failed, or the name does not exist.
    """
    module, _, attribute = name.partition(":")
    found = module_named(module, subject)
    with _reported(subject, "correct the name"):  # access to an attribute may import a part of the module
        return getattr(found, attribute)


def module_named(name: str, subject: str) -> ModuleType:
    """Import and return the module with this name; for `subject` see `object_named`.

    Raises:
        ConfigurationError: the import failed, or the name does not exist.
    """
    with _reported(subject, "correct the module", _INSTALL):
        return importlib.import_module(name)


@contextmanager
def _reported(subject: str, remedy: str, if_missing: str | None = None) -> Iterator[None]:
    """Convert errors of the block to a ConfigurationError; `if_missing` is the remedy for an ImportError."""
    try:
        yield
    except (Exception, SystemExit) as error:  # the author's code may raise anything, and a script may exit
        remedy = if_missing if if_missing and isinstance(error, ImportError) else remedy
        raise ConfigurationError(f"{subject} cannot be imported ({fact_of(error)}); {remedy}") from error
