"""The visible shapes of an MJCF world and the poses of its bodies, as data for viewers.

The data has the form of `palaestra_protocol.scene`. Each body is a node. As in MuJoCo's own viewer, the geoms
of the groups 0 to 2 are visible. If a model has no geoms in these groups, all its geoms are visible. A height
field becomes a mesh. Textures are ignored. The data is computed only at a request.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from palaestra_protocol.scene import (
    MOST_NODES,
    MOST_SHAPES,
    WORLD,
    Color,
    Numbers3,
    PoseNumbers,
    SceneState,
    ShapeKind,
    Triangles,
    VisibleNode,
    VisibleScene,
    VisualShape,
)
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.model import HINGE, SLIDE, Model
from palaestra_sim.scene.appearance import MeshTable

_GEOM: Final = mujoco.mjtGeom
_SPHERE: Final = int(_GEOM.mjGEOM_SPHERE)
_CAPSULE: Final = int(_GEOM.mjGEOM_CAPSULE)
_MESH: Final = int(_GEOM.mjGEOM_MESH)
_FIELD: Final = int(_GEOM.mjGEOM_HFIELD)
_KINDS: Final = {
    int(_GEOM.mjGEOM_PLANE): ShapeKind.PLANE,
    _SPHERE: ShapeKind.SPHERE,
    _CAPSULE: ShapeKind.CAPSULE,
    int(_GEOM.mjGEOM_ELLIPSOID): ShapeKind.SPHERE,
    int(_GEOM.mjGEOM_CYLINDER): ShapeKind.CYLINDER,
    int(_GEOM.mjGEOM_BOX): ShapeKind.BOX,
}
_ROUND: Final = frozenset((_CAPSULE, int(_GEOM.mjGEOM_CYLINDER)))
_VISIBLE_GROUPS: Final = 3
# If a geom has this rgba, MuJoCo uses the color of the geom's material. Source: XML reference, geom/rgba
_UNPAINTED: Final = (0.5, 0.5, 0.5, 1.0)


class ModelAppearance:
    """The data of one model for viewers.

    Args:
        model: the model and its current state.
        robot: the number of the robot's body.
    """

    def __init__(self, model: Model, robot: int) -> None:
        self._model = model
        self._robot = robot
        self._names: tuple[str, ...] = ()
        self._starts: dict[str, PoseNumbers] = {}

    def scene(self, world: str) -> VisibleScene:
        """Return the bodies and visible shapes of the model; `world` is the name of the world."""
        compiled = self._model.model
        self._begin()
        table = MeshTable()
        kept = self._visible()[:MOST_SHAPES]
        shapes: list[list[VisualShape]] = [[] for _ in self._names]
        for geom in kept:
            body = int(compiled.geom_bodyid[geom])
            shape = self._shape(geom, table) if body < len(shapes) else None
            if shape is None:
                table.refused += 1
            else:
                shapes[body].append(shape)
        nodes = tuple(
            VisibleNode(
                name=name,
                parent="" if body == 0 else self._names[int(compiled.body_parentid[body])],
                pose=self._starts[name],
                moves=self._moves(body),
                robot=body == self._robot,
                shapes=tuple(shapes[body]),
            )
            for body, name in enumerate(self._names)
        )
        return VisibleScene(
            world=world, revision=1, nodes=nodes, meshes=tuple(table.meshes), simplified=table.refused
        )

    def state(self, time_ms: int) -> SceneState:
        """Return the poses of bodies that joints move, and of bodies that a client has moved."""
        self._begin()
        poses = {}
        for body, name in enumerate(self._names):
            pose = self._pose(body)
            if self._moves(body) or pose != self._starts[name]:
                poses[name] = pose
        return SceneState(time_s=time_ms / 1000.0, revision=1, poses=poses, joints=self._joints())

    def _begin(self) -> None:
        self._model.settle()
        if self._names:
            return
        model = self._model.model
        names = [WORLD, *(model.body(it).name or f"body{it}" for it in range(1, model.nbody))]
        self._names = tuple(names[:MOST_NODES])
        self._starts = {name: self._pose(body) for body, name in enumerate(self._names)}

    def _moves(self, body: int) -> bool:
        """Return whether a joint moves the body, or moves a body that carries it."""
        return bool(self._model.model.body_weldid[body])

    def _pose(self, body: int) -> PoseNumbers:
        x, y, z = self._model.data.xpos[body].tolist()
        w, i, j, k = self._model.data.xquat[body].tolist()
        return x, y, z, w, i, j, k

    def _joints(self) -> dict[str, float]:
        """Return the positions of all hinges and sliders that have names, by name."""
        model = self._model.model
        return {
            model.jnt(joint).name: float(self._model.positions(joint)[0])
            for joint in range(model.njnt)
            if model.jnt_type[joint] in {HINGE, SLIDE} and model.jnt(joint).name
        }

    def _visible(self) -> list[int]:
        model = self._model.model
        drawn = [it for it in range(model.ngeom) if self._color(it)[3] > 0.0]
        return [it for it in drawn if model.geom_group[it] < _VISIBLE_GROUPS] or drawn

    def _color(self, geom: int) -> Color:
        model = self._model.model
        rgba = tuple(model.geom_rgba[geom].tolist())
        material = int(model.geom_matid[geom])
        if material >= 0 and rgba == _UNPAINTED:
            rgba = tuple(model.mat_rgba[material].tolist())
        red, green, blue, alpha = (min(1.0, max(0.0, share)) for share in rgba)
        return red, green, blue, alpha

    def _shape(self, geom: int, table: MeshTable) -> VisualShape | None:
        """Return the visible shape of a geom; None if viewers cannot draw the type of the geom."""
        model = self._model.model
        kind = int(model.geom_type[geom])
        x, y, z = model.geom_pos[geom].tolist()
        pose = (x, y, z, *model.geom_quat[geom].tolist())
        index: int | None = None
        if kind in _KINDS:
            drawn, size = _KINDS[kind], _size(kind, model.geom_size[geom].tolist())
        elif kind in {_MESH, _FIELD}:
            drawn, size = ShapeKind.MESH, (1.0, 1.0, 1.0)
            data = int(model.geom_dataid[geom])
            mesh = _mesh(model, data) if kind == _MESH else _height_field(model, data)
            index = table.index((kind, data), lambda: mesh, len(mesh.points), len(mesh.triangles))
            if index is None:
                a, b, c = (2.0 * model.geom_aabb[geom][3:]).tolist()
                drawn, size = ShapeKind.BOX, (a, b, c)
        else:
            return None
        return VisualShape(kind=drawn, size=size, pose=pose, color=self._color(geom), mesh=index)


def _size(kind: int, halves: list[float]) -> Numbers3:
    """Return the size of a geom.

    MuJoCo has half lengths, and its length of a capsule does not include the caps.
    """
    x, y, z = (2.0 * half for half in halves)
    if kind == _SPHERE:
        return x, x, x
    if kind in _ROUND:
        return x, x, y + (x if kind == _CAPSULE else 0.0)
    return x, y, 0.0 if kind == int(_GEOM.mjGEOM_PLANE) else z


def _mesh(model: Any, number: int) -> Triangles:
    points, faces = int(model.mesh_vertadr[number]), int(model.mesh_faceadr[number])
    return _triangles(
        model.mesh_vert[points : points + int(model.mesh_vertnum[number])],
        model.mesh_face[faces : faces + int(model.mesh_facenum[number])],
    )


def _height_field(model: Any, number: int) -> Triangles:
    """Return the surface of a height field as triangles."""
    rows, columns = int(model.hfield_nrow[number]), int(model.hfield_ncol[number])
    first = int(model.hfield_adr[number])
    across, along, up, _ = model.hfield_size[number].tolist()
    heights = model.hfield_data[first : first + rows * columns] * up
    y, x = np.mgrid[-along : along : rows * 1j, -across : across : columns * 1j]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + columns], axis=1)
    upper = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return _triangles(np.stack([x.ravel(), y.ravel(), heights], axis=1), np.concatenate([lower, upper]))


def _triangles(points: Any, faces: Any) -> Triangles:
    return Triangles(
        points=tuple((x, y, z) for x, y, z in points.tolist()),
        triangles=tuple((a, b, c) for a, b, c in faces.tolist()),
    )
