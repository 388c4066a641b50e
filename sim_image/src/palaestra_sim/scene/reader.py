"""Read the simulated contents of a world file.

The reader skips nodes that are only visible. It reads robots, and makes obstacles of upright nodes with a
boundingObject. It refuses any other node that has an effect in Webots, such as an unknown PROTO, and reports
the node's position in the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.axes import read_axes
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.dynamic_solids import DynamicFrame, DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.joint_reader import fill_door, read_door
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.mass import DENSITY, volume_m3
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics import Physics
from palaestra_sim.scene.physics_settings import Floor, PhysicsSettings, read_surroundings
from palaestra_sim.scene.robot_parts import RobotParts
from palaestra_sim.scene.robot_reader import read_robot
from palaestra_sim.scene.shapes import Shape, bounding_shapes
from palaestra_sim.scene.tree.scene_tree import SceneTree
from palaestra_sim.scene.validation import ELSEWHERE, LeaveOut, NodeReader

# The physics ignores these nodes. Most of these nodes are only visible to people and cameras. WorldInfo is
# among them, because other code reads it.
DRAWN_ONLY: Final = frozenset(
    (
        "Background",
        "Billboard",
        "CadShape",
        "DirectionalLight",
        "Fog",
        "PointLight",
        "Shape",
        "SolidReference",
        "SpotLight",
        "TexturedBackground",
        "TexturedBackgroundLight",
        "Viewpoint",
        "WorldInfo",
    )
)
# A device outside of a robot is an ordinary Solid.
_SOLIDS: Final = {"Solid", "Track"} | {name for name, kind in DEVICES.items() if kind.body}
_FRAMES: Final = _SOLIDS | {"Pose", "Transform"}
_ONE_AXIS: Final = frozenset(("HingeJoint", "SliderJoint"))
_LEAST_M3: Final = 1e-9  # minimum volume of a shape with a mass
_JOINTS: Final = _ONE_AXIS | frozenset(("BallJoint", "Hinge2Joint"))


@dataclass(slots=True, kw_only=True)
class SceneContents:
    """The contents of a world.

    Attributes:
        physics: the physics that moves the robots.
        basic_step_ms: WorldInfo.basicTimeStep.
        random_seed: WorldInfo.randomSeed.
        solids: the obstacles.
        loose: the dynamic solids, which move when they are pushed.
        heavy: Solids with physics that are fixed to another Solid, each with its own shapes.
        doors: links on joints that do not belong to a robot.
        robots: the robots, in the order of the world file.
        top: the frame around the whole world; None if z of the world points up.
        surroundings: the settings of the whole world.
        left_out: the unsupported nodes that the user left out, each with its position in the file.
        leave_out: the nodes that the user leaves out if they are unsupported.
    """

    physics: Physics
    basic_step_ms: int = 32
    random_seed: int = 0
    solids: list[Shape] = field(default_factory=list)
    loose: list[DynamicSolid] = field(default_factory=list)
    heavy: list[tuple[SceneNode, Sequence[Shape]]] = field(default_factory=list)
    doors: list[Link] = field(default_factory=list)
    robots: list[RobotParts] = field(default_factory=list)
    top: Frame | None = None
    surroundings: PhysicsSettings = field(default_factory=PhysicsSettings)
    left_out: tuple[WorldError, ...] = ()
    leave_out: LeaveOut = field(default_factory=LeaveOut)


def read_scene(tree: SceneTree, physics: Physics, leave_out: LeaveOut | None = None) -> SceneContents:
    """Return the contents of a world, and set the frames of its nodes; `physics` makes the robots' bodies.

    Raises:
        WorldError: the world has objects that cannot be simulated; the error lists all of them.
    """
    reading = NodeReader(tree.refused, leave_out, physics.abilities.name, mesh_files=tree.mesh_files)
    scene = SceneContents(physics=physics)
    # WorldInfo is read before all other nodes, because devices use its fields.
    for node in tree.root.nodes():
        if node.type_name == "WorldInfo":
            reading.world_info = node
            _read_world_info(reading, node, scene)
    first = reading.world_info or next(iter(tree.root.nodes()), None)
    if first is not None:
        reading.top = read_axes(reading, first)
    for node in tree.root.nodes():
        _read(reading, node, reading.top, scene)
    if physics.abilities.forces:
        planes = (node for node in tree.nodes.values() if node.type_name == "Plane" and node.outline)
        scene.surroundings = read_surroundings(reading, reading.world_info, next(planes, None))
    floors = tuple(Floor(place, local) for place, local in reading.floors)
    scene.surroundings = replace(scene.surroundings, floors=floors)
    reading.conclude()
    scene.top = reading.top
    scene.left_out = tuple(reading.left_out)
    scene.leave_out = reading.leave_out
    return scene


def read_added(tree: SceneTree, nodes: Iterable[SceneNode], to: SceneContents) -> SceneContents:
    """Return the contents that nodes inside one parent add to a world, and set the frames of these nodes.

    `to` has the contents of the world so far.

    Raises:
        WorldError: the nodes contain objects that cannot be simulated.
    """
    reading = NodeReader((), to.leave_out, to.physics.abilities.name, mesh_files=tree.mesh_files)
    reading.world_info = next((it for it in tree.root.nodes() if it.type_name == "WorldInfo"), None)
    scene = SceneContents(physics=to.physics)
    for node in nodes:
        places = (around.place for around in node.ancestors() if around.place is not None)
        _read(reading, node, next(places, to.top), scene)
    reading.conclude()
    return scene


def _read_world_info(reading: NodeReader, node: SceneNode, scene: SceneContents) -> None:
    step_ms = reading.number(node, "basicTimeStep", 32.0)
    if step_ms < 1.0 or step_ms != int(step_ms):
        fact = f"basicTimeStep {step_ms:g} is not a whole number of milliseconds"
        reading.refuse(node, fact, "write a whole number, because the controller counts whole milliseconds")
    scene.basic_step_ms = int(step_ms)
    scene.random_seed = int(reading.number(node, "randomSeed", 0.0))


def _read(reading: NodeReader, node: SceneNode, parent: Frame | None, scene: SceneContents) -> None:
    kind = node.type_name
    if kind in DRAWN_ONLY:
        return
    if kind in {"Group", "Slot"}:
        _read_children(reading, node, parent, scene)
    elif kind == "Robot":
        robot = read_robot(reading, node, parent, scene.physics)
        scene.robots.append(robot)
        _stand(reading, robot.standing, scene)
    elif kind in _JOINTS:
        _read_joint(reading, node, parent, scene)
    elif kind in _SOLIDS and scene.physics.abilities.loose and _is_loose(node):
        _read_loose(reading, node, parent, scene)
    elif kind in _FRAMES:
        _read_frame(reading, node, parent, scene)
    else:
        reading.lacks(node, node.unusable or f"{scene.physics.abilities.name} simulates no {kind}")


def _read_joint(reading: NodeReader, node: SceneNode, parent: Frame | None, scene: SceneContents) -> None:
    """Read a joint that does not belong to a robot; an end without physics is fixed."""
    if scene.physics.abilities.joints and node.type_name in _ONE_AXIS:
        link = read_door(reading, node, parent)
        if link is not None:
            _read_door_end(reading, link, scene)
            return
    for end in node.nodes("endPoint"):
        if end.type_name in _FRAMES:
            _read_frame(reading, end, parent, scene)
        else:
            _read(reading, end, parent, scene)


def _read_door_end(reading: NodeReader, link: Link, scene: SceneContents) -> None:
    """Read the nodes on a joint that swings; Solids without physics are fixed to its end."""
    inside = SceneContents(physics=scene.physics)
    _read_children(reading, link.node, link.place, inside)
    shapes = [*bounding_shapes(reading, link.node, link.place), *inside.solids]
    if not link.node.left_out:
        fill_door(reading, link, inside.doors, shapes)
        scene.doors.append(link)
    scene.doors += inside.doors
    scene.loose += inside.loose
    scene.robots += inside.robots


def _read_frame(reading: NodeReader, node: SceneNode, parent: Frame | None, scene: SceneContents) -> None:
    place = Frame(parent, reading.translation(node), reading.rotation(node), reading.size(node))
    node.place = place
    if node.left_out:
        return
    if node.type_name in _SOLIDS:
        _read_solid(reading, node, place, scene)
    _read_children(reading, node, place, scene)


def _read_children(reading: NodeReader, node: SceneNode, parent: Frame | None, scene: SceneContents) -> None:
    for child in node.nodes():
        _read(reading, child, parent, scene)


def _is_loose(node: SceneNode) -> bool:
    if _is_fixed(node):
        return False
    mass_kg = node.numbers("mass") if node.stand_in else None
    return bool(node.nodes("physics")) or (mass_kg is not None and mass_kg > (0.0,))


def _is_fixed(node: SceneNode) -> bool:
    """Return whether a Solid is in another Solid without a joint between them; Webots makes both one body.

    If the outer Solid has no physics, both are fixed to the world.
    """
    for around in node.ancestors():
        if around.type_name in _JOINTS:
            return False
        if around.type_name in _SOLIDS:
            return True
    return False


def _densities(reading: NodeReader, node: SceneNode, shapes: Sequence[Shape]) -> dict[Shape, float]:
    """Return the densities of the shapes of a Solid in kg/m3, from its mass or its density."""
    # A stand-in has no Physics node, but it has the mass of its PROTO.
    described = next(iter(node.nodes("physics")), node)
    mass_kg = reading.number(described, "mass", -1.0)
    density = reading.number(described, "density", DENSITY)
    if mass_kg > 0.0:
        density = mass_kg / max(sum(map(volume_m3, shapes)), _LEAST_M3)
    return dict.fromkeys(shapes, density if density > 0.0 else DENSITY)


def _read_loose(reading: NodeReader, node: SceneNode, parent: Frame | None, scene: SceneContents) -> None:
    """Read a dynamic solid, with the Solids that are fixed to it."""
    place = DynamicFrame(parent, reading.translation(node), reading.rotation(node), reading.size(node))
    node.place = place
    fixed = SceneContents(physics=scene.physics)
    _read_children(reading, node, place, fixed)
    shapes = [*bounding_shapes(reading, node, place), *fixed.solids]
    heavy = {shape for _, some in fixed.heavy for shape in some}
    densities = _densities(reading, node, [shape for shape in shapes if shape not in heavy])
    for inner, some in fixed.heavy:
        densities |= _densities(reading, inner, some)
    if shapes and not node.left_out:
        scene.loose.append(
            DynamicSolid(
                node=node,
                place=place,
                shapes=tuple(shapes),
                densities=tuple(densities[shape] for shape in shapes),
            )
        )
    scene.loose += fixed.loose
    scene.doors += fixed.doors
    scene.robots += fixed.robots


def _read_solid(reading: NodeReader, node: SceneNode, place: Frame, scene: SceneContents) -> None:
    name = scene.physics.abilities.name
    if node.nodes("physics") and not _is_fixed(node):
        fact = f"a {node.type_name} with physics moves when it is pushed, which {name} does not simulate"
        reading.lacks(node, fact, f"remove physics, {ELSEWHERE}")
    if node.type_name == "Track" and node.nodes("device"):
        fact = f"a Track with devices moves the objects on it, which {name} does not simulate"
        reading.lacks(node, fact)
    shapes = list(bounding_shapes(reading, node, place))
    if node.nodes("physics"):
        scene.heavy.append((node, shapes))
    if not node.left_out:
        _stand(reading, shapes, scene)


def _stand(reading: NodeReader, shapes: Iterable[Shape], scene: SceneContents) -> None:
    """Add shapes to the obstacles, and refuse tilted shapes that the physics does not support."""
    for shape in shapes:
        if not (shape.upright or scene.physics.abilities.leaning):
            reading.lacks(shape.node, f"a {shape.node.type_name} that neither stands nor lies")
        if not shape.node.left_out:
            scene.solids.append(shape)
