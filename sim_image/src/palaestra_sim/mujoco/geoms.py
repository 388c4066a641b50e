"""Make MuJoCo's geoms from shapes: set their sizes and masses, and which geoms may touch.

MuJoCo compares 32 bits of two geoms to decide whether they may touch. Three of the bits have a fixed meaning.
Each robot has one of the other bits, which is set in obstacles at the height of the robot.
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

SEEN: Final = 0  # the group of geoms that rays can meet
UNSEEN: Final = 1  # the group of a robot's own links while its sensors cast rays
ROBOTS: Final = 1 << 0  # all robots touch each other
LOOSE: Final = 1 << 1  # dynamic solids touch each other and robots
STANDING: Final = 1 << 2  # robots' links and dynamic solids touch obstacles and floors
_FIRST_ROBOT: Final = 3
_BITS: Final = 32
_LEAST_M3: Final = 1e-9
_LEAST_M: Final = 1e-6  # minimum length of the straight part of a capsule
FRICTION: Final = (1.0, 0.005, 0.0001)  # sliding (Webots' default coulombFriction), torsional, rolling

_GEOMS: Final = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ball": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}


@dataclass(frozen=True, slots=True)
class Touch:
    """The bits that decide which geoms touch each other: a geom's types, and the types that it may touch."""

    contype: int
    conaffinity: int


@dataclass(slots=True, eq=False)
class Marks:
    """The geoms of a model that is not compiled yet.

    Each entry has a geom and its shape. The entry of a robot's part also has the robot's body, and the bit of
    the part in `touched`.
    """

    entries: list[tuple[Any, Shape, MujocoBody | None, int]] = field(default_factory=list)

    def note(self, geom: Any, shape: Shape, body: MujocoBody | None = None, bit: int = 0) -> None:
        """Add an entry for a geom."""
        self.entries.append((geom, shape, body, bit))


def own_bit(index: int) -> int:
    """Return the bit for obstacles at the height of a robot; robots with a high index share the last bit."""
    return 1 << min(_FIRST_ROBOT + index, _BITS - 2)


def add_geom(spec: Any, body: Any, shape: Shape, pose: Pose, touch: Touch) -> Any:
    """Add a geom for a shape to a body; return the geom, whose mass is 0.

    `pose` is the pose of the geom in the frame of the body.
    """
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
    """Return the arguments that set the size of a geom; for a mesh, the argument that names the mesh."""
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
    """Set the mass of a geom from its shape and a density in kg/m3."""
    if shape.mesh is None:
        geom.density = density
    else:  # for a mesh, MuJoCo would compute the mass of its convex hull
        geom.mass = density * volume_m3(shape)


def add_matter(body: Any, matter: MassProperties, frame: Pose, geoms: Mapping[Shape, Any]) -> None:
    """Add the mass of a Solid to a body.

    Args:
        body: the body, in MuJoCo's MjSpec, that gets the mass.
        matter: the mass of the Solid.
        frame: the pose of the Solid in the frame of the body.
        geoms: the geoms of the Solid's shapes.
    """
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
    """Write a pose to MuJoCo's arrays of a position and a quaternion."""
    position[:] = pose.position
    x, y, z, w = to_quaternion(pose.rotation)
    quaternion[:] = np.array((w, x, y, z))


def _inertia(matter: MassProperties) -> tuple[float, ...]:
    """Return the default inertia of a mass, for a world that does not set the inertia.

    The mass fills the bounding boxes of its shapes. A mass without shapes is a ball with the density of
    water.
    """
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
