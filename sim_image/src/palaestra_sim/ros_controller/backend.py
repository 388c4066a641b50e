"""The interface of a simulation: robots with devices, nodes with fields, and steps.

`ros_controller` offers a simulation to clients as ROS services and topics. The package `scene` implements
this Protocol. Another simulator that implements this Protocol can serve the same clients.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_sim.errors import WorldError
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.movies import Movies
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics import Abilities
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.tree.fields import NodeField
from palaestra_sim.scene.tree.scene_tree import SceneTree


class MotionBackend(Protocol):
    """The motion of nodes, in m, m/s, rad/s, N and N m, in the axes of the world file."""

    def velocity(self, node: SceneNode) -> tuple[Vector, Vector]:
        """Return the linear and angular velocity of a node."""
        ...

    def center_of_mass(self, node: SceneNode) -> Vector:
        """Return the center of mass of a node and of the nodes inside it, in meters."""
        ...

    def set_velocity(self, node: SceneNode, velocity: Vector, turning: Vector) -> None:
        """Set the linear and the angular velocity of a node; do nothing if the node cannot move."""
        ...

    def halt(self, node: SceneNode) -> None:
        """Stop the motion of a node."""
        ...

    def add_force(
        self, node: SceneNode, force: Vector, *, relative: bool, offset: Vector | None = None
    ) -> None:
        """Apply a force in the next basic step.

        Args:
            node: the node on which the force acts.
            force: the force in N.
            relative: whether the force is in the axes of the node, not in the axes of the world.
            offset: the point at which the force acts, in meters in the node's frame; None for the center of
                mass.
        """
        ...

    def add_torque(self, node: SceneNode, torque: Vector, *, relative: bool) -> None:
        """Apply a torque in the next basic step; see `add_force` for `relative`."""
        ...


class AppearanceInterface(Protocol):
    """The data of a world for viewers; the data is computed only at a request."""

    def scene(self, world: str) -> VisibleScene:
        """Return the current nodes and visible shapes of the world; `world` is its name."""
        ...

    def state(self, time_ms: int) -> SceneState:
        """Return the current poses of moving nodes, and the positions of joints."""
        ...


class Backend(Protocol):
    """The simulation of one loaded world; a reload creates a new Backend.

    Attributes:
        tree: the nodes of the world.
        time_ms: simulated time in milliseconds; a reset sets it to 0.
        mode: the simulation mode; in PAUSE no steps run.
        quit_status: the exit status that `quit` requested; None before that request.
        movies: recordings of the Viewpoint's view.
    """

    movies: Movies
    tree: SceneTree
    time_ms: int
    mode: Mode
    quit_status: int | None

    @property
    def appearance(self) -> AppearanceInterface:
        """The data of the world for viewers."""
        ...

    @property
    def motion(self) -> MotionBackend:
        """The motion of the nodes."""
        ...

    @property
    def robots(self) -> Sequence[Robot]:
        """The robots, in the order of the world file."""
        ...

    @property
    def left_out(self) -> Sequence[WorldError]:
        """An error for each unsupported node that was left out, with its line and column in the file."""
        ...

    @property
    def abilities(self) -> Abilities:
        """The contents of a world that the physics simulates."""
        ...

    @property
    def unread_meshes(self) -> Mapping[str, int]:
        """The number of visible shapes by type that no sensor sees; see `View.unread_meshes`."""
        ...

    @property
    def unread_textures(self) -> int:
        """The number of visible shapes whose texture has no effect on infra-red sensors."""
        ...

    @property
    def basic_step_ms(self) -> int:
        """The basic time step in milliseconds: the field WorldInfo.basicTimeStep."""
        ...

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the values of sensors do not change until `sample`."""
        ...

    def sample(self) -> None:
        """Measure the value of every sensor now."""
        ...

    def before_next_step(self, change: Callable[[], None], /) -> None:
        """Call `change` at the beginning of the next basic step."""
        ...

    def changed(self, node: SceneNode, field: str, /) -> None:
        """Apply the effect of a field whose value a client has changed."""
        ...

    def reset(self) -> None:
        """Request a reset of the world within the next basic step."""
        ...

    def reset_physics(self) -> None:
        """Stop all motion immediately."""
        ...

    def quit(self, status: int) -> None:
        """Request the end of the simulator."""
        ...

    def robot_of(self, node: SceneNode) -> Robot | None:
        """Return the robot that belongs to a Robot node; None for any other node."""
        ...

    def add(self, text: str, field: NodeField, index: int) -> bool:
        """Insert the nodes of `text` into a field; return False if `index` is not a valid position."""
        ...

    def remove(self, node: SceneNode) -> None:
        """Remove a node and all nodes inside it."""
        ...

    def export_image(self, path: str, quality: int) -> bool:
        """Save an image of the Viewpoint's view to a file; return whether that was possible.

        `quality` is the quality of a JPEG file, from 1 to 100.
        """
        ...

    def contact_points(self, node: SceneNode, *, descendants: bool) -> Sequence[tuple[Vector, int]]:
        """Return the contact points of a node: each has a position in meters and the number of a node.

        With `descendants`, the contact points of all nodes inside the node are included.
        """
        ...

    def save_state(self, node: SceneNode, name: str) -> None:
        """Save the state of a node under a name."""
        ...

    def load_state(self, node: SceneNode, name: str) -> None:
        """Return a node to a saved state; "__init__" is the state in the world file."""
        ...

    def set_joint_position(self, node: SceneNode, position: float, index: int) -> None:
        """Set the position of a joint, in rad or m; `index` is the number of the axis, counted from 1."""
        ...
