"""Entry points for `gymnasium.make`: environments with a given robot, or with one that this module finds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.environments.deliver import DeliverEnv
from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.move_to_target_goal import MoveToTargetGoalEnv
from palaestra_trainer.environments.navigate import NavigateEnv
from palaestra_trainer.environments.options import (
    DeliverOptions,
    GoalOptions,
    NavigateOptions,
    SeeOptions,
    parse,
    parse_as,
)
from palaestra_trainer.environments.see_target import SeeTargetEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotAbc, Scene

_ARENA = ("arena", "stub")
_SEEING = ("seeing", "mujoco")
_COURT = ("court", "stub")


def own_world(environment: str) -> tuple[str, str]:
    """Return world and driver of the simulator that an environment with this id starts for itself."""
    return {"SeeTarget-v0": _SEEING, "Navigate-v0": _COURT}.get(environment.rpartition(":")[2], _ARENA)


def make(
    robot: RobotAbc | None = None,
    scene: Scene | None = None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None = None,
    role: str = Role.COLLECT,
    **options: Any,
) -> MoveToTargetEnv:
    """Return the environment for `gymnasium.make("MoveToTargetEnv-v0", ...)`.

    Args:
        robot: the robot to drive, given together with its `scene`.
        scene: arranges episodes.
        simulator: called for robot and scene if they are not given, once for each environment of
            `make_vec`. `palaestra_trainer.testing.fake_arena` needs no simulator.
        role: without `robot` and `simulator`, the environment takes the newest `Webots` facade of this
            process, else the first simulator of PALAESTRA_CONFIG with this role that no environment of any
            process uses. Without PALAESTRA_CONFIG it starts a stub, which ends with `close()` or with this
            process.
        options: see `Options`; names of movements and parts are text.

    Raises:
        ConfigurationError: an option is wrong, or no simulator with this role is left.
    """
    chosen = parse(options)
    place = _place(robot, scene, simulator, role)
    return _made(MoveToTargetEnv, place, chosen)


def make_delivering(
    robot: RobotAbc | None = None,
    scene: Scene | None = None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None = None,
    role: str = Role.COLLECT,
    **options: Any,
) -> DeliverEnv:
    """Return the environment for `gymnasium.make("Deliver-v0", ...)`.

    Arguments and errors are those of `make`, and `options` are those of `DeliverOptions`.
    """
    chosen = parse_as(DeliverOptions, options)
    place = _place(robot, scene, simulator, role)
    return _made(DeliverEnv, place, chosen)


def make_navigating(
    robot: RobotAbc | None = None,
    scene: Scene | None = None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None = None,
    role: str = Role.COLLECT,
    **options: Any,
) -> NavigateEnv:
    """Return the environment for `gymnasium.make("Navigate-v0", ...)`.

    Args:
        robot: see `make`; it has the capabilities that `NavigateEnv` needs.
        scene: see `make`.
        simulator: see `make`. `palaestra_trainer.testing.fake_court` needs no simulator.
        role: see `make`. Without PALAESTRA_CONFIG it starts a stub with the world `court`.
        options: see `NavigateOptions`.

    Raises:
        ConfigurationError: an option is wrong, or no simulator with this role is left.
        MissingCapability: the robot does not fit.
    """
    chosen = parse_as(NavigateOptions, options)
    place = _place(robot, scene, simulator, role, _COURT)
    return _made(NavigateEnv, place, chosen)


def make_goal(
    robot: RobotAbc | None = None,
    scene: Scene | None = None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None = None,
    role: str = Role.COLLECT,
    **options: Any,
) -> MoveToTargetGoalEnv:
    """Return the environment for `gymnasium.make("MoveToTargetGoalEnv-v0", ...)`.

    Args:
        robot: see `make`.
        scene: see `make`.
        simulator: see `make`.
        role: see `make`.
        options: see `GoalOptions`; names of movements and parts are text.

    Raises:
        ConfigurationError: an option is wrong, or no simulator with this role is left.
    """
    chosen = parse_as(GoalOptions, options)
    place = _place(robot, scene, simulator, role)
    return _made(MoveToTargetGoalEnv, place, chosen)


def make_seeing(
    robot: RobotAbc | None = None,
    scene: Scene | None = None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None = None,
    role: str = Role.COLLECT,
    **options: Any,
) -> SeeTargetEnv:
    """Return the environment for `gymnasium.make("SeeTarget-v0", ...)`.

    Args:
        robot: see `make`; it has a color camera.
        scene: see `make`.
        simulator: see `make`. `palaestra_trainer.testing.fake_seeing` needs no simulator.
        role: see `make`. Without PALAESTRA_CONFIG it starts MuJoCo, because the stub renders no images.
        options: see `SeeOptions`; names of movements are text.

    Raises:
        ConfigurationError: an option is wrong, no simulator with this role is left, or MuJoCo is missing.
        NoSuchSensor: the robot has no color camera.
    """
    chosen = parse_as(SeeOptions, options)
    place = _place(robot, scene, simulator, role, _SEEING)
    return _made(SeeTargetEnv, place, chosen)


class _Place(NamedTuple):
    """The robot and scene of an environment, and the function that releases their simulator."""

    robot: Any  # the environment checks that the robot has the capabilities that it needs
    scene: Scene
    release: Callable[[], None] | None = None


def _place(
    robot: RobotAbc | None,
    scene: Scene | None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None,
    role: str,
    own: tuple[str, str] = _ARENA,
) -> _Place:
    """Return robot and scene: those given, those of `simulator()`, else those of `simulator_for`."""
    if (robot is None) != (scene is None):
        raise ConfigurationError("robot, scene: only one of them was given; give both or neither")
    if robot is not None and scene is not None:
        return _Place(robot, scene)
    if simulator is not None:
        return _Place(*simulator())
    from palaestra_trainer.simulators.configured import simulator_for  # noqa: PLC0415 - it needs ROS

    taken = simulator_for(role_of(role), *own)
    return _Place(taken.robot, taken.scene, taken.release)


_Made = TypeVar("_Made")


def _made(kind: Callable[..., _Made], place: _Place, options: object) -> _Made:
    """Return an environment with the robot and scene of a place; release the place if that fails."""
    try:
        return kind(place.robot, place.scene, options, place.release)
    except BaseException:
        if place.release is not None:
            place.release()
        raise


def role_of(name: str) -> Role:
    """Return the role of that name.

    Raises:
        ConfigurationError: no role has this name.
    """
    if name not in set(Role):
        raise ConfigurationError(f'role: "{name}" does not exist; choose {" or ".join(Role)}')
    return Role(name)
