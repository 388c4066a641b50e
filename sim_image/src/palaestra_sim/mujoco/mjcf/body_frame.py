"""The frame of a body of MuJoCo's model."""

from __future__ import annotations

from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import (
    AxisAngle,
    Pose,
    Vector,
    from_axis_angle,
    to_axis_angle,
    to_quaternion,
)


class BodyFrame(Frame):
    """The frame of a body; MuJoCo computes the body's pose.

    A client may set the pose of a body that has a free joint, and of a body without joints whose parent is
    the world. For all other bodies, joints or parent bodies determine the pose.
    """

    def __init__(self, parent: Frame | None, model: Model, body: int) -> None:
        super().__init__(parent, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
        self._model = model
        self._body = body
        self._free = model.free_joint_of(body)
        self._mocap = int(model.model.body_mocapid[body])

    @property
    def placeable(self) -> bool:
        """Whether a client may set the pose; see the class."""
        stands = self.parent is None and not self._model.joints_of(self._body)
        return self._free is not None or stands

    @property
    def translation(self) -> Vector:
        """X, y, z in meters, in the frame of the parent."""
        return self.pose.position

    @translation.setter
    def translation(self, value: Vector) -> None:
        self._put(Pose(value, self.pose.rotation))

    @property
    def rotation(self) -> AxisAngle:
        """Axis and angle in radians, in the frame of the parent."""
        return to_axis_angle(self.pose.rotation)

    @rotation.setter
    def rotation(self, value: AxisAngle) -> None:
        self._put(Pose(self.pose.position, from_axis_angle(value)))

    @property
    def pose(self) -> Pose:
        """The pose of the body in the frame of the parent."""
        pose = self.world_pose
        return pose if self.parent is None else self.parent.world_pose.inverse.after(pose)

    @property
    def world_pose(self) -> Pose:
        """The pose of the body in the frame of the world."""
        return self._model.pose(self._body)

    @property
    def world_position(self) -> Vector:
        """The position of the body's origin in the world, in meters."""
        return self.world_pose.position

    def return_to_start(self) -> None:
        """Do nothing: a reset of the model also resets the pose of the body."""

    def _put(self, pose: Pose) -> None:
        x, y, z, w = to_quaternion(pose.rotation)
        model, data = self._model.model, self._model.data
        if self._free is not None:
            self._model.positions(self._free)[:] = (*pose.position, w, x, y, z)
        elif self._mocap >= 0:
            data.mocap_pos[self._mocap], data.mocap_quat[self._mocap] = pose.position, (w, x, y, z)
        else:
            model.body_pos[self._body], model.body_quat[self._body] = pose.position, (w, x, y, z)
        self._model.changed()
