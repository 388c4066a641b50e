"""The physics of the stub: every robot moves by itself, and detects the objects around it.

Heights are checked when the world is arranged. After that, motion and rays are computed as seen from above.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from palaestra_sim.scene.bodies import Build
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.dynamic_solids import DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.movies import Movie
from palaestra_sim.scene.physics import Abilities, Cast, ContactPoint, Figure, Push
from palaestra_sim.scene.physics_settings import PhysicsSettings
from palaestra_sim.scene.sensor_rays import Beam
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.visual_rays import VisualRays
from palaestra_sim.scene.visuals import View
from palaestra_sim.stub.body import StubBody
from palaestra_sim.stub.contacts import contact_points
from palaestra_sim.stub.obstacles import Neighborhood
from palaestra_sim.stub.outline import covering, obstacle
from palaestra_sim.stub.rays import Fan, SlopedBeams, Upright


class _Level(NamedTuple):
    """The level beams of one robot, and the range of their heights in the robot's frame."""

    fan: Fan
    heights: tuple[float, float]


class StubPhysics:
    """The motion of one world, without masses and forces; see `Physics`."""

    abilities = Abilities(name="the stub")

    def __init__(self) -> None:
        self._moving: list[tuple[Figure, StubBody]] = []
        self._surroundings = PhysicsSettings()
        self._solids: tuple[Shape, ...] = ()
        self._level: dict[Figure, list[_Level]] = {}
        self._sloped: dict[Figure, list[SlopedBeams]] = {}
        self._view: View

    def body(self, build: Build) -> StubBody:
        """Return the body of a robot: upright cylinders between its lowest and highest point."""
        parts = covering(build.outline)
        outline, rim = [part for part, _ in parts], [shape for _, shape in parts]
        return StubBody(build.base, outline, rim, build.heights)

    def begin(self, surroundings: PhysicsSettings) -> None:
        """Set the floors of the world; the stub has no forces."""
        self._surroundings = surroundings

    def arrange(
        self,
        figures: Sequence[Figure],
        solids: Sequence[Shape],
        loose: Sequence[DynamicSolid],
        doors: Sequence[Link] = (),
    ) -> None:
        """Set the obstacles of each robot and of its rays."""
        del loose, doors  # the world checks refuse both, see `abilities`
        self._solids = tuple(solids)
        self._moving = [(it, it.body) for it in figures if isinstance(it.body, StubBody)]
        self._level = {it: beams for it, beams in self._level.items() if it in figures}
        self._sloped = {it: beams for it, beams in self._sloped.items() if it in figures}
        for figure in figures:
            others = [(it, body) for it, body in self._moving if it is not figure and body.radius > 0.0]
            self._face(figure, [body for _, body in others])
            if not self._sloped.get(figure):
                continue
            uprights = [_upright(shape) for shape in solids if not _is_on(figure, shape)]
            for sloped in self._sloped[figure]:
                others_now = [_of_robot(it, body) for it, body in others]
                sloped.face(uprights, others_now, self._surroundings.heights_m())

    def advance(self, step_s: float) -> None:
        """Move the bodies by one basic step."""
        for figure, body in self._moving:
            if figure.powered:
                body.advance(step_s)

    def reset(self) -> None:
        """Do nothing: no motion depends on the past."""

    def look(self, figure: Figure, beams: Sequence[Beam]) -> Cast:
        """Return a function that returns the distance that each beam of a robot travels now, in meters."""
        place, body = figure.place, figure.body
        if not isinstance(body, StubBody) or any(not beam.level for beam in beams):
            sloped = SlopedBeams(beams)
            self._sloped.setdefault(figure, []).append(sloped)
            if isinstance(body, StubBody):
                return lambda: sloped.cast(body.frame, place.height_m)
            return lambda: sloped.cast_from(place.ground_pose)
        fan = Fan([beam.ray for beam in beams], [beam.reach_m for beam in beams])
        heights = [beam.height_m for beam in beams]
        self._level.setdefault(figure, []).append(_Level(fan, (min(heights), max(heights))))
        cast = fan.cast
        return lambda: cast((body.x, body.y, body.c, body.s))

    def see(self, figure: Figure, beams: Sequence[Beam]) -> Cast:
        """Return the same function for beams that meet visible objects and pass through the robot itself."""
        sight = VisualRays(self._view, figure.place, beams)
        return lambda: [glance.distance_m for glance in sight.cast()]

    def push(self, target: Figure | DynamicSolid, push: Push) -> None:
        """Do nothing: without masses a force has no effect; see `abilities`."""

    def show(self, view: View) -> None:
        """Set the part of the world that lidars see; the stub renders no images."""
        self._view = view

    def eye(self, place: Frame, lens: Lens) -> None:
        """Return None: the stub renders no images."""
        del place, lens

    def film(self, movie: Movie) -> None:
        """Return None: the stub renders no images."""
        del movie

    def contacts(self) -> Iterable[ContactPoint]:
        """Return the contact points of robots with obstacles and with each other now."""
        return contact_points(self._moving, self._solids)

    def _face(self, figure: Figure, others: Sequence[StubBody]) -> None:
        height = figure.place.height_m
        body = figure.body
        if isinstance(body, StubBody) and body.radius > 0.0:
            in_the_way = _between(self._solids, body.heights, height)
            body.face(_neighborhood(in_the_way, body.radius), others)
        for fan, heights in self._level.get(figure, ()):
            fan.face(_neighborhood(_between(self._solids, heights, height), fan.reach_m), others)


def _between(solids: Sequence[Shape], heights: tuple[float, float], shift: float) -> list[Shape]:
    """Return the shapes that reach into a range of heights; to touch it, as a floor does, is not enough."""
    low, high = heights[0] + shift, heights[1] + shift
    found = []
    for shape in solids:
        bottom, top = shape.heights()
        if bottom < high and top > low:
            found.append(shape)
    return found


def _of_robot(figure: Figure, body: StubBody) -> Upright:
    height = figure.place.height_m
    return Upright(body, body.heights[0] + height, body.heights[1] + height)


def _is_on(figure: Figure, shape: Shape) -> bool:
    """Return whether a shape is part of a robot; the robot's own rays pass through it."""
    return figure.place in shape.place.chain()


def _upright(shape: Shape) -> Upright:
    return Upright(obstacle(shape), *shape.heights())


def _neighborhood(shapes: Sequence[Shape], reach_m: float) -> Neighborhood:
    return Neighborhood([obstacle(shape) for shape in shapes], reach_m)
