"""The visible shapes of a simulated world and their poses, as data for a viewer.

A `VisibleScene` has the constant data: the nodes of the world and their visible shapes. A `SceneState` has
the data that a step changes. Both are plain JSON. A simulator writes them, a sidecar forwards them, and a
viewer or a report reads them; these programs share only this module.

Lengths are in meters, angles in radians, times in seconds of the simulation. The z axis of the world's frame
points up, even if y points up in the world file. A pose is a tuple of seven numbers: x, y, z, and the unit
quaternion w, x, y, z. A node's pose is in the frame of the world, not in the frame of its parent. A shape's
pose is in the frame of its node.

Readers accept a bounded number of nodes, shapes and points. If a mesh would exceed the bound, the writer
replaces it by its bounding box and counts it in `simplified`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final, Self, cast

from palaestra_protocol.fields import MOST_NAME, MOST_TEXT, Fields, ProtocolError, clipped, known

Numbers3 = tuple[float, float, float]
Color = tuple[float, float, float, float]  # red, green, blue, alpha, from 0 to 1
PoseNumbers = tuple[float, float, float, float, float, float, float]

MOST_SCENE_BYTES: Final = 2**24
MOST_STATE_BYTES: Final = 2**18
MOST_NODES: Final = 1024
MOST_SHAPES: Final = 8192
MOST_MESHES: Final = 1024
MOST_POINTS: Final = 2**16  # total of all meshes
MOST_TRIANGLES: Final = 2**17
MOST_JOINTS: Final = 1024
MOST_TERMS: Final = 64
LARGEST: Final = 1e9  # largest absolute value of any number
AT_ORIGIN: Final[PoseNumbers] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
WORLD: Final = "world"  # the name of the node that holds all shapes that do not move
TARGET_M: Final = 0.2  # radius of a drawn target; a task of the arena ends when the robot is inside it
_DIGITS: Final = 5  # digits after the decimal point: hundredths of a millimeter


class ShapeKind(StrEnum):
    """The kinds of visible shapes; each shape is centered at its pose.

    The axis of a cylinder or capsule is z. A capsule's height includes both caps. A plane lies in x and y,
    and its upper side is visible; a size of 0 means that the plane is infinite.
    """

    BOX = "box"
    SPHERE = "sphere"
    CYLINDER = "cylinder"
    CAPSULE = "capsule"
    PLANE = "plane"
    MESH = "mesh"


@dataclass(frozen=True, slots=True, kw_only=True)
class Triangles:
    """A mesh: points in meters, and triangles.

    A triangle has the indices of three points, counterclockwise as seen from outside.
    """

    points: tuple[Numbers3, ...]
    triangles: tuple[tuple[int, int, int], ...]

    def to_json(self) -> dict[str, Any]:
        """Return the mesh as JSON data: two flat lists."""
        return {
            "points": [_short(number) for point in self.points for number in point],
            "triangles": [corner for three in self.triangles for corner in three],
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format, or a triangle refers to a missing point.
        """
        fields = Fields(content, path)
        flat = _numbers(fields, "points", 3 * MOST_POINTS)
        corners = fields.parts("triangles", _index, 3 * MOST_TRIANGLES)
        if len(flat) % 3 or len(corners) % 3:
            fact = "the number of coordinates or corners is not a multiple of 3"
            raise ProtocolError(f"{path or 'body'}: {fact}")
        if corners and max(corners) >= len(flat) // 3:
            raise fields.error("triangles", "refers to a point that does not exist")
        return cls(
            points=tuple(zip(flat[::3], flat[1::3], flat[2::3], strict=True)),
            triangles=tuple(zip(corners[::3], corners[1::3], corners[2::3], strict=True)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class VisualShape:
    """One visible shape.

    Attributes:
        kind: the kind of shape.
        size: the extent along x, y and z in meters; for round shapes: diameter, diameter, height. For a mesh,
            the factors by which its points are multiplied.
        pose: the pose in the frame of the node.
        color: red, green, blue and alpha of the whole shape, 0 to 1.
        mesh: for the kind MESH, the index of the mesh in `VisibleScene.meshes`; otherwise None.
    """

    kind: ShapeKind
    size: Numbers3
    pose: PoseNumbers = AT_ORIGIN
    color: Color = (0.7, 0.7, 0.7, 1.0)
    mesh: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the shape as JSON data."""
        content: dict[str, Any] = {
            "kind": self.kind.value,
            "size": _list(self.size),
            "pose": _list(self.pose),
            "color": [round(share, 3) for share in self.color],
        }
        return content if self.mesh is None else content | {"mesh": self.mesh}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format.
        """
        fields = Fields(content, path)
        kind = fields.choice("kind", ShapeKind)
        return cls(
            kind=kind,
            size=cast("Numbers3", _exactly(fields, "size", 3, 0.0)),
            pose=_pose(fields, "pose"),
            color=cast("Color", _exactly(fields, "color", 4, 0.0, 1.0)),
            mesh=fields.whole("mesh", 0, MOST_MESHES - 1) if kind is ShapeKind.MESH else None,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class VisibleNode:
    """A rigid part of the world, and the frame of its shapes.

    Attributes:
        name: unique in the scene.
        parent: the name of the parent node; "" for a node without parent.
        pose: the pose in the frame of the world at the time when the scene was read.
        moves: whether each `SceneState` has the node's current pose; otherwise `pose` stays valid.
        robot: whether the node is a whole robot, not a part of a robot.
        shapes: the visible shapes of the node.
    """

    name: str
    parent: str = ""
    pose: PoseNumbers = AT_ORIGIN
    moves: bool = False
    robot: bool = False
    shapes: tuple[VisualShape, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the node as JSON data."""
        return {
            "name": clipped(self.name, MOST_NAME),
            "parent": clipped(self.parent, MOST_NAME),
            "pose": _list(self.pose),
            "moves": self.moves,
            "robot": self.robot,
            "shapes": [shape.to_json() for shape in self.shapes],
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format.
        """
        fields = Fields(content, path)
        return cls(
            name=fields.text("name", MOST_NAME, least=1),
            parent=fields.text("parent", MOST_NAME),
            pose=_pose(fields, "pose"),
            moves=fields.flag("moves"),
            robot=fields.flag("robot"),
            shapes=fields.parts("shapes", VisualShape.from_json, MOST_SHAPES),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class VisibleScene:
    """The nodes of one world and their visible shapes.

    Attributes:
        world: the name of the world, for people.
        revision: a number that changes when shapes, colors or nodes change. If a state has another revision,
            the viewer needs a new scene.
        nodes: at most MOST_NODES nodes; a parent comes before its children.
        meshes: the meshes; several shapes may use the same mesh.
        sky: red, green and blue of the background, from 0 to 1.
        simplified: the number of shapes that were too large; each of them was replaced by its bounding box,
            or left out.
    """

    world: str
    revision: int
    nodes: tuple[VisibleNode, ...]
    meshes: tuple[Triangles, ...] = ()
    sky: Numbers3 = (0.62, 0.76, 0.92)
    simplified: int = 0

    def to_json(self) -> dict[str, Any]:
        """Return the scene as JSON data."""
        return {
            "world": clipped(self.world, MOST_TEXT),
            "revision": self.revision,
            "nodes": [node.to_json() for node in self.nodes],
            "meshes": [mesh.to_json() for mesh in self.meshes],
            "sky": [round(share, 3) for share in self.sky],
            "simplified": self.simplified,
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format, or exceeds a bound.
        """
        fields = Fields(content, path)
        scene = cls(
            world=fields.text("world"),
            revision=fields.whole("revision"),
            nodes=fields.parts("nodes", VisibleNode.from_json, MOST_NODES),
            meshes=fields.parts("meshes", Triangles.from_json, MOST_MESHES),
            sky=cast("Numbers3", _exactly(fields, "sky", 3, 0.0, 1.0)),
            simplified=fields.whole("simplified"),
        )
        scene._require_whole(path)
        return scene

    def _require_whole(self, path: str) -> None:
        """Raise ProtocolError if names repeat, a mesh is missing, or there are too many shapes or points."""
        names = [node.name for node in self.nodes]
        shapes = [shape for node in self.nodes for shape in node.shapes]
        if len(set(names)) != len(names):
            raise ProtocolError(f"{path or 'body'}.nodes: two nodes have the same name")
        if len(shapes) > MOST_SHAPES or sum(len(mesh.points) for mesh in self.meshes) > MOST_POINTS:
            raise ProtocolError(f"{path or 'body'}: more than {MOST_SHAPES} shapes or {MOST_POINTS} points")
        if any(shape.mesh is not None and shape.mesh >= len(self.meshes) for shape in shapes):
            raise ProtocolError(f"{path or 'body'}.nodes: a shape refers to a mesh that does not exist")


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetMarker:
    """The target position of a robot, in the frame of the world, and the radius of the drawn marker."""

    position: Numbers3
    radius_m: float = TARGET_M

    def to_json(self) -> dict[str, Any]:
        """Return the target as JSON data."""
        return {"position": _list(self.position), "radius_m": _short(self.radius_m)}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format.
        """
        fields = Fields(content, path)
        return cls(
            position=cast("Numbers3", _exactly(fields, "position", 3)),
            radius_m=fields.number("radius_m", 0.0, LARGEST),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneState:
    """The state of a world after one step.

    A simulator sets `time_s`, `revision`, `poses` and `joints`; a trainer sets the other fields.

    Attributes:
        time_s: simulated time since the last reset.
        revision: the revision of the scene to which the poses belong.
        poses: the poses of the nodes that move, by node name, in the frame of the world.
        joints: the positions of motors and position sensors, in rad or m, by device name.
        target: the target position of the robot; None if unknown.
        episode: the number of the episode, counted from 1; None if unknown.
        step: the number of the step in the episode; None if unknown.
        rewards: the newest value of each term of the reward, by name.
    """

    time_s: float
    revision: int = 0
    poses: Mapping[str, PoseNumbers] = field(default_factory=dict)
    joints: Mapping[str, float] = field(default_factory=dict)
    target: TargetMarker | None = None
    episode: int | None = None
    step: int | None = None
    rewards: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the state as JSON data."""
        return {
            "time_s": _short(self.time_s),
            "revision": self.revision,
            "poses": {clipped(name, MOST_NAME): _list(pose) for name, pose in self.poses.items()},
            "joints": _known(self.joints),
            "target": None if self.target is None else self.target.to_json(),
            "episode": self.episode,
            "step": self.step,
            "rewards": _known(self.rewards),
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format, or exceeds a bound.
        """
        fields = Fields(content, path)
        poses = fields.part("poses", Fields)
        return cls(
            time_s=fields.number("time_s", 0.0, LARGEST),
            revision=fields.whole("revision"),
            poses={name: _pose(poses, name) for name in _names(content, "poses", MOST_NODES)},
            joints=_named(fields, content, "joints", MOST_JOINTS),
            target=fields.part("target", TargetMarker.from_json) if fields.has("target") else None,
            episode=fields.whole("episode") if fields.has("episode") else None,
            step=fields.whole("step") if fields.has("step") else None,
            rewards=_named(fields, content, "rewards", MOST_TERMS),
        )


def _short(number: float) -> float:
    """Return a number rounded to `_DIGITS`; 0 for infinities and NaN, because JSON has no text for them."""
    return round(known(number) or 0.0, _DIGITS)


def _list(numbers: tuple[float, ...]) -> list[float]:
    return [_short(number) for number in numbers]


def _known(values: Mapping[str, float]) -> dict[str, float]:
    """Return the finite values; names that are too long are cut."""
    return {
        clipped(name, MOST_NAME): _short(value) for name, value in values.items() if known(value) is not None
    }


def _number(value: object, path: str) -> float:
    return Fields({"number": value}, path).number("number", -LARGEST, LARGEST)


def _index(value: object, path: str) -> int:
    return Fields({"index": value}, path).whole("index", 0, MOST_POINTS - 1)


def _numbers(fields: Fields, name: str, most: int) -> tuple[float, ...]:
    return fields.parts(name, _number, most)


def _exactly(
    fields: Fields, name: str, count: int, least: float = -LARGEST, most: float = LARGEST
) -> tuple[float, ...]:
    """Return `count` numbers from `least` to `most`; any other list raises ProtocolError."""
    found = _numbers(fields, name, count)
    if len(found) != count or not all(least <= number <= most for number in found):
        raise fields.error(name, f"is not {count} numbers from {least:g} to {most:g}")
    return found


def _pose(fields: Fields, name: str) -> PoseNumbers:
    return cast("PoseNumbers", _exactly(fields, name, 7))


def _names(content: object, name: str, most: int) -> tuple[str, ...]:
    """Return the keys of the object in the field `name`; `Fields` has already accepted `content`."""
    found = tuple(cast("Mapping[str, Mapping[str, object]]", content)[name])
    if len(found) > most or any(len(one) > MOST_NAME for one in found):
        raise ProtocolError(f"{name}: has more than {most} names, or one is longer than {MOST_NAME}")
    return found


def _named(fields: Fields, content: object, name: str, most: int) -> dict[str, float]:
    inner = fields.part(name, Fields)
    return {one: inner.number(one, -LARGEST, LARGEST) for one in _names(content, name, most)}
