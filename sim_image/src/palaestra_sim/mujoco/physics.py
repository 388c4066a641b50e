"""The physics of a world in MuJoCo.

One model has all robots and obstacles. The model is built again when an object is added or removed. A basic
step is a whole number of MuJoCo's steps. After each basic step, the poses are copied to the scene, where
devices read them. Rays are cast when a sensor is sampled. Images are rendered from a separate model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from palaestra_sim.mujoco.body import MujocoBody
from palaestra_sim.mujoco.camera import MujocoCamera
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.lidar_rays import LidarBeams
from palaestra_sim.mujoco.model import Built, Contents, build
from palaestra_sim.mujoco.rays import Beams
from palaestra_sim.mujoco.renderer import Renderer
from palaestra_sim.mujoco.video import MujocoVideo
from palaestra_sim.scene.bodies import Build
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.dynamic_solids import DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.movies import Movie
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics import Abilities, Cast, ContactPoint, Figure, Push
from palaestra_sim.scene.physics_settings import PhysicsSettings
from palaestra_sim.scene.sensor_rays import Beam
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.visuals import View

LONGEST_STEP_S: Final = 0.004  # maximum duration of MuJoCo's step; with longer steps, contacts are soft


class MujocoPhysics:
    """Computes the motion, the sensor rays and the images of one world; see `Physics`.

    Args:
        feeling: whether the model has a contact sensor for each part of a robot; see `model.build`.
    """

    abilities = Abilities(name="MuJoCo", loose=True, leaning=True, forces=True, joints=True, exact=True)

    def __init__(self, *, feeling: bool = False) -> None:
        self._feeling = feeling
        self._surroundings = PhysicsSettings()
        self._floors = self._surroundings.heights_m()
        self._contents = Contents()
        self._heights: list[float] = []
        self._built: Built = build(self._contents, self._surroundings)
        self._moved: frozenset[Frame] = frozenset()  # obstacles that moved since the last reset
        self._stale = False
        self._settled = True
        self._pushes: list[tuple[Figure | DynamicSolid, Push]] = []
        self._pictures: Renderer

    def body(self, build: Build) -> MujocoBody:
        """Return the body of a robot that is being loaded."""
        return MujocoBody(build)

    def begin(self, surroundings: PhysicsSettings) -> None:
        """Set gravity and frictions of the world."""
        self._surroundings = surroundings
        self._stale = True

    def arrange(
        self,
        figures: Sequence[Figure],
        solids: Sequence[Shape],
        loose: Sequence[DynamicSolid],
        doors: Sequence[Link] = (),
    ) -> None:
        """Set these robots, obstacles, dynamic solids and doors as the contents of the world."""
        contents = Contents(
            figures=tuple(figures), solids=tuple(solids), loose=tuple(loose), doors=tuple(doors)
        )
        floors = self._surroundings.heights_m()
        if floors != self._floors:
            self._floors = floors
            self._stale = True
        heights = [figure.place.height_m for figure, _ in contents.moving]
        if heights != self._heights:  # a robot touches only obstacles at its own height
            self._heights = heights
            self._stale = True
        if contents == self._contents:
            self._built.put_obstacles()
            displaced = self._built.displaced()
            self._moved |= displaced
            self._stale = self._stale or bool(displaced)
        else:
            self._contents = contents
            self._stale = True
        self._settled = False

    def advance(self, step_s: float) -> None:
        """Move the bodies by one basic step."""
        built = self._fresh()
        steps = mujoco_steps(step_s)
        built.model.opt.timestep = step_s / steps
        built.take()
        for target, push in self._pushes:
            built.push(target, push)
        for figure, (body, _) in built.figures.items():
            body.command(step_s, powered=figure.powered)
        for whose, links in built.links.items():
            for link in links:
                link.command(step_s, powered=whose is None or whose.powered)
        for _ in range(steps):
            mujoco.mj_step(built.model, built.data)
            if built.data.ncon:
                built.feel()
        for body, _ in built.figures.values():
            body.follow(step_s)
        for link in built.all_links():
            link.follow()
        if self._pushes:
            self._pushes.clear()
            built.data.xfrc_applied[:] = 0.0
        self._settled = False

    def reset(self) -> None:
        """Discard the start values of the solver, such as the forces of the last step.

        The positions and speeds of bodies and joints stay as the scene has set them.
        """
        mujoco.mj_resetData(self._built.model, self._built.data)
        self._built.put_obstacles()
        self._pushes.clear()
        self._stale = self._stale or bool(self._moved)
        self._moved = frozenset()
        for body, _ in self._built.figures.values():
            body.write()
        for link in self._built.all_links():
            link.forget()
        self._settled = False

    def look(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function that computes the distance in meters that each beam of a robot travels now."""
        bundle = Beams(figure, beams, mount)

        def cast() -> Sequence[float]:
            self._settle()
            return bundle.cast(self._built)

        return cast

    def see(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function like `look`; but the beams stop at visible shapes, except those of the robot."""
        return LidarBeams(self._pictures, figure, beams, mount).cast

    def push(self, target: Figure | DynamicSolid, push: Push) -> None:
        """Apply a force to a robot or a dynamic solid in the next basic step."""
        self._pushes.append((target, push))

    def show(self, view: View) -> None:
        """Set the visible shapes of the world, for cameras and lidars."""
        self._pictures = Renderer(view)

    def eye(self, place: Frame, lens: Lens) -> MujocoCamera | None:
        """Return a camera; None if its image would not be flat."""
        return MujocoCamera(self._pictures, place, lens) if lens.flat else None

    def film(self, movie: Movie) -> MujocoVideo:
        """Return a writer for a movie."""
        return MujocoVideo(movie)

    def contacts(self) -> Iterator[ContactPoint]:
        """Yield the current contact points of robots, dynamic solids and obstacles with each other."""
        self._settle()
        self._built.collide()
        contacts = self._built.data.contact
        for pair, position in zip(contacts.geom.tolist(), contacts.pos.tolist(), strict=True):
            sides = [self._built.geoms.get(geom) for geom in pair]
            if sides[0] is not None and sides[1] is not None:
                x, y, z = position
                yield ContactPoint((x, y, z), (_solid(sides[0][0].node), _solid(sides[1][0].node)))

    def built(self) -> Built:
        """Return the compiled model with its current state."""
        return self._fresh()

    def _fresh(self) -> Built:
        """Return the model; build it again if objects were added or removed, or if a fixed obstacle moved."""
        if self._stale:
            self._stale = False
            self._built = build(self._contents, self._surroundings, self._moved, feeling=self._feeling)
        return self._built

    def _settle(self) -> None:
        if self._fresh().take() or not self._settled:
            self._built.settle()
            self._settled = True


def mujoco_steps(step_s: float) -> int:
    """Return the number of MuJoCo's steps in a basic step."""
    return math.ceil(step_s / LONGEST_STEP_S - 1e-9)


def _solid(node: SceneNode) -> SceneNode:
    """Return the Solid, Robot or device whose boundingObject contains a node."""
    around = (node, *node.ancestors())
    return next((it for it in around if it.place is not None and not it.outline), node)
