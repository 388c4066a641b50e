"""Recordings of an episode in three dimensions: the visible shapes of the world, and the poses of its parts.

The poses of a step need a request to the simulator, which takes about half as long as the step. So only the
chosen episodes are recorded, while they are played a second time. The size of a recording is bounded.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Final

from palaestra_protocol.scene import (
    PoseNumbers,
    SceneState,
    ShapeKind,
    Triangles,
    VisibleScene,
    VisualShape,
)
from palaestra_trainer.errors import TrainerError
from palaestra_trainer.simulators.interface import Viewed

MOST_FRAMES: Final = 500
# Limit of the numbers in all poses of one recording. With three recordings, replays.json stays below 1 MiB.
MOST_NUMBERS: Final = 12_000
MOST_SCENE_CHARACTERS: Final = 400_000  # of the scene as JSON
_POSE: Final = 7


class NotFilmed(TrainerError):
    """An episode has no recording in three dimensions; the message gives the reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneFilm:
    """An episode in three dimensions.

    Attributes:
        scene: the visible shapes of the world.
        nodes: the names of the nodes whose pose in the episode differs from that in the scene.
        frames: for each frame, the pose of each of these nodes, at equal intervals of simulated time.
    """

    scene: VisibleScene
    nodes: tuple[str, ...]
    frames: tuple[tuple[PoseNumbers, ...], ...]

    def to_json(self, scene: int) -> dict[str, Any]:
        """Return the recording as JSON data; `scene` is the number of the scene in its file."""
        frames = [[round(number, 4) for pose in frame for number in pose] for frame in self.frames]
        return {"scene": scene, "nodes": list(self.nodes), "frames": frames}


class SceneFilming:
    """Records one episode; of a long episode only every second, fourth, ... step.

    Args:
        member: the simulator, whose state is requested for each frame.
    """

    def __init__(self, member: Viewed) -> None:
        self._member = member
        self._states: list[SceneState] = []
        self._scene: VisibleScene | None = None
        self._every, self._steps = 1, 0

    def look(self) -> None:
        """Record the current state; call this method after the reset and after each step.

        Raises:
            NotFilmed: the simulator does not describe its world.
            SimulatorDead, SimulatorHung, WrongData
        """
        due = self._steps % self._every == 0
        self._steps += 1
        if not due:
            return
        if self._scene is None:
            self._scene = self._member.visible_scene()
        if self._scene is None:
            raise NotFilmed("the simulator does not describe its world")
        self._states.append(self._member.visible_state())
        if len(self._states) == MOST_FRAMES:
            self._states = self._states[::2]
            self._every *= 2

    def film(self) -> SceneFilm:
        """Return the recording.

        Raises:
            NotFilmed: nothing was recorded, shapes changed during the episode, or the world is too large.
        """
        scene = self._scene
        if scene is None:
            raise NotFilmed("no step was recorded")
        if any(state.revision != scene.revision for state in self._states):
            raise NotFilmed("the shapes of the world changed during the episode")
        rest = {node.name: node.pose for node in scene.nodes}
        states = self._states
        moving = [
            name
            for name, pose in rest.items()
            if any(state.poses.get(name, pose) != pose for state in states)
        ]
        if _POSE * len(moving) > MOST_NUMBERS // 2:
            raise NotFilmed(f"{len(moving):,} parts of the world move, which are too many for a report")
        while _POSE * len(moving) * len(states) > MOST_NUMBERS:
            states = states[::2]
        frames = tuple(tuple(state.poses.get(name, rest[name]) for name in moving) for state in states)
        return SceneFilm(scene=lightened(scene), nodes=tuple(moving), frames=frames)


def characters(scene: VisibleScene) -> int:
    """Return the length of a scene as JSON."""
    return _characters(scene.to_json())


def lightened(scene: VisibleScene, most_characters: int = MOST_SCENE_CHARACTERS) -> VisibleScene:
    """Return the scene, shortened to at most `most_characters` of JSON.

    The largest meshes are replaced by their bounding boxes and counted in `simplified`.

    Raises:
        NotFilmed: the scene is too large even without meshes.
    """
    lengths = [_characters(mesh.to_json()) for mesh in scene.meshes]
    excess = characters(scene) - most_characters
    dropped: set[int] = set()
    for index in sorted(range(len(lengths)), key=lambda index: -lengths[index]):
        if excess <= 0:
            break
        dropped.add(index)
        excess -= lengths[index]
    if not dropped and excess <= 0:
        return scene
    kept = {old: new for new, old in enumerate(sorted(set(range(len(lengths))) - dropped))}
    boxes = sum(shape.mesh in dropped for node in scene.nodes for shape in node.shapes)
    lighter = replace(
        scene,
        nodes=tuple(
            replace(node, shapes=tuple(_boxed(shape, scene.meshes, kept) for shape in node.shapes))
            for node in scene.nodes
        ),
        meshes=tuple(scene.meshes[old] for old in kept),
        simplified=scene.simplified + boxes,
    )
    if characters(lighter) > most_characters:
        raise NotFilmed("the world has too many shapes for a report")
    return lighter


def _boxed(shape: VisualShape, meshes: tuple[Triangles, ...], kept: dict[int, int]) -> VisualShape:
    """Return a shape with the new number of its mesh, or else the box around a mesh that is not kept."""
    if shape.mesh is None:
        return shape
    if shape.mesh in kept:
        return replace(shape, mesh=kept[shape.mesh])
    points = meshes[shape.mesh].points or ((0.0, 0.0, 0.0),)
    low = [min(column) * size for column, size in zip(zip(*points, strict=True), shape.size, strict=True)]
    high = [max(column) * size for column, size in zip(zip(*points, strict=True), shape.size, strict=True)]
    middle = _turned(shape.pose, [(a + b) / 2 for a, b in zip(low, high, strict=True)])
    x, y, z = (place + moved for place, moved in zip(shape.pose, middle, strict=False))
    a, b, c = (abs(top - bottom) for bottom, top in zip(low, high, strict=True))
    return replace(shape, kind=ShapeKind.BOX, size=(a, b, c), pose=(x, y, z, *shape.pose[3:]), mesh=None)


def _turned(pose: PoseNumbers, point: Iterable[float]) -> tuple[float, float, float]:
    """Return a point turned by the quaternion of a pose."""
    (x, y, z), (w, i, j, k) = point, pose[3:]
    a, b, c = 2 * (j * z - k * y), 2 * (k * x - i * z), 2 * (i * y - j * x)
    return (x + w * a + j * c - k * b, y + w * b + k * a - i * c, z + w * c + i * b - j * a)


def _characters(content: Any) -> int:
    return len(json.dumps(content, separators=(",", ":")))
