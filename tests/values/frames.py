"""Frames by formulas, as a reference for the values of simulated devices. They use no code of Palaestra.

Vectors and matrices are NumPy arrays, (3,) and (3, 3). Lengths are in meters, and angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

# Rotations from the axes of the ground (east, north, up) to the axes of a world file, by `coordinateSystem`.
AXES = {
    "ENU": np.eye(3),
    "NUE": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
}


def turn(axis, angle_rad):
    """Return the rotation about an axis by Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross


def axis_angle(rotation):
    """Return axis (x, y, z) and angle of a rotation; the angle must not be half a turn."""
    angle_rad = np.arccos((np.trace(rotation) - 1.0) / 2.0)
    if angle_rad < 1e-9:
        return np.array([0.0, 0.0, 1.0, 0.0])
    skew = rotation - rotation.T
    return np.array(
        [*(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (2.0 * np.sin(angle_rad))), angle_rad]
    )


def quaternion(rotation):
    """Return x, y, z, w of a rotation, with w >= 0."""
    *axis, angle_rad = axis_angle(rotation)
    return np.array([*(np.sin(angle_rad / 2.0) * np.array(axis)), np.cos(angle_rad / 2.0)])


@dataclass(frozen=True)
class Frame:
    """A frame relative to another one: its origin, and a rotation whose columns are its axes."""

    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))

    def __matmul__(self, inner):
        """Return a frame or a point, given in this frame, in the parent frame."""
        if isinstance(inner, Frame):
            return Frame(self @ inner.position, self.rotation @ inner.rotation)
        return self.position + self.rotation @ np.asarray(inner, float)

    @property
    def inverse(self):
        """Return the parent frame relative to this frame."""
        return Frame(-self.rotation.T @ self.position, self.rotation.T)

    @property
    def fields(self):
        """Return `translation` and `rotation` as text of a world file."""
        numbers = [*self.position, *axis_angle(self.rotation)]
        return "translation {:.12g} {:.12g} {:.12g} rotation {:.15g} {:.15g} {:.15g} {:.15g}".format(*numbers)


def frame(position=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), angle_rad=0.0):
    """Return the frame at a position, rotated about an axis."""
    return Frame(np.asarray(position, float), turn(axis, angle_rad))


def looking(origin, target, roll_rad=0.0):
    """Return a frame at `origin` whose x axis points to `target`, rolled about this axis."""
    ahead = np.subtract(target, origin) / np.linalg.norm(np.subtract(target, origin))
    aside = np.cross([0.0, 0.0, 1.0] if abs(ahead[2]) < 0.99 else [1.0, 0.0, 0.0], ahead)
    aside /= np.linalg.norm(aside)
    facing = np.stack([ahead, aside, np.cross(ahead, aside)], axis=1)
    return Frame(np.asarray(origin, float), facing @ turn([1.0, 0.0, 0.0], roll_rad))
