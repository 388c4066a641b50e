"""Read the simulated contents of a world file.

Nodes that are only drawn are skipped, upright ones with a boundingObject are obstacles, and robots drive. Any
other node that would act in Webots, such as a PROTO or a loose crate, is refused with its place in the file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from palaestra_sim.stub.scene.places import Place
from palaestra_sim.stub.scene.reading import Reading
from palaestra_sim.stub.scene.robot_reader import RobotParts, read_robot
from palaestra_sim.stub.scene.shapes import Shape, bounding_shapes
from palaestra_sim.world import Node, World

# Visible to people and cameras only, or read elsewhere (WorldInfo).
DRAWN_ONLY: Final = frozenset(
    (
        "Background",
        "Billboard",
        "CadShape",
        "DirectionalLight",
        "Fog",
        "PointLight",
        "Shape",
        "SpotLight",
        "TexturedBackground",
        "TexturedBackgroundLight",
        "Viewpoint",
        "WorldInfo",
    )
)
_FRAMES: Final = frozenset(("Pose", "Transform", "Solid"))


@dataclass(slots=True, kw_only=True)
class Scene:
    """The contents of a world.

    Attributes:
        basic_step_ms: WorldInfo.basicTimeStep.
        random_seed: WorldInfo.randomSeed.
        solids: the obstacles.
        robots: in the order of the world file.
        places: the frame of every node that has one, by the first byte of the node.
    """

    basic_step_ms: int = 32
    random_seed: int = 0
    solids: list[Shape] = field(default_factory=list)
    robots: list[RobotParts] = field(default_factory=list)
    places: dict[int, Place] = field(default_factory=dict)


def read_scene(world: World, name: str = "world") -> Scene:
    """Return the contents of a world.

    Raises:
        WorldError: it has things that the stub cannot simulate; the error has all of them.
    """
    reading = Reading(world, name)
    scene = Scene()
    for node in reading.resolved(world.nodes):
        if node.type_name == "WorldInfo":
            _read_world_info(reading, node, scene)
        _read(reading, node, None, scene)
    reading.conclude()
    return scene


def _read_world_info(reading: Reading, node: Node, scene: Scene) -> None:
    step_ms = reading.number(node, "basicTimeStep", 32.0)
    if step_ms < 1.0 or step_ms != int(step_ms):
        fact = f"basicTimeStep {step_ms:g} is no whole number of milliseconds"
        reading.refuse(node, fact, "the controller counts whole ones; write one")
    scene.basic_step_ms = int(step_ms)
    scene.random_seed = int(reading.number(node, "randomSeed", 0.0))


def _read(reading: Reading, node: Node, parent: Place | None, scene: Scene) -> None:
    kind = node.type_name
    if kind in DRAWN_ONLY:
        return
    if kind == "Group":
        _read_children(reading, node, parent, scene)
    elif kind == "Robot":
        scene.robots.append(read_robot(reading, node, parent, scene.places))
    elif kind in _FRAMES:
        place = Place(parent, reading.translation(node), reading.rotation(node))
        scene.places[node.span[0]] = place
        if kind == "Solid":
            _read_solid(reading, node, place, scene)
        _read_children(reading, node, place, scene)
    else:
        reading.refuse(node, f"the stub simulates no {kind}")


def _read_children(reading: Reading, node: Node, parent: Place | None, scene: Scene) -> None:
    for child in reading.children(node):
        _read(reading, child, parent, scene)


def _read_solid(reading: Reading, node: Node, place: Place, scene: Scene) -> None:
    if node.nodes("physics"):
        fact = "a Solid with physics moves when it is pushed, which the stub does not simulate"
        reading.refuse(node, fact, "remove physics, or run this world with driver webots")
    for shape in bounding_shapes(reading, node, place):
        if not shape.upright:
            reading.refuse(shape.node, f"a {shape.node.type_name} that does not stand upright")
        scene.solids.append(shape)
