"""What `gymnasium.make` calls: the environment with the robot that it is given, or one that it finds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from palaestra_protocol.pod.terms import Role
from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.options import parse
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene


def make(
    robot: RobotinoAbc | None = None,
    scene: Scene | None = None,
    simulator: Callable[[], tuple[RobotinoAbc, Scene]] | None = None,
    role: str = Role.COLLECT,
    **options: Any,
) -> MoveToTargetEnv:
    """Return the environment for `gymnasium.make("MoveToTargetEnv-v0", ...)`.

    Args:
        robot: the robot to drive, given together with its `scene`.
        scene: arranges episodes.
        simulator: returns robot and scene if none are given; called once for each environment of
            `make_vec`. `palaestra_trainer.testing.fake_arena` needs no simulator.
        role: without `robot` and `simulator`, the environment takes the first simulator of PALAESTRA_CONFIG
            with this role that no environment of any process uses. Without PALAESTRA_CONFIG it starts a
            stub, which ends with `close()` or with this process.
        options: see `Options`; names of movements and parts are text.

    Raises:
        ConfigurationError: an option is wrong, or no simulator with this role is left.
    """
    chosen = parse(options)
    if (robot is None) != (scene is None):
        raise ConfigurationError("robot, scene: only one of them was given; give both or neither")
    if robot is not None and scene is not None:
        return MoveToTargetEnv(robot, scene, chosen)
    if simulator is not None:
        return MoveToTargetEnv(*simulator(), chosen)
    from palaestra_trainer.simulators.configured import simulator_for  # noqa: PLC0415 - it needs ROS

    taken = simulator_for(_role(role))
    return MoveToTargetEnv(taken.robot, taken.scene, chosen, taken.release)


def _role(name: str) -> Role:
    if name not in set(Role):
        raise ConfigurationError(f'role: "{name}" does not exist; choose {" or ".join(Role)}')
    return Role(name)
