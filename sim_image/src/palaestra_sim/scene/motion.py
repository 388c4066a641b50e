"""The motion of a frame in the world, from the motion of its robot and of the joints that carry the frame.

Velocities are in the axes of the world file, over the last basic step. A velocity is computed from the speeds
of the body and the motors, not from the change of a pose. So a robot that a client moves to another position
has no velocity, as in Webots.
"""

from __future__ import annotations

from typing import NamedTuple

from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector, turn
from palaestra_sim.scene.joints import JointFrame

_REST: Vector = (0.0, 0.0, 0.0)


class Motion(NamedTuple):
    """The velocity of a frame's origin in m/s and its angular velocity in rad/s, in the file's axes."""

    velocity: Vector = _REST
    turning: Vector = _REST


def motion_of(place: Frame, body: Body | None) -> Motion:
    """Return the motion of a frame on a robot; `body` is the body of that robot."""
    point = place.ground_pose.position
    velocity, turning = _REST, _REST
    if body is not None:
        vx, vy, omega = body.velocity
        turning = (0.0, 0.0, omega)
        velocity = _sum((vx, vy, 0.0), _cross(turning, (point[0] - body.x, point[1] - body.y, 0.0)))
    for link in place.chain():
        if isinstance(link, JointFrame) and link.joint.turning:
            added = _of_joint(link, link.joint.turning, point)
            velocity, turning = _sum(velocity, added.velocity), _sum(turning, added.turning)
    return Motion(place.from_ground(velocity), place.from_ground(turning))


class Trail:
    """The acceleration of a frame in world axes: the change of its velocity over the last basic step."""

    __slots__ = ("_before", "_body", "_place", "_step_s")

    def __init__(self, place: Frame, body: Body | None) -> None:
        self._place = place
        self._body = body
        self.reset()

    def reset(self) -> None:
        """Forget the last step; the acceleration is zero until the next step begins."""
        self._before = _REST
        self._step_s = 0.0

    def begin(self, step_s: float) -> None:
        """Record the velocity before a basic step."""
        self._before = motion_of(self._place, self._body).velocity
        self._step_s = step_s

    def acceleration(self) -> Vector:
        """Return the acceleration in m/s2; zero before the first step."""
        if self._step_s == 0.0:
            return _REST
        now = motion_of(self._place, self._body).velocity
        x, y, z = ((after - before) / self._step_s for after, before in zip(now, self._before, strict=True))
        return x, y, z


def _of_joint(end: JointFrame, speed: float, point: Vector) -> Motion:
    """Return the motion that a motor adds to a point on the end of its joint, in the axes of the ground."""
    around = end.parent.ground_pose if end.parent is not None else None
    axis, anchor = end.joint.axis, end.joint.anchor
    if around is not None:
        axis, anchor = turn(around.rotation, axis), around.carry(anchor)
    spin = (axis[0] * speed, axis[1] * speed, axis[2] * speed)
    if end.joint.slides:
        return Motion(velocity=spin)
    return Motion(_cross(spin, (point[0] - anchor[0], point[1] - anchor[1], point[2] - anchor[2])), spin)


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
