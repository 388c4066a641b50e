"""Shapes as MuJoCo's geoms: their sizes, the geoms that they touch, and their masses.

32 bits decide which geoms touch: one for the height range of each robot, and three for all.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.scene.geometry import Pose, to_quaternion
from palaestra_sim.scene.mass import MassProperties, volume_m3
from palaestra_sim.scene.shapes import Shape

if TYPE_CHECKING:
    from palaestra_sim.mujoco.body import MujocoBody

SEEN: Final = 0  # the group of geoms that rays and contacts meet
UNSEEN: Final = 1  # while a robot's sensors cast rays, the group of its own links
ROBOTS: Final = 1 << 0  # all robots touch each other
LOOSE: Final = 1 << 1  # dynamic solids touch each other and robots
STANDING: Final = 1 << 2  # robots' links and dynamic solids touch obstacles and floors
_FIRST_ROBOT: Final = 3
_BITS: Final = 32
_LEAST_M3: Final = 1e-9
_LEAST_M: Final = 1e-6  # minimum length of the straight part of a capsule
FRICTION: Final = (1.0, 0.005, 0.0001)  # sliding: Webots' coulombFriction of two materials without their own

_GEOMS: Final = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ball": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}


@dataclass(frozen=True, slots=True)
class Touch:
    """The geoms that a geom touches, as bits of MuJoCo: its own type, and the types that it meets."""

    contype: int
    conaffinity: int


@dataclass(slots=True, eq=False)
class Marks:
    """The geoms of a model under construction, each with its shape; for a robot also its body and bit."""

    entries: list[tuple[Any, Shape, MujocoBody | None, int]] = field(default_factory=list)

    def note(self, geom: Any, shape: Shape, body: MujocoBody | None = None, bit: int = 0) -> None:
        """Record the shape of a geom, and its robot's body."""
        self.entries.append((geom, shape, body, bit))


def own_bit(index: int) -> int:
    """Return the bit for the height range of a robot; robots beyond the last bit share it."""
    return 1 << min(_FIRST_ROBOT + index, _BITS - 2)


def add_geom(spec: Any, body: Any, shape: Shape, pose: Pose, touch: Touch) -> Any:
    """Add a shape to a body of a model, at a pose in its frame; return the geom, whose mass is 0."""
    geom = body.add_geom(
        type=_GEOMS[shape.kind],
        **_form(spec, shape),
        contype=touch.contype,
        conaffinity=touch.conaffinity,
        friction=FRICTION,
        group=SEEN,
        density=0.0,
    )
    put(geom.pos, geom.quat, pose)
    return geom


def _form(spec: Any, shape: Shape) -> dict[str, Any]:
    """Return the arguments of a geom that are its size; of a mesh, its name. Rays meet its triangles."""
    x, _, z = half = [length / 2.0 for length in shape.size]
    match shape.kind:
        case "box":
            return {"size": half}
        case "cylinder":
            return {"size": [x, z, 0.0]}
        case "capsule":
            return {"size": [x, max(z - x, _LEAST_M), 0.0]}
    if shape.mesh is None:
        return {"size": [x, 0.0, 0.0]}
    name = f"mesh {len(spec.meshes)}"
    spec.add_mesh(
        name=name,
        uservert=np.ravel(shape.mesh.points),
        userface=np.ravel(shape.mesh.triangles),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
    )
    return {"meshname": name}


def fill(geom: Any, shape: Shape, density: float) -> None:
    """Give a geom the mass of its shape, from a density in kg/m3."""
    if shape.mesh is None:
        geom.density = density
    else:  # MuJoCo would fill the convex hull
        geom.mass = density * volume_m3(shape)


def add_matter(body: Any, matter: MassProperties, frame: Pose, geoms: Mapping[Shape, Any]) -> None:
    """Give a body the mass of a Solid with the pose `frame` in the body; `geoms` are those of its shapes."""
    if matter.mass_kg <= 0.0:
        return
    if matter.shapes and matter.center is None and matter.inertia is None:
        spread(matter.mass_kg, matter.shapes, [geoms[shape] for shape in matter.shapes])
        return
    inner = body.add_body()
    put(inner.pos, inner.quat, frame)
    inner.explicitinertial = True
    inner.mass = matter.mass_kg
    inner.ipos = list(matter.center or (0.0, 0.0, 0.0))
    inner.fullinertia = list(matter.inertia or _inertia(matter))


def spread(mass_kg: float, shapes: Sequence[Shape], geoms: Iterable[Any]) -> None:
    """Divide a mass among geoms by their volumes."""
    density = mass_kg / max(sum(map(volume_m3, shapes)), _LEAST_M3)
    for geom, shape in zip(geoms, shapes, strict=True):
        fill(geom, shape, density)


def put(position: Any, quaternion: Any, pose: Pose) -> None:
    """Write a pose to arrays of MuJoCo."""
    position[:] = pose.position
    x, y, z, w = to_quaternion(pose.rotation)
    quaternion[:] = np.array((w, x, y, z))


def _inertia(matter: MassProperties) -> tuple[float, ...]:
    """Return the inertia of boxes around its shapes; without shapes, of a ball as dense as water."""
    if not matter.shapes:
        radius_m = (matter.mass_kg / 1000.0 * 0.239) ** (1.0 / 3.0)
        turning = 0.4 * matter.mass_kg * radius_m**2
        return turning, turning, turning, 0.0, 0.0, 0.0
    whole = max(sum(map(volume_m3, matter.shapes)), _LEAST_M3)
    xx = yy = zz = 0.0
    for shape in matter.shapes:
        part = matter.mass_kg * volume_m3(shape) / whole / 12.0
        x, y, z = shape.size
        xx, yy, zz = (
            xx + part * (y * y + z * z),
            yy + part * (x * x + z * z),
            zz + part * (x * x + y * y),
        )
    return xx, yy, zz, 0.0, 0.0, 0.0
