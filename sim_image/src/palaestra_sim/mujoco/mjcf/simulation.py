"""The Backend of an MJCF world: MuJoCo's own model, with one robot that has all devices.

The same world and commands give the same values, bit for bit, even after a reset.
"""

from __future__ import annotations

import math
from collections.abc import Callable
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
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.tree.fields import NodeField

_FIXED: Final = "an MJCF world keeps its bodies while it runs; write them into the model"


class MjcfSimulation:
    """One loaded MJCF world; see `Backend`.

    Args:
        model: in its initial state.
        tree: its nodes.
        equipment: the devices of the robot.
        robot: the robot itself.
        basic_step_ms: a whole number of MuJoCo's steps.
        mode: the mode at the start.
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
        self.forces = False  # masses and frictions are MuJoCo's own
        self.unread_textures = 0  # only infra-red sensors read textures, and no model has such sensors
        self.left_out: tuple[WorldError, ...] = tuple(equipment.left_out)
        self.basic_step_ms = basic_step_ms
        self.motion = BodyMotion(model, tree.bodies)
        self.movies = Movies(lambda _size: None, lambda _movie: None, basic_step_ms)
        self.appearance = ModelAppearance(model, tree.bodies[tree.robot])
        self._model = model
        self._nodes = tree
        self._equipment = equipment
        self._states = BodyStates(model, tree.bodies)
        self._step_s = basic_step_ms / 1000.0
        self._steps = round(self._step_s / float(model.model.opt.timestep))
        model.model.opt.timestep = self._step_s / self._steps  # a file may round 1/240 s
        self._pending: list[Callable[[], None]] = []
        self._reset_asked = False

    def step(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`, then set the values of the sensors.

        Raises:
            ValueError: the duration is not a positive multiple of the basic step.
        """
        self.advance(duration_ms)
        self.sample()

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the sensors keep their values.

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
        """Set the value of every sensor to that of this moment."""
        self._model.settle()
        for motor in self._equipment.motors:
            motor.feel()
        for sample in self._equipment.samples:
            sample()

    def before_next_step(self, change: Callable[[], None]) -> None:
        """Call `change` at the beginning of the next basic step."""
        self._pending.append(change)

    def changed(self, node: SceneNode, field: str) -> None:
        """Set the pose of a body to that of its field."""
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
        """Stop all motion, at once."""
        self._model.data.qvel[:] = 0.0
        self._model.changed()

    def quit(self, status: int) -> None:
        """Request the end of the simulator."""
        self.quit_status = status

    def robot_of(self, node: SceneNode) -> Robot | None:
        """Return the robot of its node; None for any other node."""
        return self.robots[0] if node is self._nodes.robot else None

    def add(self, text: str, field: NodeField, index: int) -> Never:
        """Raise an error: a model is compiled once."""
        del text, field, index
        raise UnsimulatedError(_FIXED)

    def remove(self, node: SceneNode) -> Never:
        """Raise an error: a model is compiled once."""
        del node
        raise UnsimulatedError(_FIXED)

    def export_image(self, path: str, quality: int) -> bool:
        """Return False: images of models are not supported yet."""
        del path, quality
        return False

    def contact_points(self, node: SceneNode, *, descendants: bool) -> list[tuple[Vector, int]]:
        """Return a body's contact points: positions in meters, each with the number of its node."""
        self._model.settle()
        asked = {node, *node.descendants()} if descendants else {node}
        touching = {self._nodes.bodies[it]: it.number for it in asked if it in self._nodes.bodies}
        contacts = self._model.data.contact
        bodies = self._model.model.geom_bodyid
        return [
            ((x, y, z), touching[body])
            for geoms, (x, y, z) in zip(contacts.geom, contacts.pos.tolist(), strict=True)
            for body in bodies[geoms].tolist()
            if body in touching
        ]

    def save_state(self, node: SceneNode, name: str) -> None:
        """Save the state of a node under a name."""
        self._states.save(node, name)

    def load_state(self, node: SceneNode, name: str) -> None:
        """Return a node to a saved state, at rest; "__init__" is the state in the world file.

        Raises:
            UnsimulatedError: no state of that name was saved.
        """
        self._states.load(node, name)

    def set_joint_position(self, node: SceneNode, position: float, index: int) -> None:
        """Set the position of a hinge or slider within its range, in rad or m, at rest.

        Raises:
            UnsimulatedError: the node is not such a joint, or has no axis `index`, counted from 1.
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
        self._model.settle()  # needed before motors read the lengths of tendons
        for motor in self._equipment.motors:
            motor.reset()
        for actuator in self._equipment.actuators:
            actuator.reset()
