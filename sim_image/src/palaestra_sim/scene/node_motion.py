"""The velocities and centers of mass of nodes, and the forces and torques on them, for a supervisor.

Robots and dynamic solids move. All other nodes are at rest, and forces and velocities do not affect them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.center_of_mass import center_of_mass
from palaestra_sim.scene.dynamic_solids import DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics import Push
from palaestra_sim.scene.reader import SceneContents
from palaestra_sim.scene.robot import Robot

NOTHING: Final[Vector] = (0.0, 0.0, 0.0)


class NodeMotion:
    """The motion of the nodes of one world, in the axes of the world file.

    Args:
        scene: the contents of the world.
        robot_of: returns the robot of a Robot node; None for any other node.
        mesh_files: the mesh files that nodes of the world name.
    """

    def __init__(
        self,
        scene: SceneContents,
        robot_of: Callable[[SceneNode], Robot | None],
        mesh_files: MeshFiles,
    ) -> None:
        self._scene = scene
        self._robot_of = robot_of
        self._mesh_files = mesh_files

    def velocity(self, node: SceneNode) -> tuple[Vector, Vector]:
        """Return the velocity of a node in m/s and its angular velocity in rad/s.

        Raises:
            UnsimulatedError: the node has no frame.
        """
        place = _place(node)
        robot, thing = self._robot_of(node), self._loose_of(node)
        velocity = turning = NOTHING
        if thing is not None:
            _, velocity, turning = thing.place.course
        elif robot is not None and robot.body is not None:
            vx, vy, omega = robot.body.velocity
            velocity, turning = (vx, vy, 0.0), (0.0, 0.0, omega)
        return place.from_ground(velocity), place.from_ground(turning)

    def center_of_mass(self, node: SceneNode) -> Vector:
        """Return the center of mass of a node and of the nodes inside it, in meters.

        Raises:
            UnsimulatedError: the node has no frame.
        """
        return center_of_mass(node, _place(node), self._mesh_files)

    def set_velocity(self, node: SceneNode, velocity: Vector, turning: Vector) -> None:
        """Give a node a velocity; a robot's motors return to their commanded speeds within a few steps."""
        robot, thing = self._robot_of(node), self._loose_of(node)
        if thing is not None:
            thing.place.push(thing.place.to_ground(velocity), thing.place.to_ground(turning))
        elif robot is not None and robot.body is not None:
            vx, vy, _ = robot.place.to_ground(velocity)
            _, _, omega = robot.place.to_ground(turning)
            robot.body.push(vx, vy, omega)

    def halt(self, node: SceneNode) -> None:
        """Stop the motion of a node."""
        robot, thing = self._robot_of(node), self._loose_of(node)
        if thing is not None:
            thing.place.halt()
        elif robot is not None:
            robot.halt()

    def add_force(
        self, node: SceneNode, force: Vector, *, relative: bool, offset: Vector | None = None
    ) -> None:
        """Apply a force in N in the next basic step.

        Args:
            node: the node on which the force acts.
            force: the force in N.
            relative: whether `force` is in the axes of the node, not in the axes of the world.
            offset: the point at which the force acts, in meters in the node's frame; None for the center of
                mass.

        Raises:
            UnsimulatedError: this physics has no forces, or the node has no frame.
        """
        place = self._require_forces(node, "forces")
        pose = place.ground_pose
        point = None if offset is None else pose.carry(offset)
        self._push(node, Push(force=_turned(place, force, relative=relative), point=point))

    def add_torque(self, node: SceneNode, torque: Vector, *, relative: bool) -> None:
        """Apply a torque in N m in the next basic step; see `add_force`."""
        place = self._require_forces(node, "torques")
        self._push(node, Push(torque=_turned(place, torque, relative=relative)))

    def _require_forces(self, node: SceneNode, what: str) -> Frame:
        place = _place(node)
        abilities = self._scene.physics.abilities
        if not abilities.forces:
            raise UnsimulatedError(f"{abilities.name} simulates no {what}; use driver mujoco or webots")
        return place

    def _push(self, node: SceneNode, push: Push) -> None:
        target = self._loose_of(node) or self._robot_of(node)
        if target is not None:
            self._scene.physics.push(target, push)

    def _loose_of(self, node: SceneNode) -> DynamicSolid | None:
        return next((thing for thing in self._scene.loose if thing.node is node), None)


def _place(node: SceneNode) -> Frame:
    """Return the frame of a node; in Webots a node without a frame crashes the controller."""
    if node.place is None:
        raise UnsimulatedError(f"a {node.type_name} has no position; use a Pose, Solid or Robot")
    return node.place


def _turned(place: Frame, vector: Vector, *, relative: bool) -> Vector:
    """Return a vector in the axes of the ground."""
    return place.ground_pose.turned(vector) if relative else place.to_ground(vector)
