"""The place of a robot with a body: the current pose of this body."""

from __future__ import annotations

from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.geometry import AxisAngle, Pose, Vector, from_axis_angle
from palaestra_sim.scene.places import Place


class RobotPlace(Place):
    """The frame of a robot with a body, which drives upright, at the height at which it was placed.

    Its parent never moves or turns, so the body's pose is the place's.
    """

    def __init__(self, translation: Vector, rotation: AxisAngle, body: Body) -> None:
        super().__init__(None, translation, rotation)
        self._body = body
        self.rotation = rotation
        self.translation = translation

    @property
    def translation(self) -> Vector:
        """X and y of the body, and the height of the world file or of the last write."""
        return (self._body.x, self._body.y, self._translation[2])

    @translation.setter
    def translation(self, value: Vector) -> None:
        self._translation = value
        self._body.place(value[0], value[1], self._body.heading_rad)

    @property
    def rotation(self) -> AxisAngle:
        """The heading of the body, about the z axis."""
        return (0.0, 0.0, 1.0, self._body.heading_rad)

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        heading_rad = Pose(rotation=from_axis_angle(value)).heading_rad
        self._body.place(self._body.x, self._body.y, heading_rad)
