"""The simulation of an MJCF world (a `Backend`): MuJoCo's own model, with one robot that has all devices.

The same world and the same commands give the same values, bit for bit, also after a reset.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final, Never

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.mjcf.appearance import ModelAppearance
from palaestra_sim.mujoco.mjcf.model import HINGE, SLIDE, Model
from palaestra_sim.mujoco.mjcf.motion import BodyMotion
from palaestra_sim.mujoco.mjcf.robot import Equipment
from palaestra_sim.mujoco.mjcf.states import BodyStates
from palaestra_sim.mujoco.mjcf.tree import ModelTree
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.movies import Movies
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics import Abilities
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.tree.fields import NodeField

_FIXED: Final = "the bodies of an MJCF world cannot change while it runs; write them into the model"


class MjcfSimulation:
    """One loaded MJCF world; see `Backend`.

    Args:
        model: the model in its initial state.
        tree: the nodes of the model.
        equipment: the devices of the robot.
        robot: the robot itself.
        basic_step_ms: the basic step in milliseconds, a whole number of MuJoCo's steps.
        mode: the simulation mode at the start.

    Attributes:
        model, nodes, equipment: the model, its nodes and its devices.
    """

    def __init__(
        self,
        model: Model,
        tree: ModelTree,
        equipment: Equipment,
        robot: Robot,
        *,
        basic_step_ms: int,
        mode: Mode,
    ) -> None:
        self.tree = tree.scene
        self.robots = (robot,)
        self.time_ms = 0
        self.mode = mode
        self.quit_status: int | None = None
        # The scene's nodes contain no masses or friction; MuJoCo's model contains both.
        self.abilities = Abilities(name="MuJoCo", exact=True)
        self.unread_textures = 0  # textures affect only infra-red sensors, which MJCF does not have
        self.unread_meshes: Mapping[str, int] = {}  # MuJoCo reads all files of a model
        self.left_out: tuple[WorldError, ...] = tuple(equipment.left_out)
        self.basic_step_ms = basic_step_ms
        self.motion = BodyMotion(model, tree.bodies)
        self.movies = Movies(lambda _size: None, lambda _movie: None, basic_step_ms)
        self.appearance = ModelAppearance(model, tree.bodies[tree.robot])
        self.model = self._model = model
        self.nodes = self._nodes = tree
        self.equipment = self._equipment = equipment
        self._states = BodyStates(model, tree.bodies)
        self._step_s = basic_step_ms / 1000.0
        self._steps = round(self._step_s / float(model.model.opt.timestep))
        # A file may round its timestep, for example 1/240 s, so the exact timestep is set here.
        model.model.opt.timestep = self._step_s / self._steps
        self._pending: list[Callable[[], None]] = []
        self._reset_asked = False

    def step(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`, then measure the value of every sensor.

        Raises:
            ValueError: the duration is not a positive multiple of the basic step.
        """
        self.advance(duration_ms)
        self.sample()

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the values of sensors do not change until `sample`.

        Raises:
            ValueError: the duration is not a positive multiple of the basic step.
        """
        count, rest = divmod(duration_ms, self.basic_step_ms)
        if rest or count < 1:
            fact = f"step: {duration_ms} ms is not a positive multiple of the basic step"
            raise ValueError(f"{fact}; use a multiple of {self.basic_step_ms} ms")
        for _ in range(count):
            self._basic_step()

    def sample(self) -> None:
        """Measure the value of every sensor now."""
        self._model.settle()
        for motor in self._equipment.motors:
            motor.feel()
        for sample in self._equipment.samples:
            sample()

    def before_next_step(self, change: Callable[[], None]) -> None:
        """Call `change` at the beginning of the next basic step."""
        self._pending.append(change)

    def changed(self, node: SceneNode, field: str) -> None:
        """Set the pose of a body to the new value of its field `translation` or `rotation`."""
        if node.place is None:
            return
        if field == "translation":
            x, y, z = node.numbers(field) or (0.0, 0.0, 0.0)
            node.place.translation = (x, y, z)
        elif field == "rotation":
            x, y, z, angle_rad = node.numbers(field) or (0.0, 0.0, 1.0, 0.0)
            node.place.rotation = (x, y, z, angle_rad)

    def reset(self) -> None:
        """Request a reset of the world within the next basic step."""
        self._reset_asked = True

    def reset_physics(self) -> None:
        """Stop all motion immediately."""
        self._model.data.qvel[:] = 0.0
        self._model.changed()

    def quit(self, status: int) -> None:
        """Request the end of the simulator."""
        self.quit_status = status

    def robot_of(self, node: SceneNode) -> Robot | None:
        """Return the robot if `node` is its node; None for any other node."""
        return self.robots[0] if node is self._nodes.robot else None

    def add(self, text: str, field: NodeField, index: int) -> Never:
        """Raise an error: bodies cannot be added to a compiled model."""
        del text, field, index
        raise UnsimulatedError(_FIXED)

    def remove(self, node: SceneNode) -> Never:
        """Raise an error: bodies cannot be removed from a compiled model."""
        del node
        raise UnsimulatedError(_FIXED)

    def export_image(self, path: str, quality: int) -> bool:
        """Return False: images of models are not supported yet."""
        del path, quality
        return False

    def contact_points(self, node: SceneNode, *, descendants: bool) -> list[tuple[Vector, int]]:
        """Return the contact points of a body: each has a position in meters and the number of a node.

        With `descendants`, the contact points of all bodies inside the body are included.
        """
        self._model.settle()
        asked = {node, *node.descendants()} if descendants else {node}
        touching = {self._nodes.bodies[it]: it.number for it in asked if it in self._nodes.bodies}
        contacts = self._model.data.contact
        return [
            ((x, y, z), touching[body])
            for index, (x, y, z) in enumerate(contacts.pos.tolist())
            for body in self._model.bodies_of_contact(index)
            if body in touching
        ]

    def save_state(self, node: SceneNode, name: str) -> None:
        """Save the state of a node under a name."""
        self._states.save(node, name)

    def load_state(self, node: SceneNode, name: str) -> None:
        """Return a node to a saved state and stop its motion; "__init__" is the state in the world file.

        Raises:
            UnsimulatedError: no state of that name was saved.
        """
        self._states.load(node, name)

    def set_joint_position(self, node: SceneNode, position: float, index: int) -> None:
        """Set the position of a hinge or slider in rad or m, cut to its range, and stop its motion.

        Raises:
            UnsimulatedError: the node is not a hinge or slider, or `index` is not 1, the number of its only
                axis.
        """
        joint = self._nodes.joints.get(node)
        model = self._model.model
        if joint is None or model.jnt_type[joint] not in {HINGE, SLIDE}:
            raise UnsimulatedError(f"a {node.type_name} has no joint position; use a hinge or slider")
        if index != 1:
            raise UnsimulatedError(f"a {node.type_name} has no axis {index}; use 1")
        if not math.isfinite(position):
            return
        if model.jnt_limited[joint]:
            low, high = model.jnt_range[joint].tolist()
            position = max(low, min(high, position))
        self._model.positions(joint)[:] = position
        self._model.speeds(joint)[:] = 0.0
        self._model.changed()
        for motor in self._equipment.motors:
            if self._equipment.joints.get(motor.name) == joint:
                motor.put(position)

    def _basic_step(self) -> None:
        pending, self._pending = self._pending, []
        for change in pending:
            change()
        for motor in self._equipment.motors:
            motor.command(self._step_s)
        for actuator in self._equipment.actuators:
            actuator.command()
        self._model.step(self._steps)
        self.motion.clear()
        if self._reset_asked:
            self._restore()
        self.time_ms += self.basic_step_ms

    def _restore(self) -> None:
        self._reset_asked = False
        self.time_ms = 0
        self._model.reset()
        self._model.settle()  # computes the lengths of tendons, because motors read these lengths
        for motor in self._equipment.motors:
            motor.reset()
        for actuator in self._equipment.actuators:
            actuator.reset()
