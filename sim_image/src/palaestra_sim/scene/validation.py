"""Validate a scene while it is read: check numbers, and record unsupported objects with their positions.

Two kinds of errors exist. A *mistake* of the author, such as a string in place of a number, is always
refused. An *unsupported* object, which Webots would simulate, is refused too, unless the user leaves out
nodes of that type. In both cases reading continues. At the end, `conclude` raises one error that lists all
refused nodes with their lines and columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import AxisAngle, Pose, Vector, from_axis_angle
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.old_axes import of_instance, of_old_axes

_DRAWN: Final = frozenset(("CadShape", "Shape"))
_LARGEST: Final = 1e100  # squares of larger numbers would overflow
ELSEWHERE: Final = "leave it out (--leave-out), or run this world with driver webots"


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaveOut:
    """The nodes that the user leaves out, if they cannot be simulated.

    Attributes:
        types: the types of the nodes, as written in the world.
        everything: whether nodes of any type are left out.
        names: whether a robot may lack --name and --synchronize, which a sidecar adds.
    """

    types: frozenset[str] = frozenset()
    everything: bool = False
    names: bool = False

    def covers(self, node: SceneNode) -> bool:
        """Return whether a node that cannot be simulated is left out."""
        return self.everything or node.type_name in self.types or node.proto_name in self.types


class NodeReader:
    """Reads the fields of a world's nodes, checks their numbers, and collects the errors.

    Args:
        refused: mistakes that are already known.
        leave_out: the nodes that the user leaves out.
        simulator: the name of the simulator.
        mesh_files: the mesh files that nodes name.

    Attributes:
        leave_out: the nodes that the user leaves out.
        simulator: the name of the simulator, for messages.
        mesh_files: the mesh files that nodes name.
        left_out: the nodes that were left out, each with its position and the reason.
        world_info: the WorldInfo of the world; None if it is missing.
        system: one letter for the direction of each axis, such as "ENU" for east, north and up.
        top: the frame around the whole world; None if z of the world points up.
        floors: for each level Plane that faces up, the frame that contains the Plane, and the Plane's pose in
            this frame.
    """

    def __init__(
        self,
        refused: Iterable[WorldError] = (),
        leave_out: LeaveOut | None = None,
        simulator: str = "the simulator",
        *,
        mesh_files: MeshFiles,
    ) -> None:
        self._refused: list[WorldError] = list(refused)
        self.leave_out = leave_out or LeaveOut()
        self.simulator = simulator
        self.mesh_files = mesh_files
        self.left_out: list[WorldError] = []
        self.world_info: SceneNode | None = None
        self.system = "ENU"
        self.top: Frame | None = None
        self.floors: list[tuple[Frame, Pose]] = []

    def refuse(self, node: SceneNode, fact: str, remedy: str) -> None:
        """Record a mistake in `node`."""
        if node.origin is not None:
            self._refused.append(node.origin.error(fact, remedy))

    def lacks(self, node: SceneNode, fact: str, remedy: str = ELSEWHERE) -> None:
        """Record that `node` is not supported; if the user leaves out its type, mark the node as left out."""
        if not self.leave_out.covers(node):
            self.refuse(node, fact, remedy)
            return
        node.left_out = True
        if node.origin is not None:
            self.left_out.append(node.origin.error(fact, "left out"))

    def conclude(self) -> None:
        """Raise an error if a node was refused.

        Raises:
            WorldError: the error lists all mistakes and all refused nodes.
        """
        if error := refusal(self._refused):
            raise error

    def vector(self, node: SceneNode, field: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many finite numbers as `default` has; `default` if the field is refused."""
        if field not in node.fields:
            return default
        numbers = node.numbers(field)
        if numbers is None or len(numbers) != len(default) or not all(map(math.isfinite, numbers)):
            wanted = "a number" if len(default) == 1 else f"{len(default)} numbers"
            self.refuse(node, f"{node.type_name}.{field} is not {wanted}", f"write {wanted}")
            return default
        if max(map(abs, numbers)) > _LARGEST:
            self.refuse(
                node, f"{node.type_name}.{field} has a number above {_LARGEST:g}", "write a smaller number"
            )
            return default
        return numbers

    def number(self, node: SceneNode, field: str, default: float) -> float:
        """Return the number of a field; `default` if the field is refused."""
        return self.vector(node, field, (default,))[0]

    def gravity(self) -> float:
        """Return WorldInfo.gravity in m/s2; in a file from before R2022a it may be a vector."""
        node = self.world_info
        if node is None:
            return 9.81
        numbers = node.numbers("gravity") or ()
        if len(numbers) == len("xyz") and of_old_axes(node):
            return math.hypot(*numbers)
        return self.number(node, "gravity", 9.81)

    def translation(self, node: SceneNode) -> Vector:
        """Return `translation` in meters."""
        x, y, z = self.vector(node, "translation", (0.0, 0.0, 0.0))
        return x, y, z

    def rotation(self, node: SceneNode) -> AxisAngle:
        """Return `rotation`, axis and angle."""
        x, y, z, angle_rad = self.vector(node, "rotation", (0.0, 0.0, 1.0, 0.0))
        return of_instance(node, (x, y, z, angle_rad))

    def scale(self, node: SceneNode) -> Vector:
        """Return `scale`, a field of Transform and, before R2023a, of Solid; 1 1 1 if it is absent."""
        if node.stand_in:  # the shapes of the stand-in already include its PROTO's scale
            return 1.0, 1.0, 1.0
        x, y, z = self.vector(node, "scale", (1.0, 1.0, 1.0))
        return x, y, z

    def size(self, node: SceneNode) -> float:
        """Return the factor by which a frame scales its contents; refuse a scale that distorts solids."""
        x, y, z = self.scale(node)
        if x == y == z > 0.0:
            return x
        inside = any(child.type_name not in _DRAWN for child in node.nodes())
        if inside or node.nodes("boundingObject"):
            self.lacks(node, f"a {node.type_name} with a scale that distorts the shapes in it")
        return 1.0

    def pose(self, node: SceneNode) -> Pose:
        """Return the pose of a node in the frame of its parent."""
        return Pose(self.translation(node), from_axis_angle(self.rotation(node)))
