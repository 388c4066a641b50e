"""Check the values of hyperparameters against a constructor's signature, and convert them to its types.

A job is YAML, which cannot contain a schedule, a tuple or a class. A job writes a schedule as text, as points
or as the name of a function, see `schedules`. For a tuple, the job writes a list.
Activation functions and optimizers have their PyTorch names. For every argument of a policy that is a class,
the job may write `module:Class`.
"""

from __future__ import annotations

import collections.abc
import re
from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_origin

from pydantic import ConfigDict, TypeAdapter, ValidationError
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn, optim

from palaestra_trainer.algorithms.constructor_params import types
from palaestra_trainer.algorithms.schedules import own_schedule, schedule_of
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import nearest
from palaestra_trainer.job.user_code import imports

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
# For each of these arguments of a policy, the job must name a subclass of the class on the right.
BASES: Mapping[str, type[Any]] = {
    "activation_fn": nn.Module,
    "optimizer_class": optim.Optimizer,
    "features_extractor_class": BaseFeaturesExtractor,
}
# Files of RL-Zoo write PyTorch's classes with their module, such as `th.nn.Tanh` or `nn.Tanh`.
_MODULE = re.compile(r"^((torch|th)\.)?(nn|optim)\.(?=\w+$)")
_GIVEN = frozenset({"self", "observation_space", "action_space", "lr_schedule", "use_sde", "return"})
_WORDS = {int: "a whole number", float: "a number", bool: "true or false", str: "text", type(None): "null"}


def mistakes(
    cls: type[BaseAlgorithm], policy: type[BasePolicy], hyperparameters: Mapping[str, Any]
) -> Iterator[str]:
    """Yield a message with field, fact and remedy for each value that the class or its policy rejects."""
    known = types(cls)
    for name, value in hyperparameters.items():
        annotation = known.get(name, Any)
        if _takes_schedule(annotation) and imports.names_class(value):
            yield from _mistakes_of_schedule(f"{FIELD}.{name}", value)
        elif fact := _refused(value, annotation):
            yield f"{FIELD}.{name}: {fact}"
        elif name == "policy_kwargs" and value:
            yield from _mistakes_of_policy(policy, value)


def arguments(cls: type[BaseAlgorithm], hyperparameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword arguments that these hyperparameters set for the class.

    Raises:
        ConfigurationError: a class that a hyperparameter names cannot be imported.
    """
    known = types(cls)
    chosen = {name: _argument(name, value, known.get(name, Any)) for name, value in hyperparameters.items()}
    policy = chosen.get("policy_kwargs") or {}
    chosen["policy_kwargs"] = {name: _class(name, value) or value for name, value in policy.items()}
    return chosen


def policy_class(cls: type[BaseAlgorithm], named: str | type[BasePolicy] | None) -> type[BasePolicy]:
    """Return the policy whose arguments a job may set: the job's own policy, or else the MLP policy."""
    if isinstance(named, type):
        return named
    aliases = cls.policy_aliases
    usual = next((policy for name, policy in aliases.items() if name.startswith("Mlp")), BasePolicy)
    return aliases[named] if named else usual


def arguments_of(policy: type[BasePolicy]) -> list[str]:
    """Return the arguments of a policy that a job may set."""
    return [name for name in types(policy) if name not in _GIVEN]


def _mistakes_of_policy(policy: type[BasePolicy], given: Mapping[str, Any]) -> Iterator[str]:
    known, names = types(policy), arguments_of(policy)
    for name, value in given.items():
        field = f"{FIELD}.policy_kwargs.{name}"
        if name not in names:
            yield f"{field}: the policy has no such argument; {nearest(name, names)}"
        elif imports.names_class(value):
            yield from _mistakes_of_class(field, value)
        elif name in CLASSES:
            if _class(name, value) is None:
                yield (
                    f"{field}: {value!r} is not known; {nearest(_bare(str(value)), dict(CLASSES[name]))}, "
                    "or write module:Class"
                )
        elif name == "net_arch" and _has_shared_layers(value):
            yield (
                f"{field}: {value!r} has shared layers, which Stable-Baselines3 removed in 1.8; "
                "write {pi: [...], vf: [...]}, or a list of numbers for both"
            )
        elif fact := _refused(value, known[name]):
            yield f"{field}: {fact}"


def _has_shared_layers(layers: Any) -> bool:
    return isinstance(layers, list) and any(isinstance(layer, dict) for layer in layers)


def _mistakes_of_class(field: str, name: str) -> Iterator[str]:
    base = BASES.get(field.rpartition(".")[2], object)
    try:
        imports.class_named(name, field, base)
    except ConfigurationError as error:
        yield str(error)


def _mistakes_of_schedule(field: str, name: str) -> Iterator[str]:
    try:
        own_schedule(name, field)
    except ConfigurationError as error:
        yield str(error)


def _class(argument: str, name: Any) -> type[Any] | None:
    """Return the class that a policy's argument names: `module:Class`, or a name in PyTorch.

    A PyTorch name may include its module, as in `torch.nn.Tanh`, `th.nn.Tanh` or `nn.Tanh`. Upper and lower
    case make no difference.
    """
    if imports.names_class(name):
        return imports.class_named(name, f"{FIELD}.policy_kwargs.{argument}", BASES.get(argument, object))
    by_name = {known.lower(): cls for known, cls in CLASSES.get(argument, {}).items()}
    return by_name.get(_bare(name).lower()) if isinstance(name, str) else None


def _bare(name: str) -> str:
    """Return the name of a class without its module, if the module is PyTorch's."""
    return _MODULE.sub("", name, count=1)


def _refused(value: Any, annotation: Any) -> str:
    """Return the reason why a value does not match an annotation, as text; "" if the value matches."""
    if get_origin(annotation) is type:
        return f"{value!r} is refused; name a class as module:Class"
    config = ConfigDict(arbitrary_types_allowed=True)
    try:
        TypeAdapter(annotation, config=config).validate_python(_as_python(value, annotation), strict=True)
    except ValidationError:
        return f"{value!r} is refused; give {_words(annotation)}"
    return ""


def _argument(name: str, value: Any, annotation: Any) -> Any:
    if _takes_schedule(annotation) and imports.names_class(value):
        return own_schedule(value, f"{FIELD}.{name}")
    return _as_python(value, annotation)


def _as_python(value: Any, annotation: Any) -> Any:
    if isinstance(value, list) and tuple in _kinds(annotation):
        return tuple(value)
    if _takes_schedule(annotation) and (schedule := schedule_of(value)):
        return schedule
    return value


def _takes_schedule(annotation: Any) -> bool:
    return collections.abc.Callable in _kinds(annotation)


def _kinds(annotation: Any) -> set[Any]:
    return {get_origin(kind) or kind for kind in (annotation, *get_args(annotation))}


def _words(annotation: Any) -> str:
    """Return the values that an annotation accepts, in the words of YAML."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if annotation in _WORDS:
        return _WORDS[annotation]
    if collections.abc.Callable in {origin, annotation}:
        return "a schedule such as lin_0.001 or [[0, 0.001], [1, 0.0001]], or module:function"
    if origin is tuple:
        return "a list of " + " and ".join(map(_words, parts))
    if origin in {list, dict}:
        return {list: "a list", dict: "a mapping"}[origin]
    return " or ".join(map(_words, sorted(parts, key=_place_in_words))) if parts else str(annotation)


def _place_in_words(part: Any) -> int:
    """Return a key for the order of a union's parts, which differs between releases of Stable-Baselines3."""
    if collections.abc.Callable in {get_origin(part), part}:
        return 2  # the words of a schedule contain a comma, so nothing may follow them
    return 1 if part is type(None) else 0
