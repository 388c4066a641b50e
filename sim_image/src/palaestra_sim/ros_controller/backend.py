"""The simulation as the front needs it: robots with devices that carry values, nodes and fields, and steps.

The front turns it into names, services and topics. A simulator other than the scene implements this Protocol
to answer the same clients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

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
        """Return the velocity of a node and its turning."""
        ...

    def set_velocity(self, node: SceneNode, velocity: Vector, turning: Vector) -> None:
        """Give a node a velocity and a turning; nothing happens to one that does not move."""
        ...

    def halt(self, node: SceneNode) -> None:
        """Stop the motion of a node."""
        ...

    def add_force(
        self, node: SceneNode, force: Vector, *, relative: bool, offset: Vector | None = None
    ) -> None:
        """Let a force act in the next basic step, at an offset in the node's frame or the center of mass."""
        ...

    def add_torque(self, node: SceneNode, torque: Vector, *, relative: bool) -> None:
        """Let a torque act in the next basic step."""
        ...


class Backend(Protocol):
    """One loaded world. A reload makes another Backend.

    Attributes:
        tree: the nodes of the world.
        time_ms: simulated so far, back to 0 at a reset.
        mode: in PAUSE nothing moves.
        quit_status: the exit status that `quit` asked for; None before.
        movies: of what the Viewpoint shows.
    """

    movies: Movies
    tree: SceneTree
    time_ms: int
    mode: Mode
    quit_status: int | None

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
        """What the simulator lacks and the user left out, each with its place."""
        ...

    @property
    def forces(self) -> bool:
        """Whether the nodes of the world have masses and frictions that matter."""
        ...

    @property
    def basic_step_ms(self) -> int:
        """WorldInfo.basicTimeStep."""
        ...

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the sensors keep their values."""
        ...

    def sample(self) -> None:
        """Give every sensor its value of this moment."""
        ...

    def before_next_step(self, change: Callable[[], None], /) -> None:
        """Call `change` at the beginning of the next basic step."""
        ...

    def changed(self, node: SceneNode, field: str, /) -> None:
        """Take the effect of a field that has a new value."""
        ...

    def reset(self) -> None:
        """Request a reset of the world within the next basic step."""
        ...

    def reset_physics(self) -> None:
        """Stop all motion, at once."""
        ...

    def quit(self, status: int) -> None:
        """Ask for the end of the simulator."""
        ...

    def robot_of(self, node: SceneNode) -> Robot | None:
        """Return the robot of a Robot node; None for any other node."""
        ...

    def add(self, text: str, field: NodeField, index: int) -> bool:
        """Insert the nodes of `text` into a field; False if the field has no place at `index`."""
        ...

    def remove(self, node: SceneNode) -> None:
        """Remove a node and all inside it."""
        ...

    def export_image(self, path: str, quality: int) -> bool:
        """Save what the Viewpoint shows to a file; return whether that was possible.

        `quality` is that of a JPEG file, from 1 to 100.
        """
        ...

    def contact_points(self, node: SceneNode, *, descendants: bool) -> Sequence[tuple[Vector, int]]:
        """Return where a node touches others: points in meters, each with the number of a node."""
        ...

    def save_state(self, node: SceneNode, name: str) -> None:
        """Save the state of a node under a name."""
        ...

    def load_state(self, node: SceneNode, name: str) -> None:
        """Return a node to a saved state; "__init__" is that of the world file."""
        ...

    def set_joint_position(self, node: SceneNode, position: float, index: int) -> None:
        """Put a joint to a position, in rad or m; `index` counts its axes from 1."""
        ...
