"""The frame of a robot with a body: the current pose of this body."""

from __future__ import annotations

from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import (
    AxisAngle,
    Matrix,
    Pose,
    Vector,
    from_axis_angle,
    multiply,
    to_axis_angle,
    transposed,
    turned,
)


class RobotFrame(Frame):
    """The frame of a robot with a body; the robot drives upright at a constant height.

    The robot is at the top of the world, not inside another node, so its frame has the pose of the body. The
    pose of the body has the axes of the ground, and this frame has those of the world file.
    """

    moves = True

    def __init__(self, top: Frame | None, translation: Vector, rotation: AxisAngle, body: Body) -> None:
        super().__init__(top, translation, rotation)
        self._body = body
        self._height_m = 0.0
        self.rotation = rotation
        self.translation = translation

    @property
    def translation(self) -> Vector:
        """X and y of the body, and the height that the file or a client has set last, in the file's axes."""
        return self.from_ground((self._body.x, self._body.y, self._height_m))

    @translation.setter
    def translation(self, value: Vector) -> None:
        x, y, self._height_m = self.to_ground(value)
        self._body.place(x, y, self._body.heading_rad)

    @property
    def rotation(self) -> AxisAngle:
        """The heading of the body as axis and angle, in the axes of the world file."""
        heading = (0.0, 0.0, 1.0, self._body.heading_rad)
        if self.axes is None:
            return heading
        return to_axis_angle(multiply(transposed(self.axes), from_axis_angle(heading)))

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        self._body.place(self._body.x, self._body.y, self._on_ground(value).heading_rad)

    def admits(self, rotation: AxisAngle) -> bool:
        """Return whether a robot with that rotation stands upright."""
        return self._on_ground(rotation).upright

    def _on_ground(self, rotation: AxisAngle) -> Pose:
        """Return a pose with that rotation, in the axes of the ground."""
        matrix = from_axis_angle(rotation)
        return Pose(rotation=matrix if self.axes is None else multiply(self.axes, matrix))

    @property
    def height_m(self) -> float:
        """The height of the robot's origin in the world, in meters."""
        return self._height_m


class TurnedFrame(Frame):
    """The frame of a robot in the world file, relative to its frame with z up.

    Clients read and write this frame; a write moves the upright frame too.

    Args:
        upright: the frame with z up.
        turn: the rotation of this frame in the upright frame.
    """

    def __init__(self, upright: Frame, turn: Matrix) -> None:
        super().__init__(upright, (0.0, 0.0, 0.0), to_axis_angle(turn))
        self._upright = upright
        self._turn = turn

    @property
    def pose(self) -> Pose:
        """The pose in the upright frame."""
        return Pose(rotation=self._turn)

    @property
    def translation(self) -> Vector:
        """The origin, which both frames share."""
        return self._upright.translation

    @translation.setter
    def translation(self, value: Vector) -> None:
        self._upright.translation = value

    @property
    def rotation(self) -> AxisAngle:
        """The rotation of this frame, in the parent of the upright frame."""
        return turned(self._upright.rotation, self._turn)

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        self._upright.rotation = turned(value, transposed(self._turn))

    def admits(self, rotation: AxisAngle) -> bool:
        """Return whether a robot with that rotation stands upright."""
        return self._upright.admits(turned(rotation, transposed(self._turn)))

    def return_to_start(self) -> None:
        """Return the upright frame, and with it this frame, to the pose in the world file."""
        self._upright.return_to_start()
