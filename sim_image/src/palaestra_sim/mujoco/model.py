"""From the robots and shapes of a world to MuJoCo's model.

A robot is one body on three joints, an obstacle a body without joints. Which of them meet is decided by
heights, as in the stub: what a robot drives over or under does not touch it. MuJoCo has 32 bits for that, one
for each robot and three for all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.body import MujocoBody, servo
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.loose import LooseBody
from palaestra_sim.scene.geometry import Pose, to_quaternion
from palaestra_sim.scene.loose import Loose
from palaestra_sim.scene.physics import Figure, Push
from palaestra_sim.scene.places import Place
from palaestra_sim.scene.shapes import Shape

SEEN: Final = 0  # the group of geoms that rays and contacts meet
MASS_KG: Final = 23.0  # of a robot: a Robotino 3 with its batteries
STANDING_KG: Final = 1e5  # of one that nothing drives: it stands like a wall
_ROBOTS: Final = 1 << 0  # all robots touch each other
_LOOSE: Final = 1 << 1  # loose things touch each other and robots
_STANDING: Final = 1 << 2  # and whatever stands
_FIRST_ROBOT: Final = 3
_BITS: Final = 32
_LEAST_M3: Final = 1e-9
_FRICTION: Final = (1.0, 0.005, 0.0001)  # sliding: Webots' coulombFriction of two materials without their own

_GEOMS: Final = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ball": mujoco.mjtGeom.mjGEOM_SPHERE,
}


@dataclass(slots=True, eq=False)
class Built:
    """A compiled model with its data, and which part of it is of what.

    Attributes:
        figures: each robot that moves, with its body and the number of this in the model.
        geoms: by number, the shapes that are obstacles or outlines, with the body of a robot's.
        stands: the number of the body of each place that has obstacles.
        loose: the loose things.
    """

    model: Any
    data: Any
    figures: dict[Figure, tuple[MujocoBody, int]]
    geoms: dict[int, tuple[Shape, MujocoBody | None, int]]
    stands: dict[Place, int]
    loose: tuple[LooseBody, ...]

    def body_of(self, figure: Figure) -> int:
        """Return the number of a robot's body; -1 if it has none."""
        found = self.figures.get(figure)
        return -1 if found is None else found[1]

    def put_obstacles(self) -> None:
        """Put the obstacles where their places are now."""
        for place, number in self.stands.items():
            mocap = self.model.body_mocapid[number]
            _put(self.data.mocap_pos[mocap], self.data.mocap_quat[mocap], place.ground_pose)
        for figure, (_, number) in self.figures.items():
            self.model.body_pos[number][2] = figure.place.height_m

    def put_loose(self) -> bool:
        """Take what clients did to loose things; return whether they did anything."""
        changed = [thing for thing in self.loose if thing.place.put or thing.place.speed is not None]
        for thing in changed:
            thing.take()
        return bool(changed)

    def push(self, target: Figure | Loose, push: Push) -> None:
        """Let a force act on a robot or a loose thing until the forces are cleared."""
        found = self.figures.get(target) if not isinstance(target, Loose) else None
        numbers = [it.number for it in self.loose if it.place is target.place]
        number = numbers[0] if found is None else found[1]
        torque = np.array(push.torque)
        if push.point is not None:
            torque += np.cross(np.array(push.point) - self.data.xipos[number], push.force)
        self.data.xfrc_applied[number] += np.concatenate((push.force, torque))

    def settle(self) -> None:
        """Compute where everything is, from the joints and the obstacles."""
        mujoco.mj_kinematics(self.model, self.data)


def build(figures: Sequence[Figure], solids: Sequence[Shape], loose: Sequence[Loose]) -> Built:
    """Return the model of these robots, obstacles and loose things, in their present state."""
    courses = [thing.place.course for thing in loose]  # of the model before, if there was one
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    moving = [(it, it.body) for it in figures if isinstance(it.body, MujocoBody)]
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=_STANDING, conaffinity=0, friction=_FRICTION
    )
    marks: list[tuple[Any, Shape, MujocoBody | None, int]] = []
    stands = {
        place: _add_obstacle(spec, [shape for shape in solids if shape.place is place], moving, marks)
        for place in dict.fromkeys(shape.place for shape in solids)
    }
    robots = {
        figure: (body, _add_robot(spec, figure, body, index, marks))
        for index, (figure, body) in enumerate(moving)
    }
    things = [_add_loose(spec, thing, marks) for thing in loose]
    model = spec.compile()
    data = mujoco.MjData(model)
    built = Built(
        model=model,
        data=data,
        figures={figure: (body, added.id) for figure, (body, added) in robots.items()},
        geoms={geom.id: (shape, body, bit) for geom, shape, body, bit in marks},
        stands={place: added.id for place, added in stands.items()},
        loose=tuple(
            LooseBody(thing.place, model, data, added.id) for thing, added in zip(loose, things, strict=True)
        ),
    )
    built.put_obstacles()
    for index, (_, body) in enumerate(moving):
        part = slice(3 * index, 3 * index + 3)
        body.attach(built.data.qpos[part], built.data.qvel[part], built.data.ctrl[part])
    for thing, course in zip(built.loose, courses, strict=True):
        thing.begin(course)
    built.settle()
    return built


def _add_obstacle(
    spec: Any,
    shapes: Iterable[Shape],
    robots: Sequence[tuple[Figure, MujocoBody]],
    marks: list[tuple[Any, Shape, MujocoBody | None, int]],
) -> Any:
    added = spec.worldbody.add_body(mocap=True)  # MuJoCo looks at the pose of others once
    for shape in shapes:
        low, high = shape.heights()
        bits = _STANDING
        for index, (figure, body) in enumerate(robots):
            height = figure.place.height_m
            bottom, top = body.build.heights
            if low < top + height and bottom + height < high:
                bits |= _own_bit(index)
        marks.append((_add_geom(added, shape, shape.local, contype=bits, conaffinity=0), shape, None, 0))
    return added


def _add_loose(spec: Any, thing: Loose, marks: list[tuple[Any, Shape, MujocoBody | None, int]]) -> Any:
    added = spec.worldbody.add_body()
    added.add_freejoint()
    frame = thing.place.ground_pose.inverse
    geoms = [
        _add_geom(added, shape, frame.after(shape.pose), contype=_LOOSE, conaffinity=_STANDING | _LOOSE)
        for shape in thing.shapes
    ]
    density = thing.density
    if thing.mass_kg is not None:
        density = thing.mass_kg / max(sum(map(_volume_m3, thing.shapes)), _LEAST_M3)
    for geom, shape in zip(geoms, thing.shapes, strict=True):
        geom.density = density
        marks.append((geom, shape, None, 0))
    return added


def _volume_m3(shape: Shape) -> float:
    x, y, z = shape.size
    return x * y * z * {"box": 1.0, "cylinder": math.pi / 4.0, "ball": math.pi / 6.0}[shape.kind]


def _add_robot(
    spec: Any,
    figure: Figure,
    body: MujocoBody,
    index: int,
    marks: list[tuple[Any, Shape, MujocoBody | None, int]],
) -> Any:
    added = spec.worldbody.add_body(pos=[0.0, 0.0, figure.place.height_m])
    added.explicitinertial = True
    mass = STANDING_KG if body.base.drive is None else MASS_KG
    added.mass = mass
    turning = 0.5 * mass * body.radius_m**2
    added.inertia = [turning, turning, turning]
    for direction in ([1, 0, 0], [0, 1, 0]):
        added.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    added.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    added.add_site(name=f"base {index}")
    for axis, (gear, inertia) in enumerate(((0, mass), (1, mass), (5, turning))):
        gain, force = servo(axis, inertia)
        actuator = spec.add_actuator(
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            target=f"base {index}",
            gear=[float(at == gear) for at in range(6)],
            forcelimited=True,
            forcerange=[-force, force],
        )
        actuator.set_to_velocity(kv=gain)
    own = _own_bit(index)
    for number, (shape, pose) in enumerate(zip(body.build.outline, body.poses, strict=True)):
        geom = _add_geom(added, shape, pose, contype=_ROBOTS, conaffinity=own | _ROBOTS | _LOOSE)
        marks.append((geom, shape, body, 1 << number))
    return added


def _add_geom(body: Any, shape: Shape, pose: Pose, *, contype: int, conaffinity: int) -> Any:
    half = [length / 2.0 for length in shape.size]
    size = {"box": half, "cylinder": [half[0], half[2], 0.0], "ball": [half[0], 0.0, 0.0]}[shape.kind]
    geom = body.add_geom(
        type=_GEOMS[shape.kind],
        size=size,
        contype=contype,
        conaffinity=conaffinity,
        friction=_FRICTION,
        group=SEEN,
    )
    _put(geom.pos, geom.quat, pose)
    return geom


def _own_bit(index: int) -> int:
    return 1 << min(_FIRST_ROBOT + index, _BITS - 2)


def _put(position: Any, quaternion: Any, pose: Pose) -> None:
    position[:] = pose.position
    x, y, z, w = to_quaternion(pose.rotation)
    quaternion[:] = np.array((w, x, y, z))
