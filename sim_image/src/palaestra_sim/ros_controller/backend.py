"""The simulation that `ros_controller` needs: robots with devices, nodes with fields, and steps.

`ros_controller` turns it into names, services and topics. A simulator other than the scene implements this
Protocol to serve the same clients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_sim.errors import WorldError
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.movies import Movies
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.tree.fields import NodeField
from palaestra_sim.scene.tree.scene_tree import SceneTree


class MotionBackend(Protocol):
    """The motion of nodes: m/s, rad/s, N and N m, in the axes of the world file."""

    def velocity(self, node: SceneNode) -> tuple[Vector, Vector]:
        """Return the linear and angular velocity of a node."""
        ...

    def set_velocity(self, node: SceneNode, velocity: Vector, turning: Vector) -> None:
        """Give a node a linear and an angular velocity; no effect on a node that cannot move."""
        ...

    def halt(self, node: SceneNode) -> None:
        """Stop the motion of a node."""
        ...

    def add_force(
        self, node: SceneNode, force: Vector, *, relative: bool, offset: Vector | None = None
    ) -> None:
        """Apply a force in the next basic step, at an offset in the node's frame or at the center of mass."""
        ...

    def add_torque(self, node: SceneNode, torque: Vector, *, relative: bool) -> None:
        """Apply a torque in the next basic step."""
        ...


class AppearanceInterface(Protocol):
    """What a viewer sees of a world; nothing is computed before a request."""

    def scene(self, world: str) -> VisibleScene:
        """Return the looks of the world now; `world` is its name."""
        ...

    def state(self, time_ms: int) -> SceneState:
        """Return the poses of what moves, and the positions of joints."""
        ...


class Backend(Protocol):
    """One loaded world. A reload makes another Backend.

    Attributes:
        tree: the nodes of the world.
        time_ms: simulated time; a reset sets it to 0.
        mode: in PAUSE nothing moves.
        quit_status: the exit status that `quit` requested; None before.
        movies: recordings of the Viewpoint's view.
    """

    movies: Movies
    tree: SceneTree
    time_ms: int
    mode: Mode
    quit_status: int | None

    @property
    def appearance(self) -> AppearanceInterface:
        """What a viewer sees of it."""
        ...

    @property
    def motion(self) -> MotionBackend:
        """The motion of its nodes."""
        ...

    @property
    def robots(self) -> Sequence[Robot]:
        """The robots, in the order of the world file."""
        ...

    @property
    def left_out(self) -> Sequence[WorldError]:
        """The unsupported nodes that the user left out, each with its place."""
        ...

    @property
    def forces(self) -> bool:
        """Whether the masses and frictions of the world's nodes affect the motion."""
        ...

    @property
    def unread_textures(self) -> int:
        """How many visible shapes have a texture that infra-red sensors do not see."""
        ...

    @property
    def basic_step_ms(self) -> int:
        """WorldInfo.basicTimeStep."""
        ...

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the sensors keep their values."""
        ...

    def sample(self) -> None:
        """Set the value of every sensor to that of this moment."""
        ...

    def before_next_step(self, change: Callable[[], None], /) -> None:
        """Call `change` at the beginning of the next basic step."""
        ...

    def changed(self, node: SceneNode, field: str, /) -> None:
        """Apply the effect of a field that has a new value."""
        ...

    def reset(self) -> None:
        """Request a reset of the world within the next basic step."""
        ...

    def reset_physics(self) -> None:
        """Stop all motion, at once."""
        ...

    def quit(self, status: int) -> None:
        """Request the end of the simulator."""
        ...

    def robot_of(self, node: SceneNode) -> Robot | None:
        """Return the robot of a Robot node; None for any other node."""
        ...

    def add(self, text: str, field: NodeField, index: int) -> bool:
        """Insert the nodes of `text` into a field; return False if `index` is not a valid position in it."""
        ...

    def remove(self, node: SceneNode) -> None:
        """Remove a node and all nodes inside it."""
        ...

    def export_image(self, path: str, quality: int) -> bool:
        """Save an image of the Viewpoint's view to a file; return whether that was possible.

        `quality` is that of a JPEG file, from 1 to 100.
        """
        ...

    def contact_points(self, node: SceneNode, *, descendants: bool) -> Sequence[tuple[Vector, int]]:
        """Return a node's contact points: positions in meters, each with the number of a node."""
        ...

    def save_state(self, node: SceneNode, name: str) -> None:
        """Save the state of a node under a name."""
        ...

    def load_state(self, node: SceneNode, name: str) -> None:
        """Return a node to a saved state; "__init__" is the state in the world file."""
        ...

    def set_joint_position(self, node: SceneNode, position: float, index: int) -> None:
        """Set the position of a joint, in rad or m; `index` counts its axes from 1."""
        ...
