"""The interface of a physics for the scene: bodies that move, rays, contacts, and images.

The scene reads a world, and gives its robots devices. A physics moves these robots. The stub's physics is
kinematic; any class that implements the Protocol `Physics` can replace it. A physics uses the axes of the
ground, where z points up, even if y points up in the world file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from palaestra_sim.scene.bodies import Body, Build
from palaestra_sim.scene.camera_interface import CameraInterface, Lens
from palaestra_sim.scene.dynamic_solids import DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.movies import Movie, VideoWriter
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics_settings import PhysicsSettings
from palaestra_sim.scene.sensor_rays import Beam
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.visuals import View

Cast = Callable[[], Sequence[float]]


class Figure(Protocol):
    """A robot, whether it moves or not.

    Attributes:
        place: the frame of the robot.
        body: the robot's body in this physics; None if the robot cannot drive and is not a free-standing
            obstacle.
        powered: whether the robot's motors have energy to turn.
    """

    place: Frame
    body: Body | None
    powered: bool

    @property
    def links(self) -> Sequence[Link]:
        """The parts on the robot's joints that forces move, outer parts first."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Abilities:
    """The contents of a world that a physics simulates; other contents are refused when the world is read.

    Attributes:
        name: the name of the simulator, in messages.
        loose: whether Solids with physics move when they are pushed.
        leaning: whether shapes may have any rotation.
        forces: whether forces have an effect.
        joints: whether forces move parts on joints.
        exact: whether robots and objects collide with their shapes, and not with outlines from above.
    """

    name: str
    loose: bool = False
    leaning: bool = False
    forces: bool = False
    joints: bool = False
    exact: bool = False


class Push(NamedTuple):
    """A force in N and a torque in N m for one basic step, in the axes of the ground.

    The force acts at `point`, in meters. If `point` is None, the force acts at the center of mass.
    """

    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)
    point: Vector | None = None


class ContactPoint(NamedTuple):
    """A point at which two nodes touch, in meters in the axes of the ground."""

    point: Vector
    nodes: tuple[SceneNode, SceneNode]


class Physics(Protocol):
    """The motion of one loaded world.

    Attributes:
        abilities: the contents that this physics simulates.
    """

    abilities: Abilities

    def body(self, build: Build) -> Body:
        """Return the body of a robot that is being read, at the origin of the world and at rest."""
        ...

    def begin(self, surroundings: PhysicsSettings) -> None:
        """Set the options of the whole world, before `arrange` sets its contents."""
        ...

    def arrange(
        self,
        figures: Sequence[Figure],
        solids: Sequence[Shape],
        loose: Sequence[DynamicSolid],
        doors: Sequence[Link] = (),
    ) -> None:
        """Set these robots, obstacles and dynamic solids as the world's contents, at their current poses.

        `doors` are the links that do not belong to a robot.
        """
        ...

    def advance(self, step_s: float) -> None:
        """Move the bodies by one basic step; a body without power comes to rest."""
        ...

    def reset(self) -> None:
        """Discard internal data of earlier steps: the motion then depends only on state and commands."""
        ...

    def look(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function that returns the distance in meters that each beam of a robot travels.

        The beams are in the frame `mount`, which a joint moves; without it, they are in the robot's frame.
        """
        ...

    def see(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function like `look`; but the beams stop at visible shapes, except those of the robot."""
        ...

    def push(self, target: Figure | DynamicSolid, push: Push) -> None:
        """Apply a force to a robot or a dynamic solid in the next basic step."""
        ...

    def show(self, view: View) -> None:
        """Set the visible part of the world; a physics that does not render ignores this call."""
        ...

    def eye(self, place: Frame, lens: Lens) -> CameraInterface | None:
        """Return a camera; None if this physics does not render."""
        ...

    def film(self, movie: Movie) -> VideoWriter | None:
        """Return a writer for a movie; None if this physics does not render.

        Raises:
            OSError: the file of the movie cannot be written.
            UnsimulatedError: the encoder is not installed.
        """
        ...

    def contacts(self) -> Iterable[ContactPoint]:
        """Return the current contact points of robots with obstacles and with each other."""
        ...
