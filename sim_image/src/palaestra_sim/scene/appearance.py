"""The visible shapes of a world and their poses, as data for viewers; see `palaestra_protocol.scene`.

The data is computed only on request. A frame that moves by itself becomes one node, together with all frames
that it carries. Each other frame with visible shapes becomes a separate node, because a client may move that
frame. A robot without visible shapes, such as an instance of a built-in PROTO, is shown by its collision
shapes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from palaestra_protocol.scene import (
    MOST_MESHES,
    MOST_NODES,
    MOST_POINTS,
    MOST_SHAPES,
    MOST_TRIANGLES,
    WORLD,
    Numbers3,
    PoseNumbers,
    SceneState,
    ShapeKind,
    Triangles,
    VisibleNode,
    VisibleScene,
    VisualShape,
)
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector, to_quaternion
from palaestra_sim.scene.links import frames_between
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.meshes import box_of
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.shapes import bounding_shapes
from palaestra_sim.scene.validation import NodeReader
from palaestra_sim.scene.visuals import Drawn, View

_BODY: Final = (0.55, 0.62, 0.70, 1.0)  # the color of a robot without visible shapes
_KINDS: Final = {
    "box": ShapeKind.BOX,
    "ball": ShapeKind.SPHERE,
    "cylinder": ShapeKind.CYLINDER,
    "capsule": ShapeKind.CAPSULE,
    "mesh": ShapeKind.MESH,
}


def pose_numbers(pose: Pose) -> PoseNumbers:
    """Return a pose in the form of the protocol."""
    qx, qy, qz, qw = to_quaternion(pose.rotation)
    return (*pose.position, qw, qx, qy, qz)


@dataclass(slots=True)
class MeshTable:
    """The distinct meshes of a scene, within the limits of the protocol.

    Attributes:
        meshes: the meshes so far.
        refused: the number of times that a mesh exceeded a limit.
    """

    meshes: list[Triangles] = field(default_factory=list)
    refused: int = 0
    _known: dict[object, int] = field(default_factory=dict)
    _points: int = 0
    _triangles: int = 0

    def index(self, key: object, read: Callable[[], Triangles], points: int, triangles: int) -> int | None:
        """Return the index of a mesh; None if the mesh exceeds a limit. `read` runs once for each `key`."""
        if key in self._known:
            return self._known[key]
        within = self._points + points <= MOST_POINTS and self._triangles + triangles <= MOST_TRIANGLES
        if not within or len(self.meshes) >= MOST_MESHES:
            self.refused += 1
            return None
        self._points += points
        self._triangles += triangles
        self._known[key] = len(self.meshes)
        self.meshes.append(read())
        return self._known[key]


@dataclass(slots=True, eq=False)
class _Node:
    """A node of the scene: its frame, None for the world, and the shapes that it carries."""

    name: str
    frame: Frame | None
    shapes: list[Drawn] = field(default_factory=list)


class Appearance:
    """The visible shapes of one world and their poses, for viewers.

    Args:
        view: the visible part of the world.
        robots: returns the robots of the world.
    """

    def __init__(self, view: View, robots: Callable[[], Sequence[Robot]]) -> None:
        self._view = view
        self._robots = robots
        self._revision = 0
        self._changes = -1  # the count of changes in the view when the nodes were collected
        self._moves = -1
        self._nodes: list[_Node] = []
        self._offsets: list[tuple[Frame, Frame, Pose]] = []  # frames inside a frame that moves
        self._elsewhere: dict[str, PoseNumbers] = {}  # poses of the nodes that a client has moved
        self._starts: dict[str, PoseNumbers] = {}

    def scene(self, world: str) -> VisibleScene:
        """Return the visible shapes of the world; `world` is its name."""
        self._refresh()
        table = MeshTable()
        names = {node.frame: node.name for node in self._nodes if node.frame is not None}
        nodes, shapes, cut = [], 0, 0
        for node in self._nodes[:MOST_NODES]:
            kept = node.shapes[: MOST_SHAPES - shapes]
            shapes += len(kept)
            cut += len(node.shapes) - len(kept)
            nodes.append(self._written(node, names, tuple(_shape(it, node.frame, table) for it in kept)))
        cut += sum(len(node.shapes) for node in self._nodes[MOST_NODES:])
        return VisibleScene(
            world=world,
            revision=self._revision,
            nodes=tuple(nodes),
            meshes=tuple(table.meshes),
            sky=self._view.sky(),
            simplified=table.refused + cut,
        )

    def state(self, time_ms: int) -> SceneState:
        """Return the poses of the nodes that move or were moved, and the positions of the motors."""
        self._refresh()
        poses = dict(self._elsewhere)
        for node in self._nodes[:MOST_NODES]:
            if node.frame is not None and node.frame.moves:
                poses[node.name] = pose_numbers(node.frame.ground_pose)
        return SceneState(
            time_s=time_ms / 1000.0, revision=self._revision, poses=poses, joints=dict(self._joints())
        )

    def _joints(self) -> Iterator[tuple[str, float]]:
        robots = self._robots()
        for robot in robots:
            above = f"{robot.name}/" if len(robots) > 1 else ""
            for name, motor in robot.motors.items():
                yield f"{above}{name}", motor.angle_rad

    def _written(
        self, node: _Node, names: Mapping[Frame, str], shapes: tuple[VisualShape, ...]
    ) -> VisibleNode:
        around = () if node.frame is None else (it for it in node.frame.chain() if it is not node.frame)
        return VisibleNode(
            name=node.name,
            parent=next((names[frame] for frame in around if frame in names), ""),
            pose=self._starts[node.name],
            moves=node.frame is not None and node.frame.moves,
            robot=any(_carrier(robot.place) is node.frame for robot in self._robots()),
            shapes=shapes,
        )

    def _refresh(self) -> None:
        """Collect the nodes again if a visible shape changed; otherwise find the nodes that clients moved."""
        if self._view.changes != self._changes:
            self._collect()
        elif self._view.moves != self._moves:
            if any(frames_between(carrier, place) != pose for place, carrier, pose in self._offsets):
                self._collect()
            now = self._resting()
            self._elsewhere = {name: pose for name, pose in now.items() if pose != self._starts[name]}
        self._moves = self._view.moves

    def _collect(self) -> None:
        things = self._view.things()
        things += tuple(self._outlines(things))
        names = self._names()
        by_frame: dict[Frame | None, _Node] = {None: _Node(WORLD, None)}
        self._offsets = []
        for thing in things:
            carrier = None if thing.place is None else _carrier(thing.place)
            if carrier not in by_frame:
                by_frame[carrier] = _Node(names.get(carrier, ""), carrier)
            by_frame[carrier].shapes.append(thing)
            if thing.place is not None and carrier is not None and carrier is not thing.place:
                self._offsets.append((thing.place, carrier, frames_between(carrier, thing.place)))
        self._nodes = sorted(by_frame.values(), key=lambda node: _depth(node.frame))
        _make_unique(self._nodes)
        axes = next((it.place.axes for it in things if it.place is not None), None)
        at_rest = pose_numbers(Pose() if axes is None else Pose(rotation=axes))
        frames = {node.name: node.frame for node in self._nodes}
        self._starts = {
            name: at_rest if frame is None else pose_numbers(frame.ground_pose)
            for name, frame in frames.items()
        }
        self._elsewhere = {}
        self._changes = self._view.changes
        self._revision += 1

    def _outlines(self, things: Sequence[Drawn]) -> Iterator[Drawn]:
        """Yield the collision shapes of the robots that have no visible shapes."""
        seen = {around for thing in things for around in (thing.node, *thing.node.ancestors())}
        for robot in self._robots():
            root = robot.parts.node
            if root in seen:
                continue
            for node in (root, *root.descendants()):
                if node.place is not None and not node.left_out:
                    yield from _outline(node, node.place, self._view.mesh_files)

    def _resting(self) -> dict[str, PoseNumbers]:
        """Return the poses of the nodes that do not move by themselves."""
        return {
            node.name: pose_numbers(node.frame.ground_pose)
            for node in self._nodes
            if node.frame is not None and not node.frame.moves
        }

    def _names(self) -> Mapping[Frame | None, str]:
        """Return the names of all frames: DEF, name or type of the node, after the name of its robot."""
        named: dict[Frame | None, str] = {}
        robots = {robot.parts.node: robot for robot in self._robots()}
        for node in self._view.root.descendants():
            if node.place is not None:
                around = next((robots[it] for it in node.ancestors() if it in robots), None)
                above = "" if around is None else f"{around.name}/"
                named[node.place] = f"{above}{_title(node)}"
        for robot in robots.values():
            named[_carrier(robot.place)] = robot.name
        return named


def _title(node: SceneNode) -> str:
    return node.def_name or node.text("name") or node.type_name


def _outline(node: SceneNode, place: Frame, mesh_files: MeshFiles) -> Iterator[Drawn]:
    for shape in bounding_shapes(NodeReader(mesh_files=mesh_files), node, place):
        yield Drawn(
            kind=shape.kind,
            size=shape.size,
            color=_BODY,
            local=shape.local,
            place=shape.place,
            node=node,
            mesh=shape.mesh,
        )


def _carrier(place: Frame) -> Frame:
    """Return the innermost frame around `place` that moves by itself, or `place` if no such frame exists."""
    return next((frame for frame in place.chain() if frame.moves), place)


def _depth(frame: Frame | None) -> int:
    return 0 if frame is None else sum(1 for _ in frame.chain())


def _make_unique(nodes: Sequence[_Node]) -> None:
    """Number the nodes that have the same name."""
    used: dict[str, int] = {}
    for node in nodes:
        plain = (node.name or "part")[:200]
        used[plain] = number = used.get(plain, 0) + 1
        node.name = plain if number == 1 else f"{plain} #{number}"


def _shape(thing: Drawn, carrier: Frame | None, table: MeshTable) -> VisualShape:
    """Return a shape in the form of the protocol, in the frame of its carrier."""
    kind, size, pose = _KINDS[thing.kind], thing.size, thing.local
    index: int | None = None
    if thing.geometry == "Plane":
        kind, size = ShapeKind.PLANE, (size[0], size[1], 0.0)
        pose = pose.after(Pose((0.0, 0.0, thing.size[2] / 2.0)))
    elif thing.mesh is not None:
        mesh = thing.mesh
        counts = (len(mesh.points), len(mesh.triangles))
        index = table.index(mesh, lambda: Triangles(points=mesh.points, triangles=mesh.triangles), *counts)
        if index is None:
            kind, (middle, around) = ShapeKind.BOX, box_of(mesh.points)
            pose = pose.after(Pose(_scaled(middle, size)))
            size = _scaled(around, size)
    if thing.place is not None and carrier is not None and thing.place is not carrier:
        pose = frames_between(carrier, thing.place).after(pose)
    return VisualShape(kind=kind, size=size, pose=pose_numbers(pose), color=thing.color, mesh=index)


def _scaled(vector: Vector, factors: Vector) -> Numbers3:
    return vector[0] * factors[0], vector[1] * factors[1], vector[2] * factors[2]
