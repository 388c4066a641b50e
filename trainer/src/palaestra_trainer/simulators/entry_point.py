"""Entry points for `gymnasium.make`; each creates an environment with a given robot, or finds a simulator."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Generic, NamedTuple, TypeVar

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.environments.batched_move_to_target import BatchedMoveToTargetEnv
from palaestra_trainer.environments.deliver import DeliverEnv
from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.move_to_target_goal import MoveToTargetGoalEnv
from palaestra_trainer.environments.navigate import NavigateEnv
from palaestra_trainer.environments.options import (
    DeliverOptions,
    GoalOptions,
    MoveToTargetOptions,
    NavigateOptions,
    SeeOptions,
    parse_as,
)
from palaestra_trainer.environments.see_target import SeeTargetEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.robots.batched_base import BatchedRobotAbc, BatchedSceneAbc

_Made = TypeVar("_Made")
_Options = type[MoveToTargetOptions | SeeOptions | NavigateOptions]

_ARENA = ("arena", "stub")
_WORLDS = {"SeeTarget-v0": ("seeing", "mujoco"), "Navigate-v0": ("court", "stub")}


def own_world(environment: str) -> tuple[str, str]:
    """Return world and driver of the simulator that an environment with this id starts if it needs one."""
    return _WORLDS.get(environment.rpartition(":")[2], _ARENA)


class EntryPoint(Generic[_Made]):
    """Creates environments with one id for `gymnasium.make`.

    Args:
        environment: the id of the environment.
        kind: the class of the environment.
        options: the class of the environment's options.

    Attributes:
        environment_class: the class of the environment; its docstring describes the task.
    """

    def __init__(self, environment: str, kind: Callable[..., _Made], options: _Options) -> None:
        self.environment_class = kind
        self._options = options
        self._own = own_world(environment)

    def __call__(
        self,
        robot: RobotAbc | None = None,
        scene: Scene | None = None,
        simulator: Callable[[], tuple[RobotAbc, Scene]] | None = None,
        role: str = Role.COLLECT,
        **options: Any,
    ) -> _Made:
        """Create and return an environment.

        Args:
            robot: the robot to drive, with the capabilities that the environment needs; give it together with
                `scene`.
            scene: arranges episodes.
            simulator: a function that returns robot and scene, called if these are not given; once for each
                environment of `make_vec`. `palaestra_trainer.testing.fake_arena`, `fake_court` and
                `fake_seeing` need no simulator.
            role: role of the simulator in PALAESTRA_CONFIG. Without `robot` and `simulator`, the environment
                takes the newest free `Webots` facade of this process. Without such a facade, it takes the
                first simulator of PALAESTRA_CONFIG with this role that no environment of any process uses.
                Without PALAESTRA_CONFIG, it starts a simulator with the world of `own_world`, which ends with
                `close()` or with this process.
            options: fields of the class of options; movements and observation parts are given as text.

        Raises:
            ConfigurationError: an option is wrong, all simulators with this role are in use, or the simulator
                program is missing.
            MissingCapability: the robot lacks a capability that the environment needs.
            NoSuchSensor: the robot lacks a sensor that the environment needs.
        """
        chosen = parse_as(self._options, options)
        place = _place(robot, scene, simulator, role, self._own)
        with ExitStack() as undo:
            if place.release is not None:
                undo.callback(place.release)
            made = self.environment_class(place.robot, place.scene, chosen, place.release)
            undo.pop_all()
        return made


class BatchedEntryPoint(Generic[_Made]):
    """Creates the batched form of a shipped environment, for `make_batched`.

    Args:
        kind: the class of the batched form.
        options: the class of the environment's options.

    Attributes:
        environment_class: the class of the batched form.
    """

    def __init__(self, kind: Callable[..., _Made], options: _Options) -> None:
        self.environment_class = kind
        self._options = options

    def __call__(self, robot: BatchedRobotAbc, scene: BatchedSceneAbc, **options: Any) -> _Made:
        """Create and return the batched form.

        Raises:
            ConfigurationError: an option is wrong.
        """
        return self.environment_class(robot, scene, parse_as(self._options, options))


make = EntryPoint("MoveToTargetEnv-v0", MoveToTargetEnv, MoveToTargetOptions)
make_batched = BatchedEntryPoint(BatchedMoveToTargetEnv, MoveToTargetOptions)
make_goal = EntryPoint("MoveToTargetGoalEnv-v0", MoveToTargetGoalEnv, GoalOptions)
make_seeing = EntryPoint("SeeTarget-v0", SeeTargetEnv, SeeOptions)
make_delivering = EntryPoint("Deliver-v0", DeliverEnv, DeliverOptions)
make_navigating = EntryPoint("Navigate-v0", NavigateEnv, NavigateOptions)


class _Place(NamedTuple):
    """The robot and scene of an environment, and the function that releases their simulator."""

    robot: Any  # the environment checks the robot's capabilities
    scene: Scene
    release: Callable[[], None] | None = None


def _place(
    robot: RobotAbc | None,
    scene: Scene | None,
    simulator: Callable[[], tuple[RobotAbc, Scene]] | None,
    role: str,
    own: tuple[str, str],
) -> _Place:
    """Return the given robot and scene, or those of `simulator()`, or else those of `simulator_for`."""
    if (robot is None) != (scene is None):
        raise ConfigurationError("robot, scene: only one of them was given; give both or neither")
    if robot is not None and scene is not None:
        return _Place(robot, scene)
    if simulator is not None:
        return _Place(*simulator())
    from palaestra_trainer.simulators.configured import simulator_for  # noqa: PLC0415 - it needs ROS

    taken = simulator_for(role_of(role), *own)
    return _Place(taken.robot, taken.scene, taken.release)


def role_of(name: str) -> Role:
    """Return the role with this name.

    Raises:
        ConfigurationError: no role has this name.
    """
    if name not in set(Role):
        raise ConfigurationError(f'role: "{name}" is not a role; choose {" or ".join(Role)}')
    return Role(name)
