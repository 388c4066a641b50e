"""The report on a world for its author; each simulator prints it, such as `palaestra-stub --check`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, Protocol

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.device_type import DeviceType
from palaestra_sim.scene.devices.distance_sensor import DistanceSensor, DistanceSensorType
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.nodes.types import is_base_type
from palaestra_sim.scene.old_axes import of_old_axes
from palaestra_sim.scene.outlines import outlines_of
from palaestra_sim.scene.physics import Abilities
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.robot_parts import RobotParts
from palaestra_sim.scene.steering import SteeredDrive
from palaestra_sim.scene.tree.field_types import without_effect
from palaestra_sim.scene.tree.scene_tree import SceneTree
from palaestra_sim.world.mjcf import is_mjcf

_ROLLS_AND_TURNS: Final = 2
_MOST_NAMES: Final = 8  # maximum number of device names in one line
_HULLS: Final = frozenset(("IndexedFaceSet", "Mesh"))
_SIGHT: Final = frozenset(("Camera", "Lidar", "RangeFinder"))  # these devices see visible shapes
_SEEN_MESHES: Final = "only a Mesh of an STL or OBJ file is seen"
_OF_BODIES: Final = frozenset(("Accelerometer", "Gyro"))


class Described(Protocol):
    """A loaded world."""

    tree: SceneTree

    @property
    def robots(self) -> Sequence[Robot]:
        """The robots of the world."""
        ...

    @property
    def abilities(self) -> Abilities:
        """The contents of a world that the physics simulates."""
        ...

    @property
    def unread_meshes(self) -> Mapping[str, int]:
        """The number of visible shapes by type that no sensor sees; see `View.unread_meshes`."""
        ...

    @property
    def unread_textures(self) -> int:
        """The number of visible shapes with a texture that infra-red sensors do not see."""
        ...

    @property
    def left_out(self) -> Sequence[WorldError]:
        """The nodes that were left out, each with its position in the file."""
        ...


def summary(simulation: Described, *, chosen: bool = False) -> Iterator[str]:
    """Yield lines about robots, stand-ins, and all nodes that were left out.

    By default, the world was read without any unsupported node, so that the report covers all other nodes. If
    `chosen` is True, the world was read without the nodes that the user has chosen to leave out.
    """
    for robot in simulation.robots:
        yield f'robot "{robot.name}": {", ".join(_of_robot(robot))}'
    stand_ins = Counter(node.proto_name for node in simulation.tree.nodes.values() if node.stand_in)
    if stand_ins:
        yield f"stand-ins, which stand still: {_counted(stand_ins)}"
    if release := _old_release(simulation):
        yield f"a world of {release}: its nodes are converted to the current axes, as in Webots"
    silent = silent_devices(simulation.robots)
    if silent:
        yield f"devices without readings, whose enable returns failure: {silent}"
    for difference in differences(simulation):
        yield f"differs from Webots: {difference}"
    if error := refusal(simulation.tree.ignored):
        yield from str(error).splitlines()
    if error := refusal(lacks(simulation)):
        yield "left out:" if chosen else "cannot be simulated; --leave-out leaves it out:"
        yield from str(error).splitlines()


def _old_release(simulation: Described) -> str:
    """Return the release of a world whose nodes have older axes; "" for a world with current axes."""
    first = next(iter(simulation.tree.root.nodes()), None)
    if first is None or first.origin is None or not of_old_axes(first):
        return ""
    return first.origin.source.header().split()[-2]


def lacks(simulation: Described) -> list[WorldError]:
    """Return the nodes that were left out because the simulator does not support them."""
    return [each for each in simulation.left_out if each not in simulation.tree.ignored]


def silent_devices(robots: Iterable[Robot]) -> str:
    """Return the number of devices without readings in this simulator, by type; "" if all have readings."""
    return _counted(
        Counter(
            kind.node
            for robot in robots
            if robot.parts.arguments is not None
            for kind, device in robot.parts.devices.rows.values()
            if kind.silent(device)
        )
    )


def differences(simulation: Described) -> Iterator[str]:
    """Yield the differences from Webots for the devices and obstacles of this world."""
    robots = [robot.parts for robot in simulation.robots if robot.parts.arguments is not None]
    devices = [row for robot in robots for row in robot.devices.rows.values()]
    types = Counter(it.type for _, it in devices if isinstance(it, DistanceSensor))
    lidars = sum(kind.node == "Lidar" for kind, _ in devices)
    outlines = [inside for node in simulation.tree.nodes.values() for inside in node.outlining()]
    meshes = Counter(node.type_name for node in outlines if node.type_name in _HULLS and not node.left_out)
    yield from _not_in_webots(devices)
    yield from _without_effect(simulation)
    if infrared := types[DistanceSensorType.INFRA_RED]:
        yield f"{infrared} infra-red DistanceSensor: rays pass through the robot itself"
        if unread := simulation.unread_textures:
            yield f"{unread} Shape with a texture that infra-red DistanceSensors do not see"
    if infrared or any(kind.node in _SIGHT for kind, _ in devices):
        for type_name, count in sorted(simulation.unread_meshes.items()):
            why = _SEEN_MESHES if is_base_type(type_name) else "the type is unknown"
            yield f"{count} {type_name} that no sensor sees: {why}"
    if lidars:
        yield f"{lidars} Lidar: rays pass through the robot itself"
    for type_name, count in sorted(Counter(it.type_name for robot in robots for it in robot.passing).items()):
        yield f"{count} {type_name} on a joint with a motor: collides with nothing"
    yield from _without_physics(it for it in robots if not _of_a_model(it.node))
    for type_name, count in sorted(meshes.items()):
        yield f"{count} {type_name} as boundingObject: robots touch its convex hull"
    yield from _outlined(simulation)
    rays = (
        beam
        for _, it in devices
        if isinstance(it, DistanceSensor) and it.type != DistanceSensorType.INFRA_RED
        for beam in it.beams
    )
    sloped = any(not beam.level for beam in rays)
    if sloped and not any(node.type_name == "Plane" for node in outlines):
        yield "no Plane as boundingObject: rays meet a floor at height 0"


def _outlined(simulation: Described) -> Iterator[str]:
    """Yield a line for each type of obstacle and for each robot that collides with an outline from above."""
    if simulation.abilities.exact:
        return
    nodes = simulation.tree.nodes.values()
    apart = [node for node in nodes if "Robot" not in {it.type_name for it in (node, *node.ancestors())}]
    shapes = outlines_of(apart, tuple, simulation.tree.mesh_files).all
    rounded = Counter(shape.node.type_name for shape in shapes if not shape.prismatic)
    for type_name, count in sorted(rounded.items()):
        yield f"{count} {type_name} as boundingObject: robots touch its outline from above, at each height"
    for robot in simulation.robots:
        rim = {} if robot.body is None else {shape.node.number: shape for shape in robot.body.rim}
        others = [it for it in rim.values() if it.kind != "cylinder" or it.lies]
        if others:
            types = _counted(Counter(shape.node.type_name for shape in others))
            yield f'robot "{robot.name}": upright cylinders collide in place of {types}'


def _of_a_model(node: SceneNode) -> bool:
    """Return whether a node comes from an MJCF model, in which each body has a mass."""
    return node.origin is not None and is_mjcf(node.origin.source.data)


def _without_physics(robots: Iterable[RobotParts]) -> Iterator[str]:
    """Yield a line for each type of sensor on Solids without physics, where it measures nothing in Webots."""
    lacking = Counter(
        node.type_name
        for robot in robots
        for node in robot.devices.nodes.values()
        if node.type_name in _OF_BODIES and not any(it.nodes("physics") for it in (node, *node.ancestors()))
    )
    for type_name, count in sorted(lacking.items()):
        yield f"{count} {type_name} on a robot without physics: Webots measures nothing there"


def _not_in_webots(devices: Iterable[tuple[DeviceType[Any], Any]]) -> Iterator[str]:
    """Yield a line for each type of device that Webots does not have, with the names of its devices."""
    names: dict[str, list[str]] = {}
    for kind, device in devices:
        if not is_base_type(kind.node):
            names.setdefault(kind.node, []).append(device.name)
    for type_name, of_type in sorted(names.items()):
        more = ", ..." if len(of_type) > _MOST_NAMES else ""
        named = ", ".join(of_type[:_MOST_NAMES])
        yield f"{len(of_type)} {type_name}, a type that Webots does not have: {named}{more}"


def _without_effect(simulation: Described) -> Iterator[str]:
    """Yield a line for each type of node with fields that have an effect only in Webots."""
    by_ros = [robot.parts.node for robot in simulation.robots if robot.parts.arguments is not None]
    fields: dict[str, Counter[str]] = {}
    for node in simulation.tree.nodes.values():
        matters = _is_on(node, by_ros) if node.type_name in DEVICES else simulation.abilities.forces
        if matters and not node.left_out:
            fields.setdefault(node.type_name, Counter()).update(without_effect(node))
    for type_name, names in sorted(fields.items()):
        if names:
            yield f"{max(names.values())} {type_name}: without effect: {', '.join(sorted(names))}"


def _is_on(node: SceneNode, robots: Sequence[SceneNode]) -> bool:
    """Return whether a device is on one of these robots."""
    return any(around in robots for around in node.ancestors())


def _of_robot(robot: Robot) -> Iterator[str]:
    controller = robot.parts.node.text("controller") or "<generic>"
    yield f'controller "{controller}"' + ("" if controller == "ros" else " does not run here")
    drive = robot.body.base.drive if robot.body is not None else None
    if drive is None:
        yield "no wheels"
    else:
        kind = "differential" if drive.freedoms == _ROLLS_AND_TURNS else "omnidirectional"
        if isinstance(drive, SteeredDrive):
            kind = "steered"
        yield f"{kind} drive on {len(drive.to_speeds)} wheels"
    devices = Counter(kind.node for kind, _ in robot.parts.devices.rows.values())
    if devices:
        yield _counted(devices)


def _counted(names: Counter[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in sorted(names.items()))
