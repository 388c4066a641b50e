"""Create the environment of a job, from any registered class.

The environment gets the arguments `robot`, `scene` and `reward` if its signature accepts them. This module
reports mismatches before a simulator starts.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import gymnasium
from gymnasium.envs.registration import (
    EnvSpec,
    find_highest_version,
    get_env_id,
    parse_env_id,
)

from palaestra_trainer.environments import wrappers
from palaestra_trainer.environments.batched import BatchedEnv
from palaestra_trainer.environments.env_checker import held
from palaestra_trainer.errors import ConfigurationError, TrainerError, fact_of
from palaestra_trainer.job.configuration import DEFAULT_REWARD, Environment
from palaestra_trainer.job.user_code import imports
from palaestra_trainer.job.user_code.kwargs import AcceptedArguments
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.robots.batched_base import BatchedRobotAbc, BatchedSceneAbc
from palaestra_trainer.robots.capabilities import require

_OF_MAKE = ("max_episode_steps",)  # this argument belongs to gymnasium.make, not to the environment


def make_environment(wanted: Environment, robot: RobotAbc, scene: Scene) -> gymnasium.Env[Any, Any]:
    """Return the environment of a job with `robot` and `scene`, in a wrapper that checks its results.

    Raises:
        ConfigurationError: the environment is not registered, or its signature does not fit the job.
        MissingCapability: the robot lacks a capability in the environment's `needs`.
    """
    arguments = _checked(wanted, {"robot": robot, "scene": scene})
    require(robot, getattr(_creator(wanted.id, _spec(wanted.id)), "needs", ()), wanted.id)
    try:
        # `held` replaces gymnasium's checker, because that checker mostly warns, and a warning would not end
        # the run.
        env = gymnasium.make(wanted.id, disable_env_checker=True, **arguments)
    except TrainerError:
        raise
    except Exception as error:  # the constructor is code of the user, which may raise anything
        raise ConfigurationError(
            f"environment.id: {wanted.id} cannot be created ({fact_of(error)}); "
            "fix it, or change environment.options"
        ) from error
    return held(wrappers.wrapped(env, wanted), wanted.id)


def make_batched(wanted: Environment, robot: BatchedRobotAbc, scene: BatchedSceneAbc) -> BatchedEnv:
    """Return the batched form of a job's environment, which is its `vector_entry_point`.

    Raises:
        ConfigurationError: the environment has no batched form, or it does not fit the job or the robot.
    """
    spec = _spec(wanted.id)
    creator = _batched_creator(wanted, spec)
    taken = AcceptedArguments(creator, wanted.id)
    offered = {"robot": robot, "scene": scene, "reward": wanted.reward}
    arguments = copy.deepcopy(spec.kwargs)  # a registration may be used again
    arguments |= {name: value for name, value in offered.items() if taken.accepts(name)}
    arguments |= wanted.options
    if mistakes := [*_mistakes(wanted, taken, set(arguments))]:
        raise ConfigurationError("\n".join(mistakes))
    try:
        env = creator(**arguments)
    except TrainerError:
        raise
    except Exception as error:  # the constructor is code of the user, which may raise anything
        raise ConfigurationError(
            f"environment.id: the batched form of {wanted.id} cannot be created ({fact_of(error)}); fix it"
        ) from error
    if not isinstance(env, BatchedEnv):
        raise ConfigurationError(
            f"environment.id: the vector_entry_point of {wanted.id} is not a BatchedEnv; derive it from "
            "palaestra_trainer.environments.batched.BatchedEnv"
        )
    if not isinstance(robot, env.needs or (object,)):
        raise ConfigurationError(
            f"trainer.robot: the batched form of {wanted.id} needs {env.needs[0].__name__}, but the robot's"
            f" form is {type(robot).__name__}; choose another robot"
        )
    return env


def _batched_creator(wanted: Environment, spec: EnvSpec) -> Callable[..., Any]:
    """Return the function or class that creates the batched form.

    Raises:
        ConfigurationError: the environment has no batched form, or the job changes its steps.
    """
    creator = spec.vector_entry_point
    if isinstance(creator, str):
        creator = imports.object_named(creator, f"environment.id: the vector_entry_point of {wanted.id}")
    if creator is None or not getattr(getattr(creator, "environment_class", creator), "batched", False):
        raise ConfigurationError(
            f"environment.id: {wanted.id} has no batched form, which simulators[].batch needs; register a "
            "vector_entry_point with batched = True, or remove batch"
        )
    changes = {
        "environment.wrappers": wanted.wrappers,
        "environment.frameStack": wanted.frame_stack,
        "environment.options.max_episode_steps": wanted.options.get("max_episode_steps"),
        "environment.id, max_episode_steps of its registration": spec.max_episode_steps,
        "environment.id, additional_wrappers of its registration": spec.additional_wrappers,
    }
    for field, value in changes.items():
        if value:
            raise ConfigurationError(f"{field}: has no batched form; remove it, or remove simulators[].batch")
    return creator


def keywords(wanted: Environment) -> dict[str, Any]:
    """Return the keyword arguments that a job passes to its environment, without robot and scene.

    Raises:
        ConfigurationError: the environment is not registered, or its signature does not fit the job.
    """
    given = _checked(wanted, dict.fromkeys(("robot", "scene")))
    return {name: value for name, value in given.items() if name not in {"robot", "scene"}}


def creator_of(name: str) -> Callable[..., Any]:
    """Return the class or function that creates the environments of a registered name.

    Raises:
        ConfigurationError: the name is not registered, or its entry point does not exist.
    """
    return _creator(name, _spec(name))


def _checked(wanted: Environment, simulated: Mapping[str, Any]) -> dict[str, Any]:
    spec = _spec(wanted.id)
    taken = AcceptedArguments(_creator(wanted.id, spec), wanted.id)
    offered = {**simulated, "reward": wanted.reward}
    accepted = {name: value for name, value in offered.items() if taken.accepts(name)}
    arguments = {**accepted, **wanted.options}
    if mistakes := [*_mistakes(wanted, taken, {*spec.kwargs, *arguments}), *wrappers.mistakes(wanted)]:
        raise ConfigurationError("\n".join(mistakes))
    return arguments


def _mistakes(wanted: Environment, taken: AcceptedArguments, given: set[str]) -> Iterator[str]:
    if not {"robot", "scene"} & given:
        yield (
            f"environment.id: {wanted.id} accepts neither robot nor scene, so no simulator would be used; "
            "add one of these arguments, or **kwargs"
        )
    if wanted.reward != DEFAULT_REWARD and "reward" not in given:
        yield f"environment.reward: {wanted.id} has no argument reward; remove it, or add the argument"
    options = [name for name in wanted.options if name not in _OF_MAKE]
    yield from taken.mistakes("environment.options", options, given)


def _spec(name: str) -> EnvSpec:
    """Return the registration of a name in the syntax of `gymnasium.make`."""
    module, _, registered = name.rpartition(":")
    if module:
        imports.module_named(module, f"environment.id: {name}")
    try:
        space, plain, version = parse_env_id(registered)
        return gymnasium.spec(get_env_id(space, plain, version or find_highest_version(space, plain)))
    except gymnasium.error.Error as error:
        raise ConfigurationError(
            f"environment.id: {name} cannot be created ({error}); use a registered name, "
            "or module:name with the module that registers it"
        ) from error


def _creator(name: str, spec: EnvSpec) -> Callable[..., Any]:
    """Return the class or function that creates the environment."""
    creator = spec.entry_point
    if isinstance(creator, str):
        found: Callable[..., Any] = imports.object_named(
            creator, f"environment.id: the entry point {creator} of {name}"
        )
        return found
    if creator is None:
        raise ConfigurationError(
            f"environment.id: {name} is registered without an entry_point; add one to its registration"
        )
    return creator
