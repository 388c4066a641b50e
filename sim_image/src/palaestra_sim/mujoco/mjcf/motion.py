"""Read and set the motion of a model's bodies, and apply forces to them, for a supervisor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.nodes.scene_node import SceneNode


class BodyMotion:
    """The motion of the bodies of one model.

    Args:
        model: the model, with its current state.
        bodies: maps a node to the number of its body.
    """

    def __init__(self, model: Model, bodies: Mapping[SceneNode, int]) -> None:
        self._model = model
        self._bodies = bodies
        self._pushed = False

    def velocity(self, node: SceneNode) -> tuple[Vector, Vector]:
        """Return the velocity of a body in m/s and its angular velocity in rad/s.

        Raises:
            UnsimulatedError: the node is not a body.
        """
        (vx, vy, vz), (wx, wy, wz) = self._model.velocity(mujoco.mjtObj.mjOBJ_XBODY, self._body(node))
        return (vx, vy, vz), (wx, wy, wz)

    def center_of_mass(self, node: SceneNode) -> Vector:
        """Return the center of mass of a body and of the bodies inside it, in meters.

        Raises:
            UnsimulatedError: the node is not a body.
        """
        body = self._body(node)
        self._model.settle()
        x, y, z = self._model.data.subtree_com[body].tolist()
        return x, y, z

    def set_velocity(self, node: SceneNode, velocity: Vector, turning: Vector) -> None:
        """Set the velocity and the angular velocity of a body that has a free joint.

        Raises:
            UnsimulatedError: the body has no free joint.
        """
        free = self._model.free_joint_of(self._body(node))
        if free is None:
            fact = f"the body {node.def_name!r} is on joints or fixed, so its velocity cannot be set"
            raise UnsimulatedError(f"{fact}; command its motors, or give it a <freejoint>")
        pose: Pose = self._model.pose(self._body(node))
        self._model.speeds(free)[:] = (*velocity, *pose.inverse.turned(turning))
        self._model.changed()

    def halt(self, node: SceneNode) -> None:
        """Stop a body and all bodies inside it."""
        numbers = (self._bodies[it] for it in (node, *node.descendants()) if it in self._bodies)
        for number in numbers:
            for joint in self._model.joints_of(number):
                self._model.speeds(joint)[:] = 0.0
        self._model.changed()

    def add_force(
        self, node: SceneNode, force: Vector, *, relative: bool, offset: Vector | None = None
    ) -> None:
        """Apply a force in N in the next basic step; see `MotionBackend`."""
        body = self._body(node)
        pose = self._model.pose(body)
        world = np.array(pose.turned(force) if relative else force)
        torque = np.zeros(3)
        if offset is not None:
            torque = np.cross(np.array(pose.carry(offset)) - self._model.data.xipos[body], world)
        self._push(body, world, torque)

    def add_torque(self, node: SceneNode, torque: Vector, *, relative: bool) -> None:
        """Apply a torque in N m in the next basic step."""
        body = self._body(node)
        self._push(body, np.zeros(3), np.array(self._model.pose(body).turned(torque) if relative else torque))

    def clear(self) -> None:
        """Remove the forces of the last basic step."""
        if self._pushed:
            self._model.data.xfrc_applied[:] = 0.0
            self._pushed = False

    def _push(self, body: int, force: np.ndarray, torque: np.ndarray) -> None:
        self._model.data.xfrc_applied[body] += np.concatenate((force, torque))
        self._pushed = True
        self._model.changed()

    def _body(self, node: SceneNode) -> int:
        number = self._bodies.get(node)
        if number is None:
            raise UnsimulatedError(f"a {node.type_name} has no motion; use a Robot or Solid")
        return number
