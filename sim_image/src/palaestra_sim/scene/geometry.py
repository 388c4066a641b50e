"""Poses in space, for responses to supervisor calls and for the frames of shapes.

Rotations are 3 x 3 matrices as nine floats, row after row. The planar motion of the stub does not need
rotation matrices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]
AxisAngle = tuple[float, float, float, float]  # x, y, z of the axis, angle in radians
Quaternion = tuple[float, float, float, float]  # x, y, z, w

_UPRIGHT: Final = math.cos(math.radians(2.0))
IDENTITY: Final[Matrix] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """A position in meters and a rotation, in a frame that the owner of the pose defines."""

    position: Vector = (0.0, 0.0, 0.0)
    rotation: Matrix = IDENTITY

    def after(self, inner: Pose) -> Pose:
        """Return the pose `inner`, given in this pose's frame, in the outer frame."""
        return Pose(self.carry(inner.position), multiply(self.rotation, inner.rotation))

    def carry(self, point: Vector) -> Vector:
        """Return `point`, given in this pose's frame, in the outer frame."""
        turned = turn(self.rotation, point)
        return (
            self.position[0] + turned[0],
            self.position[1] + turned[1],
            self.position[2] + turned[2],
        )

    def turned(self, vector: Vector) -> Vector:
        """Return a direction, given in this pose's frame, in the outer frame."""
        return turn(self.rotation, vector)

    def scaled(self, factor: float) -> Pose:
        """Return the pose with its position multiplied by `factor`."""
        x, y, z = self.position
        return Pose((x * factor, y * factor, z * factor), self.rotation)

    @property
    def inverse(self) -> Pose:
        """The pose of the outer frame in this pose's frame."""
        back = transposed(self.rotation)
        x, y, z = turn(back, self.position)
        return Pose((-x, -y, -z), back)

    @property
    def heading_rad(self) -> float:
        """The direction of the x axis, seen from above, in (-pi, pi]."""
        return math.atan2(self.rotation[3], self.rotation[0])

    @property
    def upright(self) -> bool:
        """Whether the z axis points up within two degrees, a tolerance for worlds saved while they ran."""
        return self.rotation[8] > _UPRIGHT


def weighted_mean(points: Sequence[Vector], weights: Sequence[float]) -> Vector | None:
    """Return the mean of points; None if the sum of their weights is 0."""
    total = sum(weights)
    if not total:
        return None
    x, y, z = (
        sum(weight * at[axis] for weight, at in zip(weights, points, strict=True)) / total
        for axis in range(3)
    )
    return x, y, z


def turn(m: Matrix, v: Vector) -> Vector:
    """Return the vector `v`, rotated by `m`."""
    x, y, z = v
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[3] * x + m[4] * y + m[5] * z,
        m[6] * x + m[7] * y + m[8] * z,
    )


def transposed(m: Matrix) -> Matrix:
    """Return the inverse of the rotation `m`."""
    return (m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8])


def multiply(a: Matrix, b: Matrix) -> Matrix:
    """Return the rotation that applies `b` first, then `a`, both about the axes of the outer frame."""
    x = turn(a, (b[0], b[3], b[6]))
    y = turn(a, (b[1], b[4], b[7]))
    z = turn(a, (b[2], b[5], b[8]))
    return (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])


def from_axis_angle(rotation: AxisAngle) -> Matrix:
    """Return the rotation about an axis of any length; the identity for length 0."""
    x, y, z, angle_rad = rotation
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return IDENTITY
    x, y, z = x / length, y / length, z / length
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    t = 1.0 - c
    return (
        t * x * x + c,
        t * x * y - s * z,
        t * x * z + s * y,
        t * x * y + s * z,
        t * y * y + c,
        t * y * z - s * x,
        t * x * z - s * y,
        t * y * z + s * x,
        t * z * z + c,
    )


def triple(numbers: Sequence[float]) -> Vector:
    """Return the first three numbers."""
    return numbers[0], numbers[1], numbers[2]


def minus(a: Vector, b: Vector) -> Vector:
    """Return the vector from `b` to `a`."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def turned(rotation: AxisAngle, by: Matrix) -> AxisAngle:
    """Return a rotation, followed by the turn `by` about the rotated axes."""
    return to_axis_angle(multiply(from_axis_angle(rotation), by))


def to_axis_angle(m: Matrix) -> AxisAngle:
    """Return axis and angle in [0, pi] of a rotation; the z axis for the identity."""
    x, y, z, w = to_quaternion(m)
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return 0.0, 0.0, 1.0, 0.0
    return x / length, y / length, z / length, 2.0 * math.atan2(length, w)


def to_quaternion(m: Matrix) -> Quaternion:
    """Return the unit quaternion of a rotation, with w >= 0."""
    trace = m[0] + m[4] + m[8]
    if trace > 0.0:
        w = 0.5 * math.sqrt(1.0 + trace)
        return ((m[7] - m[5]) / (4 * w), (m[2] - m[6]) / (4 * w), (m[3] - m[1]) / (4 * w), w)
    largest = max(range(3), key=lambda i: m[4 * i])
    i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
    root = math.sqrt(max(0.0, 1.0 + m[4 * i] - m[4 * j] - m[4 * k]))
    q = [0.0, 0.0, 0.0]
    q[i] = 0.5 * root
    q[j] = (m[3 * j + i] + m[3 * i + j]) / (2.0 * root)
    q[k] = (m[3 * k + i] + m[3 * i + k]) / (2.0 * root)
    w = (m[3 * k + j] - m[3 * j + k]) / (2.0 * root)
    sign = -1.0 if w < 0.0 else 1.0
    return (sign * q[0], sign * q[1], sign * q[2], abs(w))


def quaternion_to_matrix(quaternion: Quaternion) -> Matrix:
    """Return the rotation of a unit quaternion."""
    x, y, z, w = quaternion
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - z * w),
        2.0 * (x * z + y * w),
        2.0 * (x * y + z * w),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - x * w),
        2.0 * (x * z - y * w),
        2.0 * (y * z + x * w),
        1.0 - 2.0 * (x * x + y * y),
    )


def axis_angle_to_quaternion(rotation: AxisAngle) -> Quaternion:
    """Return the quaternion of an axis of length 1 and an angle, for the service of a rotation field."""
    x, y, z, angle_rad = rotation
    s = math.sin(angle_rad / 2.0)
    return (x * s, y * s, z * s, math.cos(angle_rad / 2.0))
