"""A compiled MJCF model with its current state."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.scene.geometry import Pose

HINGE: Final = int(mujoco.mjtJoint.mjJNT_HINGE)
SLIDE: Final = int(mujoco.mjtJoint.mjJNT_SLIDE)
FREE: Final = int(mujoco.mjtJoint.mjJNT_FREE)
# The numbers of positions and of speeds of a joint; joints of other types have one of each.
_POSITIONS: Final = {FREE: 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}
_SPEEDS: Final = {FREE: 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}


class Model:
    """One model and its current state.

    MuJoCo computes poses and sensors at the beginning of a step, for the state before the step. `settle`
    computes them for the state after the last step, and does not affect the next step.

    Args:
        model: the compiled model (MjModel).
        keyframe: the number of the keyframe with which the world begins; None for the initial positions in
            the model (`qpos0`).

    Attributes:
        model, data: the compiled model (MjModel), and its current state (MjData).
    """

    def __init__(self, model: Any, keyframe: int | None = None) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        # By default MuJoCo resets the world silently when a value is not finite. Here such a value must reach
        # the sensors, so that the trainer detects the fault.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self._keyframe = keyframe
        self._starts = (model.body_pos.copy(), model.body_quat.copy())
        self._settled = False
        self.reset()

    def step(self, count: int) -> None:
        """Simulate `count` of MuJoCo's steps."""
        mujoco.mj_step(self.model, self.data, nstep=count)
        self._settled = False

    def reset(self) -> None:
        """Return to the initial state, bit for bit."""
        self.model.body_pos[:], self.model.body_quat[:] = self._starts
        if self._keyframe is None:
            mujoco.mj_resetData(self.model, self.data)
        else:
            mujoco.mj_resetDataKeyframe(self.model, self.data, self._keyframe)
        self._settled = False

    def changed(self) -> None:
        """Record that the state has changed, so that the next `settle` computes poses and sensors again."""
        self._settled = False

    def settle(self) -> None:
        """Compute poses, velocities and sensors for the current state, if they are out of date."""
        if not self._settled:
            warm_start = self.data.qacc_warmstart.copy()
            mujoco.mj_forward(self.model, self.data)
            self.data.qacc_warmstart[:] = warm_start
            self._settled = True

    def pose(self, body: int) -> Pose:
        """Return the pose of a body in the world."""
        self.settle()
        x, y, z = self.data.xpos[body].tolist()
        a, b, c, d, e, f, g, h, i = self.data.xmat[body].tolist()
        return Pose((x, y, z), (a, b, c, d, e, f, g, h, i))

    def velocity(self, kind: int, number: int) -> tuple[list[float], list[float]]:
        """Return the velocity in m/s and the angular velocity in rad/s of an object, in world axes.

        Args:
            kind: the type of the object: a value of MuJoCo's mjtObj.
            number: the id of the object among the objects of its type.
        """
        self.settle()
        found = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, kind, number, found, 0)
        return found[3:].tolist(), found[:3].tolist()

    def joints_of(self, body: int) -> range:
        """Return the numbers of the joints of a body."""
        first = int(self.model.body_jntadr[body])
        return range(first, first + int(self.model.body_jntnum[body]))

    def bodies_of_contact(self, index: int) -> tuple[int, ...]:
        """Return the bodies of the two sides of a contact; a side may be a vertex of a flex."""
        contact = self.data.contact[index]
        sides = zip(contact.geom, contact.flex, contact.elem, contact.vert, strict=True)
        return tuple(
            int(self.model.geom_bodyid[geom]) if geom >= 0 else self._body_of_flex(flex, element, vertex)
            for geom, flex, element, vertex in sides
        )

    def _body_of_flex(self, flex: int, element: int, vertex: int) -> int:
        """Return the body of a vertex of a flex, or of the first vertex of an element."""
        model = self.model
        if vertex < 0:
            width = int(model.flex_dim[flex]) + 1
            vertex = int(model.flex_elem[model.flex_elemdataadr[flex] + width * element])
        return int(model.flex_vertbodyid[model.flex_vertadr[flex] + vertex])

    def free_joint_of(self, body: int) -> int | None:
        """Return the number of the free joint of a body; None if it has no free joint."""
        return next((it for it in self.joints_of(body) if self.model.jnt_type[it] == FREE), None)

    def positions(self, joint: int) -> Any:
        """Return a view of the positions of a joint."""
        at = int(self.model.jnt_qposadr[joint])
        return self.data.qpos[at : at + _POSITIONS.get(int(self.model.jnt_type[joint]), 1)]

    def speeds(self, joint: int) -> Any:
        """Return a view of the speeds of a joint."""
        at = int(self.model.jnt_dofadr[joint])
        return self.data.qvel[at : at + _SPEEDS.get(int(self.model.jnt_type[joint]), 1)]
