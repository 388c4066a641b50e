"""The parts of a robot, as the reader of its node returns them."""

from __future__ import annotations

from dataclasses import dataclass

from palaestra_sim.scene.arguments import ControllerArguments
from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.devices.device_type import Devices
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape


@dataclass(slots=True, kw_only=True, eq=False)
class RobotParts:
    """A robot of the world file.

    Attributes:
        body: the robot's body in the physics; None if the robot cannot drive and is not a free-standing
            obstacle.
        standing: the outline of a robot that cannot move and does not stand upright on the floor.
        arguments: the robot's controllerArgs; None if the robot's controller is not "ros".
        links: the parts on the robot's joints that forces move.
        passing: the parts with a boundingObject that collides with nothing, because a motor moves them.
    """

    node: SceneNode
    name: str
    place: Frame
    devices: Devices
    body: Body | None
    standing: tuple[Shape, ...] = ()
    arguments: ControllerArguments | None = None
    links: tuple[Link, ...] = ()
    passing: tuple[SceneNode, ...] = ()
