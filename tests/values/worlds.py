"""Worlds in which a test moves a robot from pose to pose, for sensors whose values are known."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import parse
from tests.values.frames import AXES, Frame, axis_angle

PHYSICS = {"stub": StubPhysics, "mujoco": MujocoPhysics}
STEP_MS = 16


@dataclass(frozen=True)
class Setting:
    """A simulator, and the axes of its world file.

    Attributes:
        physics: "stub" or "mujoco".
        system: the `coordinateSystem` of the world.
    """

    physics: str
    system: str = "ENU"

    def __str__(self):
        """Return simulator and axes, for the name of a test."""
        return f"{self.physics} {self.system}"

    @property
    def axes(self):
        """Return the rotation from the axes of the ground to the axes of the file."""
        return AXES[self.system]

    @property
    def up(self):
        """Return the direction that points up, in the axes of the file."""
        return self.axes @ [0.0, 0.0, 1.0]

    @property
    def north(self):
        """Return the direction of north, in the axes of the file."""
        return self.axes @ [0.0, 1.0, 0.0]

    def put(self, frame):
        """Return a frame of the ground's axes in the axes of the file."""
        return Frame(self.axes @ frame.position, self.axes @ frame.rotation)

    def text(self, nodes, info=""):
        """Return the text of a world with these nodes."""
        return f"""#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep {STEP_MS} coordinateSystem "{self.system}" {info} }}
{nodes}
"""

    def load(self, nodes, info="", files=None):
        """Return the simulation of a world with these nodes; `files` are the mesh files, by address."""
        world = parse(self.text(nodes, info).encode(), "values")
        read = None if files is None else lambda _, address: files[address]
        descriptions = Descriptions(read=read)
        return Simulation.of(world, PHYSICS[self.physics](), "values", Mode.FAST, descriptions)


SETTINGS = [Setting(physics, system) for physics in PHYSICS for system in AXES]


def robot(parts, fields="", name="r"):
    """Return the text of a robot with these parts, which is a supervisor under a client's control."""
    return f"""DEF {name.upper()} Robot {{ {fields} name "{name}" supervisor TRUE
  controller "ros" controllerArgs [ "--name={name}" "--synchronize" ] children [ {parts} ] }}"""


def move(simulation, node, frame):
    """Move a node of the world to a frame, as a supervisor does."""
    found = simulation.tree.of_def(node)
    for name, kind, value in (
        ("translation", FieldType.VEC3F, frame.position),
        ("rotation", FieldType.ROTATION, axis_angle(frame.rotation)),
    ):
        simulation.tree.field_of(found, name, simulation).set(kind, 0, tuple(map(float, value)))


def enable(simulation, robot_index=0):
    """Enable all devices of a robot, because some measure only while they are enabled."""
    for kind, device in simulation.robots[robot_index].parts.devices.rows.values():
        kind.enabled(device, STEP_MS)


def device(simulation, name, robot_index=0):
    """Return the device with a name."""
    return simulation.robots[robot_index].parts.devices.rows[name][1]


cached = functools.lru_cache(maxsize=None)
