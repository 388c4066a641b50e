"""The constructor parameters of a class whose `**kwargs` go to the class that it extends."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, get_type_hints

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecEnv

from palaestra_trainer.job.user_code.kwargs import named, takes_any

Configurable = type[BaseAlgorithm] | type[BasePolicy]


@cache
def parameters(cls: Configurable) -> Mapping[str, inspect.Parameter]:
    """Return the named parameters of a class by name, including parameters behind its `**kwargs`."""
    found: dict[str, inspect.Parameter] = {}
    for constructor in _constructors(cls):
        these = named(inspect.signature(constructor))
        found |= {name: parameter for name, parameter in these.items() if name not in found}
    return MappingProxyType(found)


def types(cls: Configurable) -> Mapping[str, Any]:
    """Return the annotations of `parameters(cls)`; Any if an annotation is missing or cannot be resolved."""
    found: dict[str, Any] = {}
    for constructor in _constructors(cls):
        found = _hints(constructor) | found
    return dict.fromkeys(parameters(cls), Any) | found


def _constructors(cls: type[object]) -> Iterator[Any]:
    """Yield the constructors of a class and its ancestors, up to the first without `**kwargs`."""
    for ancestor in cls.__mro__:
        constructor = vars(ancestor).get("__init__")
        if constructor is None:
            continue
        yield constructor
        if not takes_any(inspect.signature(constructor)):
            return


def _hints(constructor: Any) -> dict[str, Any]:
    try:
        # Stable-Baselines3 uses VecEnv in annotations, but imports it only for type checkers.
        return get_type_hints(constructor, localns={"VecEnv": VecEnv})
    except NameError:
        return {}
