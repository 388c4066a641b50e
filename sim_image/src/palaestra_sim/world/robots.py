"""Find the robots of a world whose controller is "ros".

Such a robot may be a plain Robot or an instance of a PROTO. It may be at the top of the world, or nested in
another node's children, endPoint or slots. A PROTO whose default controller is "ros" is not found; its
instance in the world must have `controller "ros"`.
"""

from dataclasses import dataclass

from palaestra_sim.world.reader import parse
from palaestra_sim.world.tree import Node, World

NAME = "--name="
SYNCHRONIZE = "--synchronize"
CLOCK = "--clock"
_PART_OF_WEBOTS = ("ros", "void")


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldRobot:
    """A robot whose controller is "ros".

    `robot` is its Robot.name. `ros_name` is the value of its `--name=`, or None without this argument. A
    `supervisor` may read and change the whole scene. If `synchronize` is True, the simulation waits until a
    client steps the robot. `definition` is its DEF name.
    """

    robot: str
    ros_name: str | None
    supervisor: bool
    synchronize: bool
    definition: str = ""


def robots(source: bytes, name: str = "world") -> tuple[WorldRobot, ...]:
    """Return every robot of a world whose controller is "ros", in source order.

    Raises:
        WorldError: the bytes are not a world file.
    """
    return tuple(described(node) for node in ros_robots(parse(source, name)))


def own_controllers(source: bytes, name: str = "world") -> tuple[tuple[str, str], ...]:
    """Return (robot, controller) for each robot whose controller is a program of the world's project.

    "ros" and "void" are programs of Webots, and "<none>", "<generic>" and "<extern>" are not programs.

    Raises:
        WorldError: the bytes are not a world file.
    """
    named = ((robot_name(node), node.text("controller")) for node in parse(source, name).walk())
    return tuple(
        (robot, controller)
        for robot, controller in named
        if controller and controller not in _PART_OF_WEBOTS and not controller.startswith("<")
    )


def ros_robots(world: World) -> tuple[Node, ...]:
    """Return the nodes of the robots whose controller is "ros", in source order."""
    return tuple(node for node in world.walk() if node.text("controller") == "ros")


def robot_name(node: Node) -> str:
    """Return the Robot.name of a robot's node.

    The default of a Robot is "robot" in Webots. The default of a PROTO is not in the world, so for an
    instance of a PROTO its type is returned instead.
    """
    default = "robot" if node.type_name == "Robot" else node.type_name
    return node.text("name") or default


def described(node: Node) -> WorldRobot:
    """Return the description of a robot's node for clients."""
    arguments = node.texts("controllerArgs")
    names = [argument.removeprefix(NAME) for argument in arguments if argument.startswith(NAME)]
    return WorldRobot(
        robot=robot_name(node),
        ros_name=names[-1] if names else None,  # the controller uses the last `--name=`
        supervisor=node.flag("supervisor", default=False),
        synchronize=SYNCHRONIZE in arguments,
        definition=node.def_name or "",
    )
