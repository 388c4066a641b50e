"""The model of the visible shapes: one geom for each shape, a camera, two lights, and the sky."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.scene.geometry import Vector, to_quaternion, triple
from palaestra_sim.scene.meshes import Mesh
from palaestra_sim.scene.visual_rays import Surface, surface_of
from palaestra_sim.scene.visuals import Drawn

_GEOMS: Final = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "ball": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}
# With these settings, shadows are off, edges are not smoothed, and round shapes have few corners. Without a
# graphics card, this makes rendering 10 times as fast.
_QUALITY: Final = {"shadowsize": 0, "offsamples": 0, "numslices": 20, "numstacks": 10, "numquads": 1}
_AMBIENT: Final = 0.45
_FROM_CAMERA: Final = 0.25
_FROM_ABOVE: Final = 0.30
SUN: Final = (-0.3, 0.4, -0.866)  # the direction of the sun's light: a unit vector, in axes where z points up
SKY: Final = 1  # the group of the sky's geom, which is the last geom of the model
PASSED: Final = 2  # the group of geoms through which the beams of a lidar pass, while the lidar measures


@dataclass(slots=True, eq=False)
class VisualModel:
    """A compiled model of the visible shapes, and the objects that are needed to render it.

    Attributes:
        things: the visible shapes; a shape's index is the number of its geom. The last geom is the sky.
        model, data: the model and the data of MuJoCo.
        positions, rotations: arrays of the geoms' poses in the frames of their shapes, (n, 3) and (n, 3, 3).
        planes: the ids of the geoms that are Planes.
        sun: the direction in which the sun's light travels, as a unit vector.
        scene, option, camera: the objects of MuJoCo's visualizer.
        surfaces: the surfaces of meshes that `faces` has looked at, by the numbers of their geoms.
    """

    things: tuple[Drawn, ...]
    model: Any
    data: Any
    positions: Any
    rotations: Any
    planes: Any
    sun: Vector
    scene: Any
    option: Any
    camera: Any
    surfaces: dict[int, Surface] = field(default_factory=dict)

    def faces(self, geom: int, start: Any, direction: Any, within_m: float) -> bool:
        """Return whether a ray meets a mesh from the front within some meters of its start."""
        if geom not in self.surfaces:
            self.surfaces[geom] = surface_of(self.things[geom])
        inward = self.things[geom].pose.inverse
        origin, way = inward.carry(triple(start.tolist())), inward.turned(triple(direction.tolist()))
        return self.surfaces[geom](origin, way) <= within_m


def build(things: Sequence[Drawn], sky: Vector, sun: Vector) -> VisualModel:
    """Return the model of these shapes.

    Args:
        things: all visible shapes, without the sky.
        sky: the color of the sky: red, green and blue from 0 to 1.
        sun: the direction in which the sun's light travels, as a unit vector.
    """
    spec = mujoco.MjSpec()
    for name, value in _QUALITY.items():
        setattr(spec.visual.quality, name, value)
    _light(spec, sun)
    spec.worldbody.add_camera(name="eye")
    meshes: dict[tuple[Mesh, Vector], str] = {}
    for thing in things:
        _add(spec, thing, meshes)
    _hang_sky(spec)
    spec.stat.extent = 1.0  # MuJoCo multiplies the distances to the ends of the frustum by the extent
    model = spec.compile()
    model.stat.extent = 1.0
    model.geom_rgba[-1] = (*sky, 1.0)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
    camera.fixedcamid = 0
    return VisualModel(
        things=tuple(things),
        model=model,
        data=data,
        positions=data.geom_xpos.copy(),
        rotations=data.geom_xmat.reshape(-1, 3, 3).copy(),
        planes=np.array([at for at, thing in enumerate(things) if thing.geometry == "Plane"], dtype=int),
        sun=sun,
        scene=mujoco.MjvScene(model, maxgeom=len(things) + 8),
        option=mujoco.MjvOption(),
        camera=camera,
    )


def _light(spec: Any, sun: Vector) -> None:
    headlight = spec.visual.headlight
    headlight.ambient = [_AMBIENT] * 3
    headlight.diffuse = [_FROM_CAMERA] * 3
    headlight.specular = [0.0] * 3
    light = spec.worldbody.add_light(dir=sun, diffuse=[_FROM_ABOVE] * 3, specular=[0.0] * 3, castshadow=False)
    light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL


def _hang_sky(spec: Any) -> None:
    """Add the sky as a flat box behind all shapes; MuJoCo's own sky takes longer than all shapes together."""
    material = spec.add_material(name="sky")
    material.emission = 0.5  # replaced before each image
    spec.worldbody.add_geom(
        name="sky",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[1.0, 1.0, 1.0],
        material="sky",
        group=SKY,
        contype=0,
        conaffinity=0,
    )


def glow(forward: Sequence[float], sun: Vector) -> float:
    """Return the emission with which the lit sky has exactly its own color, for a view along `forward`."""
    from_above = max(0.0, sum(a * b for a, b in zip(forward, sun, strict=True)))
    return 1.0 - _AMBIENT - _FROM_CAMERA - _FROM_ABOVE * from_above


def _add(spec: Any, thing: Drawn, meshes: dict[tuple[Mesh, Vector], str]) -> None:
    x, y, z = (length / 2.0 for length in thing.size)
    kind = _GEOMS[thing.kind]
    shape: dict[str, Any] = {"size": [x, y, z]}
    if thing.kind in {"cylinder", "capsule"}:
        shape["size"] = [x, z if thing.kind == "cylinder" else max(z - x, 1e-6), 0.0]
    elif thing.mesh is not None:
        shape = {"meshname": _mesh(spec, thing.mesh, thing.size, meshes)}
    qx, qy, qz, qw = to_quaternion(thing.local.rotation)
    spec.worldbody.add_geom(
        type=kind,
        pos=thing.local.position,
        quat=[qw, qx, qy, qz],
        rgba=thing.color,
        contype=0,
        conaffinity=0,
        **shape,
    )


def _mesh(spec: Any, mesh: Mesh, scale: Vector, meshes: dict[tuple[Mesh, Vector], str]) -> str:
    name = meshes.get((mesh, scale))
    if name is None:
        name = meshes[mesh, scale] = f"mesh {len(meshes)}"
        spec.add_mesh(
            name=name,
            scale=scale,
            uservert=np.ravel(mesh.points),
            userface=np.ravel(mesh.triangles),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
    return name
