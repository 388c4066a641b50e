"""Joints, and the frames of their end points; these frames move with the joints.

A hinge turns its end point about an axis through the anchor. A slider moves its end point along the axis. The
world file gives the pose of the end point at the `position` that the joint has in that file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import AxisAngle, Pose, Vector, from_axis_angle, to_axis_angle, turn
from palaestra_sim.scene.motors import Motor


class Rubbing(NamedTuple):
    """The resistance of a joint to motion; for a slider, replace N m by N, and rad by m.

    Attributes:
        damping: the damping constant in N m s/rad.
        friction: the friction in N m; a motor with a position or velocity command overcomes it.
        spring: the constant of a spring toward position 0, in N m/rad.
    """

    damping: float = 0.0
    friction: float = 0.0
    spring: float = 0.0


FREE: Final = Rubbing()


@dataclass(slots=True, kw_only=True, eq=False)
class Joint:
    """A hinge or a slider, in the frame of the node that contains it.

    Attributes:
        axis: unit vector of the joint's axis.
        anchor: a point on the axis of a hinge, in meters.
        slides: whether the joint is a slider.
        start: the position in the file, in rad or m.
        motor: the motor that moves the joint; None if only a client or a physics with forces moves the joint.
        stops: the lowest and the highest position; if both are equal, the joint has no stops.
        rubbing: the joint's resistance to motion.
        position: the position of a joint without a motor, in rad or m.
        speed: the speed of a joint without a motor, in rad/s or m/s.
        brake: the damping by the brake of a joint without a motor, in N m s/rad.
    """

    axis: Vector
    anchor: Vector = (0.0, 0.0, 0.0)
    slides: bool = False
    start: float = 0.0
    motor: Motor | None = None
    stops: tuple[float, float] = (0.0, 0.0)
    rubbing: Rubbing = FREE
    position: float = field(init=False)
    speed: float = field(init=False, default=0.0)
    brake: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self.position = self.start

    @property
    def now(self) -> float:
        """The current position, in rad or m."""
        return self.position if self.motor is None else self.motor.angle_rad

    @property
    def turning(self) -> float:
        """The current speed, in rad/s or m/s."""
        return self.speed if self.motor is None else self.motor.speed_rad_s

    @property
    def braking(self) -> float:
        """The current damping by the brake, in N m s/rad."""
        return self.brake if self.motor is None else self.motor.damping

    def follow(self, position: float, speed: float) -> None:
        """Set the position and the speed that the physics has computed."""
        if self.motor is None:
            self.position, self.speed = position, speed
        else:
            self.motor.angle_rad, self.motor.speed_rad_s = position, speed

    def halt(self) -> None:
        """Stop the motion of the joint."""
        self.follow(self.now, 0.0)

    def put(self, position: float) -> None:
        """Move the joint to a position and stop it; its motor holds that position, as in Webots."""
        if self.motor is None:
            self.position, self.speed = position, 0.0
        else:
            self.motor.put(position)

    def carry(self, pose: Pose) -> Pose:
        """Return the current pose of a frame that has `pose` in the world file."""
        moved = self.now - self.start
        if moved == 0.0:
            return pose
        x, y, z = self.axis
        if self.slides:
            return Pose((x * moved, y * moved, z * moved)).after(pose)
        turned = Pose(rotation=from_axis_angle((x, y, z, moved)))
        ax, ay, az = self.anchor
        tx, ty, tz = turn(turned.rotation, self.anchor)
        return Pose((ax - tx, ay - ty, az - tz), turned.rotation).after(pose)


class JointFrame(Frame):
    """The frame of a joint's end point."""

    moves = True

    def __init__(self, parent: Frame | None, translation: Vector, rotation: AxisAngle, joint: Joint) -> None:
        super().__init__(parent, translation, rotation)
        self.joint = joint

    @property
    def start(self) -> Pose:
        """The pose in the parent's frame, at the joint's position in the world file."""
        return Pose(self._translation, from_axis_angle(self._rotation))

    @property
    def placeable(self) -> bool:
        """Always False, because only the joint moves this frame."""
        return False

    @property
    def pose(self) -> Pose:
        """The current pose in the parent's frame."""
        return self.joint.carry(Pose(self._translation, from_axis_angle(self._rotation)))

    @property
    def translation(self) -> Vector:
        """X, y, z in meters, in the parent's frame."""
        return self.pose.position

    @translation.setter
    def translation(self, value: Vector) -> None:
        self._translation = value

    @property
    def rotation(self) -> AxisAngle:
        """Axis and angle in radians, in the parent's frame."""
        return to_axis_angle(self.pose.rotation)

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        self._rotation = value

    def return_to_start(self) -> None:
        """Return a joint without a motor to its start; `Motor.reset` returns the other joints."""
        if self.joint.motor is None:
            self.joint.put(self.joint.start)
            self.joint.brake = 0.0


def unit(vector: Vector) -> Vector | None:
    """Return a vector of length 1 in the same direction; None for the zero vector."""
    length = math.sqrt(sum(part * part for part in vector))
    return None if length == 0.0 else (vector[0] / length, vector[1] / length, vector[2] / length)
