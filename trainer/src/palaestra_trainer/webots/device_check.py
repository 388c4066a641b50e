"""Check before the first step that a world has the devices and nodes that a program needs.

Without the check, a missing device would look like a fault of the simulator, because no node serves the
device. Only a complete list or a definite response counts as proof. So a simulator that is still starting is
not mistaken for a wrong world.
"""

from __future__ import annotations

from collections.abc import Iterable

from palaestra_trainer.errors import WorldMisfit
from palaestra_trainer.webots.device import topic_name
from palaestra_trainer.webots.observer import Observer


def require_devices(robot: str, wanted: Iterable[str]) -> None:
    """Check that the robot with the ROS name `robot` has every device in `wanted`.

    Raises:
        WorldMisfit: the robot's list of devices is complete, and a wanted device is not in it.
        SimulatorDead, SimulatorHung, WrongData: the simulator does not respond.
    """
    observer = Observer(robot)
    try:
        listed, count = observer.devices(), observer.number_of_devices()
    finally:
        observer.close()
    known = {topic_name(device) for device in listed}
    missing = [device for device in dict.fromkeys(wanted) if topic_name(device) not in known]
    if missing and len(listed) == count:
        has = ", ".join(listed) or "none"
        raise WorldMisfit(
            robot,
            f"the robot has no device {', '.join(missing)}; it has {has}."
            " Use a world with the robot that the environment drives; in a world with several robots, set"
            " `definition` in the class of trainer.robot to the DEF name of its robot",
        )


def require_node(observer: Observer, name: str) -> None:
    """Check that the world has a node with DEF `name`.

    Raises:
        WorldMisfit: the world has no such node.
        SimulatorDead, SimulatorHung, WrongData: the simulator does not respond.
    """
    if not observer.exists(name):
        raise WorldMisfit(
            observer.node_name, f"the world has no node DEF {name}; add DEF {name} to the node in the world"
        )
