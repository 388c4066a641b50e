"""A dynamic solid in MuJoCo: a body with a free joint."""

from __future__ import annotations

from typing import Any, Final

from palaestra_sim.scene.dynamic_solids import BodyState, DynamicFrame
from palaestra_sim.scene.geometry import Pose, quaternion_to_matrix, to_quaternion

_PLACE: Final = 7  # numbers of a free joint's pose: a position, and a quaternion w, x, y, z
_SPEED: Final = 6  # a velocity in world axes, and an angular velocity in the axes of the body


class FreeBody:
    """One dynamic solid of a model; this object sets the pose of the solid's frame in the scene.

    Attributes:
        place: the frame of the solid in the scene.
        number: the number of the solid's body in the model.
    """

    def __init__(self, place: DynamicFrame, model: Any, data: Any, number: int) -> None:
        self.place = place
        self.number = number
        joint = model.body_jntadr[number]
        at, speed = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        self._where = data.qpos[at : at + _PLACE]
        self._speed = data.qvel[speed : speed + _SPEED]

    def begin(self, state: BodyState, changed: dict[DynamicFrame, None]) -> None:
        """Set the initial state; from now on, a client's change to the frame adds the frame to `changed`."""
        self._write(state.pose)
        self._move(state)
        self.place.put = False
        self.place.changed = changed
        if self.place.speed is not None:
            changed[self.place] = None
        self.place.follow = self._course

    def take(self) -> None:
        """Apply a client's changes: a new pose or a push."""
        place = self.place
        if place.put:
            self._write(place.ground_pose)
            place.put = False
        if place.speed is not None:
            self._move(BodyState(self._course().pose, *place.speed))
            place.speed = None

    def _course(self) -> BodyState:
        x, y, z, qw, qx, qy, qz = self._where.tolist()
        pose = Pose((x, y, z), quaternion_to_matrix((qx, qy, qz, qw)))
        vx, vy, vz, *turning = self._speed.tolist()
        return BodyState(pose, (vx, vy, vz), pose.turned((turning[0], turning[1], turning[2])))

    def _write(self, pose: Pose) -> None:
        x, y, z, w = to_quaternion(pose.rotation)
        self._where[:] = (*pose.position, w, x, y, z)

    def _move(self, state: BodyState) -> None:
        """Write the velocities of a state to MuJoCo; the angular velocity of `state` is in world axes."""
        self._speed[:] = (*state.velocity, *state.pose.inverse.turned(state.turning))
