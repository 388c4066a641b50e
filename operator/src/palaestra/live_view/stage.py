"""Draw a scene with viser, and move its nodes.

Each node of the scene becomes a frame of viser, with its shapes below. The frames have numbers as names,
because in viser's names a slash means a child.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from palaestra_protocol.scene import (
    PoseNumbers,
    SceneState,
    ShapeKind,
    TargetMarker,
    VisibleScene,
    VisualShape,
)

_ENDLESS_M: Final = 20.0  # the drawn size of an infinite plane
_SHEET_M: Final = 0.002
_TARGET: Final = (220, 60, 50)
_RINGS: Final = 8  # rings of a capsule's cap
_SIDES: Final = 24
_OPAQUE: Final = 0.999


class Stage:
    """The scene of one simulator in a viser server.

    Args:
        server: the viser server.

    Attributes:
        revision: the revision of the drawn scene; None before the first scene.
    """

    def __init__(self, server: Any) -> None:
        self._server = server
        self._nodes: dict[str, Any] = {}
        self._shapes: list[Any] = []
        self._resting: dict[str, PoseNumbers] = {}
        self._elsewhere: set[str] = set()
        self._target: Any = None
        self._target_radius_m = 0.0
        self.revision: int | None = None

    def clear(self) -> None:
        """Remove all drawn objects."""
        for handle in self._nodes.values():
            handle.remove()
        if self._target is not None:
            self._target.remove()
        self._nodes, self._target, self.revision = {}, None, None

    def show(self, scene: VisibleScene) -> None:
        """Draw a scene in place of the earlier scene."""
        with self._server.atomic():
            self.clear()
            for index, node in enumerate(scene.nodes):
                path = f"/world/{index}"
                frame = self._server.scene.add_frame(path, show_axes=False)
                _put(frame, node.pose)
                self._nodes[node.name] = frame
                for number, shape in enumerate(node.shapes):
                    _draw(self._server.scene, f"{path}/{number}", shape, scene)
            self._resting = {node.name: node.pose for node in scene.nodes if not node.moves}
            self._elsewhere = set()
            self.revision = scene.revision

    def move(self, state: SceneState) -> None:
        """Move each node to its pose in `state`; a node without a pose returns to its first pose."""
        with self._server.atomic():
            for name, pose in state.poses.items():
                if (frame := self._nodes.get(name)) is not None:
                    _put(frame, pose)
            back = self._elsewhere - state.poses.keys()
            for name in back & self._nodes.keys():
                _put(self._nodes[name], self._resting[name])
            self._elsewhere = self._resting.keys() & state.poses.keys()
            if state.target is not None:
                self._mark(state.target)

    def _mark(self, target: TargetMarker) -> None:
        if self._target is None or target.radius_m != self._target_radius_m:
            self._target_radius_m = target.radius_m
            self._target = self._server.scene.add_cylinder(
                "/target", radius=max(target.radius_m, 0.01), height=0.01, color=_TARGET, opacity=0.5
            )
        self._target.position = target.position


def _put(handle: Any, pose: PoseNumbers) -> None:
    handle.position = pose[:3]
    handle.wxyz = pose[3:]


def _draw(scene: Any, name: str, shape: VisualShape, whole: VisibleScene) -> None:
    red, green, blue, alpha = shape.color
    look: dict[str, Any] = {
        "color": (round(255 * red), round(255 * green), round(255 * blue)),
        "opacity": None if alpha >= _OPAQUE else alpha,
        "position": shape.pose[:3],
        "wxyz": shape.pose[3:],
    }
    x, y, z = shape.size
    match shape.kind:
        case ShapeKind.BOX:
            scene.add_box(name, dimensions=shape.size, **look)
        case ShapeKind.PLANE:
            size = (x or _ENDLESS_M, y or _ENDLESS_M, _SHEET_M)
            scene.add_box(name, dimensions=size, cast_shadow=False, **look)
        case ShapeKind.CYLINDER:
            scene.add_cylinder(name, radius=0.5, height=1.0, scale=(x, y, z), **look)
        case ShapeKind.SPHERE:
            scene.add_icosphere(name, radius=0.5, scale=(x, y, z), **look)
        case ShapeKind.CAPSULE:
            points, faces = capsule(x / 2.0, z)
            scene.add_mesh_simple(name, points, faces, **look)
        case ShapeKind.MESH:
            mesh = whole.meshes[shape.mesh or 0]
            points, faces = np.array(mesh.points), np.array(mesh.triangles, dtype=np.uint32)
            scene.add_mesh_simple(
                name, points, faces, scale=shape.size, flat_shading=True, side="double", **look
            )


def capsule(radius_m: float, height_m: float) -> tuple[Any, Any]:
    """Return points (n, 3) and triangles (m, 3) of a capsule along z; its height includes the caps."""
    middle = max(0.0, height_m / 2.0 - radius_m)
    angles = np.linspace(-np.pi / 2.0, np.pi / 2.0, 2 * _RINGS)
    around = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    radii, heights = radius_m * np.cos(angles), radius_m * np.sin(angles) + np.sign(angles) * middle
    points = np.stack(
        [
            np.outer(radii, np.cos(around)),
            np.outer(radii, np.sin(around)),
            np.repeat(heights[:, None], _SIDES, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    ring, side = np.meshgrid(np.arange(2 * _RINGS - 1), np.arange(_SIDES), indexing="ij")
    a = (ring * _SIDES + side).ravel()
    b = (ring * _SIDES + (side + 1) % _SIDES).ravel()
    faces = np.concatenate([np.stack([a, b, b + _SIDES], 1), np.stack([a, b + _SIDES, a + _SIDES], 1)])
    return points, faces.astype(np.uint32)
