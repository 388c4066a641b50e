"""Dynamic solids: Solids with a Physics node; they move when they are pushed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import AxisAngle, Pose, Vector, to_axis_angle
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape


class BodyState(NamedTuple):
    """The pose of a dynamic solid, and its velocities in m/s and rad/s, in the axes of the ground."""

    pose: Pose
    velocity: Vector = (0.0, 0.0, 0.0)
    turning: Vector = (0.0, 0.0, 0.0)


class DynamicFrame(Frame):
    """The frame of a dynamic solid: it keeps the pose that was set, until the physics moves the solid.

    Attributes:
        follow: returns the state to which the physics has moved the solid; None before a physics has a model.
        changed: the frames that the physics has to read; a frame that a client changed adds itself.
        put: whether a client has set this frame since the physics last read it; the physics clears the flag.
        speed: the linear and angular velocity that a client set, in the axes of the ground; the physics uses
            both and then sets None, which means no change.
    """

    moves = True

    def __init__(
        self, parent: Frame | None, translation: Vector, rotation: AxisAngle, size: float = 1.0
    ) -> None:
        super().__init__(parent, translation, rotation, size)
        self.follow: Callable[[], BodyState] | None = None
        self.put = False
        self.changed: dict[DynamicFrame, None] | None = None
        self.speed: tuple[Vector, Vector] | None = None

    @property
    def translation(self) -> Vector:
        """X, y, z in meters, in the parent's frame."""
        return self._translation if self._stays() else self._local().position

    @translation.setter
    def translation(self, value: Vector) -> None:
        if not self._stays():
            self._rotation = to_axis_angle(self._local().rotation)
        self._translation = value
        self._note_put()

    @property
    def rotation(self) -> AxisAngle:
        """Axis and angle in radians, in the parent's frame."""
        return self._rotation if self._stays() else to_axis_angle(self._local().rotation)

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        if not self._stays():
            self._translation = self._local().position
        self._rotation = value
        self._note_put()

    @property
    def course(self) -> BodyState:
        """The current state: its pose in the world, and its motion."""
        if self._stays() or self.follow is None:
            return BodyState(self.ground_pose)
        return self.follow()

    def push(self, velocity: Vector, turning: Vector) -> None:
        """Give the solid a velocity in m/s and an angular velocity in rad/s, in the axes of the ground."""
        self.speed = velocity, turning
        if self.changed is not None:
            self.changed[self] = None

    def halt(self) -> None:
        """Stop the motion of the solid."""
        self.push((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def return_to_start(self) -> None:
        """Return to the pose in the world file, at rest."""
        super().return_to_start()
        self.halt()

    def _note_put(self) -> None:
        self.put = True
        if self.changed is not None:
            self.changed[self] = None

    def _stays(self) -> bool:
        return self.put or self.follow is None

    def _local(self) -> Pose:
        """Return the pose to which the physics has moved the solid, in the parent's frame."""
        pose = self.course.pose
        return pose if self.parent is None else self.parent.ground_pose.inverse.after(pose)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicSolid:
    """One dynamic solid.

    Attributes:
        node: the node of the solid.
        place: the frame of the solid.
        shapes: the shapes with which the solid and the Solids inside it collide.
        densities: the densities of the shapes, in kg/m3.
    """

    node: SceneNode
    place: DynamicFrame
    shapes: Sequence[Shape] = field(default_factory=tuple)
    densities: Sequence[float] = field(default_factory=tuple)
