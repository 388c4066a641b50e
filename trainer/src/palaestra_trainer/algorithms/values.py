"""The values of hyperparameters: checked against a signature, and converted to what it takes.

A job cannot contain a schedule, a tuple or a class. So "lin_0.001" stands for a schedule from 0.001 at the
start to 0 at the end, and a list for a tuple. Activation functions and optimizers have their PyTorch names.
"""

from __future__ import annotations

import collections.abc
import re
from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_origin, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv
from torch import nn, optim

from palaestra_trainer.configuration import nearest

LINEAR = re.compile(r"lin_(\d+(?:\.\d*)?(?:e-?\d+)?)")
FIELD = "algorithm.hyperparameters"
CLASSES: Mapping[str, Mapping[str, type[Any]]] = {
    "activation_fn": {
        it.__name__: it
        for it in (nn.ELU, nn.GELU, nn.LeakyReLU, nn.Mish, nn.ReLU, nn.SELU, nn.SiLU, nn.Softplus, nn.Tanh)
    },
    "optimizer_class": {
        it.__name__: it
        for it in (optim.Adam, optim.AdamW, optim.NAdam, optim.RAdam, optim.RMSprop, optim.SGD)
    },
}
_GIVEN = frozenset({"self", "observation_space", "action_space", "lr_schedule", "use_sde", "return"})
_WORDS = {int: "a whole number", float: "a number", bool: "true or false", str: "text", type(None): "null"}


def mistakes(cls: type[BaseAlgorithm], hyperparameters: Mapping[str, Any]) -> Iterator[str]:
    """Yield field, fact and remedy of each value that the class does not accept; its names are known."""
    types = _types(cls)
    for name, value in hyperparameters.items():
        if fact := _refused(value, types[name]):
            yield f"{FIELD}.{name}: {fact}"
        elif name == "policy_kwargs" and value:
            yield from _mistakes_of_policy(_types(cls.policy_aliases["MlpPolicy"]), value)


def arguments(cls: type[BaseAlgorithm], hyperparameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword arguments of the class for these hyperparameters."""
    types = _types(cls)
    chosen = {name: _as_python(value, types[name]) for name, value in hyperparameters.items()}
    policy = chosen.get("policy_kwargs") or {}
    chosen["policy_kwargs"] = {name: _class(name, value) or value for name, value in policy.items()}
    return chosen


def _mistakes_of_policy(types: Mapping[str, Any], given: Mapping[str, Any]) -> Iterator[str]:
    known = [name for name in types if name not in _GIVEN]
    for name, value in given.items():
        field = f"{FIELD}.policy_kwargs.{name}"
        if name not in known:
            yield f"{field}: the policy has no such argument; {nearest(name, known)}"
        elif name in CLASSES:
            if _class(name, value) is None:
                yield f"{field}: {value!r} is not known; {nearest(str(value), dict(CLASSES[name]))}"
        elif fact := _refused(value, types[name]):
            yield f"{field}: {fact}"


def _class(argument: str, name: Any) -> type[Any] | None:
    """Return the PyTorch class for a policy's argument, in any case; None if there is none of that name."""
    by_name = {known.lower(): cls for known, cls in CLASSES.get(argument, {}).items()}
    return by_name.get(name.lower()) if isinstance(name, str) else None


def _refused(value: Any, annotation: Any) -> str:
    """Return why a value does not match an annotation, as text; "" if it does."""
    if get_origin(annotation) is type:
        return f"{value!r} is refused; a job cannot name this class, leave it out"
    config = ConfigDict(arbitrary_types_allowed=True)
    try:
        TypeAdapter(annotation, config=config).validate_python(_as_python(value, annotation), strict=True)
    except ValidationError:
        return f"{value!r} is refused; give {_words(annotation)}"
    return ""


def _as_python(value: Any, annotation: Any) -> Any:
    kinds = {get_origin(kind) for kind in (annotation, *get_args(annotation))}
    if isinstance(value, list) and tuple in kinds:
        return tuple(value)
    if isinstance(value, str) and collections.abc.Callable in kinds and (number := LINEAR.fullmatch(value)):
        return LinearSchedule(float(number[1]), 0.0, 1.0)
    return value


def _words(annotation: Any) -> str:
    """Return the accepted values of an annotation, in words for a person who writes YAML."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if annotation in _WORDS:
        return _WORDS[annotation]
    if origin is collections.abc.Callable:
        return "a schedule such as lin_0.001"
    if origin is tuple:
        return "a list of " + " and ".join(map(_words, parts))
    if origin in {list, dict}:
        return {list: "a list", dict: "a mapping"}[origin]
    return " or ".join(map(_words, parts)) if parts else str(annotation)


def _types(cls: type[Any]) -> dict[str, Any]:
    # Stable-Baselines3 uses VecEnv in a type, and imports it only for type checkers.
    return get_type_hints(cls.__init__, localns={"VecEnv": VecEnv})
