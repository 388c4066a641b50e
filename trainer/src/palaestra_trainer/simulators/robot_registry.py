"""Find the robot class that `trainer.robot` of a job names."""

from __future__ import annotations

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import nearest
from palaestra_trainer.job.user_code import imports
from palaestra_trainer.robots.base import RobotAbc
from palaestra_trainer.robots.simulated import SimulatedRobot

SHIPPED: dict[str, str] = {
    "Robotino": "palaestra_trainer.robots.robotino:Robotino",
    "TurtleBot3Burger": "palaestra_trainer.robots.differential:TurtleBot3Burger",
    "EPuck": "palaestra_trainer.robots.differential:EPuck",
}


def robot_class(name: str) -> type[SimulatedRobot]:
    """Return the class of a robot, from `SHIPPED` or from a job's author as `module:Class`.

    Raises:
        ConfigurationError: the class does not exist, or is not a complete `SimulatedRobot`.
    """
    if name not in SHIPPED and not imports.names_class(name):
        raise ConfigurationError(
            f"trainer.robot: {name} is not known; {nearest(name, list(SHIPPED))}, "
            "or name a class of your own as module:Class"
        )
    found = imports.object_named(SHIPPED.get(name, name), f"trainer.robot: {name}")
    if not (isinstance(found, type) and issubclass(found, SimulatedRobot)):
        kind = "a RobotAbc, but not a SimulatedRobot" if _is_robot(found) else "not a RobotAbc"
        raise ConfigurationError(
            f"trainer.robot: {name} is {kind}; derive the class from "
            "palaestra_trainer.robots.simulated.SimulatedRobot or one of its subclasses"
        )
    if missing := sorted(getattr(found, "__abstractmethods__", ())):
        raise ConfigurationError(f"trainer.robot: {name} does not implement the method {missing[0]}; add it")
    return found


def _is_robot(found: object) -> bool:
    return isinstance(found, type) and issubclass(found, RobotAbc)
