"""The places of a world's nodes, each in the frame of the node around it.

A place has the `translation` and `rotation` that clients read and write. A robot's place is the current
pose of its body; every other place stays as written.
"""

from __future__ import annotations

from collections.abc import Iterator

from palaestra_sim.stub.physics.body import Body
from palaestra_sim.stub.physics.geometry import AxisAngle, Pose, Vector, from_axis_angle


class Place:
    """The frame of one node.

    Attributes:
        parent: the place of the node around it; None at the top of the world.
        translation: x, y, z in meters, in the parent's frame.
        rotation: axis and angle in radians, in the parent's frame.
        scale: meters of the world in a meter of this frame.
    """

    def __init__(
        self, parent: Place | None, translation: Vector, rotation: AxisAngle, size: float = 1.0
    ) -> None:
        self.parent = parent
        self.scale: float = size if parent is None else size * parent.scale
        self._translation = translation
        self._rotation = rotation
        self._start = (translation, rotation)

    @property
    def translation(self) -> Vector:
        """X, y, z in meters, in the parent's frame."""
        return self._translation

    @translation.setter
    def translation(self, value: Vector) -> None:
        self._translation = value

    @property
    def rotation(self) -> AxisAngle:
        """Axis and angle in radians, in the parent's frame."""
        return self._rotation

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        self._rotation = value

    @property
    def pose(self) -> Pose:
        """The frame, in the parent's."""
        return Pose(self.translation, from_axis_angle(self.rotation))

    @property
    def world_pose(self) -> Pose:
        """The frame, in the world's."""
        parent, pose = self.parent, self.pose
        if parent is None:
            return pose
        return parent.world_pose.after(pose if parent.scale == 1.0 else pose.scaled(parent.scale))

    @property
    def world_position(self) -> Vector:
        """Return the position of its origin in the world, in meters."""
        return self.translation if self.parent is None else self.world_pose.position

    def chain(self) -> Iterator[Place]:
        """Yield this place and those around it, up to the top of the world."""
        place: Place | None = self
        while place is not None:
            yield place
            place = place.parent

    def return_to_start(self) -> None:
        """Return to the place in the world file."""
        self.translation, self.rotation = self._start


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
