"""The frames of a world's nodes, each relative to the frame of its parent node.

A frame has the `translation` and `rotation` that clients read and write. Only the frames of a robot with a
body, of a dynamic solid, and of a joint's end point move by themselves. All other frames move only when a
client sets them.

Clients see poses in the axes of the world file, where z or y points up. Shapes and physics use the axes of
the *ground*, where z points up.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from palaestra_sim.scene.geometry import AxisAngle, Matrix, Pose, Vector, from_axis_angle, transposed, turn

Y_UP: Final[Matrix] = (1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)


class Frame:
    """The frame of one node.

    Attributes:
        moves: whether the frame moves by itself, and not only when a client sets it.
        parent: the frame of the parent node; None at the top of the world.
        translation: x, y, z in meters, in the parent's frame.
        rotation: axis and angle in radians, in the parent's frame.
        scale: the length of a meter of this frame in the world, in meters.
    """

    moves = False

    def __init__(
        self, parent: Frame | None, translation: Vector, rotation: AxisAngle, size: float = 1.0
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
    def placeable(self) -> bool:
        """Whether a client may set this frame."""
        return True

    def admits(self, rotation: AxisAngle) -> bool:
        """Return whether this frame can have that rotation."""
        del rotation
        return True

    @property
    def pose(self) -> Pose:
        """The pose in the parent's frame."""
        return Pose(self.translation, from_axis_angle(self.rotation))

    @property
    def world_pose(self) -> Pose:
        """The pose in the world."""
        parent, pose = self.parent, self.pose
        if parent is None:
            return pose
        return parent.world_pose.after(pose if parent.scale == 1.0 else pose.scaled(parent.scale))

    @property
    def world_position(self) -> Vector:
        """The position of the frame's origin in the world, in meters."""
        return self.translation if self.parent is None else self.world_pose.position

    @property
    def axes(self) -> Matrix | None:
        """The rotation from the file's axes to the axes of the ground; None if both are the same."""
        return None if self.parent is None else self.parent.axes

    def to_ground(self, vector: Vector) -> Vector:
        """Return a vector, given in the axes of the world file, in the axes of the ground."""
        return vector if self.axes is None else turn(self.axes, vector)

    def from_ground(self, vector: Vector) -> Vector:
        """Return a vector, given in the axes of the ground, in the axes of the world file."""
        return vector if self.axes is None else turn(transposed(self.axes), vector)

    @property
    def ground_pose(self) -> Pose:
        """The pose in the world, in the axes of the ground."""
        pose = self.world_pose
        return pose if self.axes is None else Pose(rotation=self.axes).after(pose)

    @property
    def height_m(self) -> float:
        """The height of the frame's origin in the world, in meters."""
        return self.ground_pose.position[2]

    def chain(self) -> Iterator[Frame]:
        """Yield this frame and its outer frames, up to the top of the world."""
        place: Frame | None = self
        while place is not None:
            yield place
            place = place.parent

    def return_to_start(self) -> None:
        """Return to the pose in the world file."""
        self.translation, self.rotation = self._start


class YUp(Frame):
    """The frame around a whole world whose y axis points up; it does not belong to a node."""

    def __init__(self) -> None:
        super().__init__(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))

    @property
    def axes(self) -> Matrix:
        """The rotation that turns y into z."""
        return Y_UP
