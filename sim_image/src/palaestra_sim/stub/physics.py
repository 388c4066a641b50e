"""The physics of the stub: it moves robots, and computes the distances that their sensor rays travel.

When the world is arranged, the physics compares heights, and selects the obstacles of each robot and ray.
After that, it computes motion and level rays in two dimensions.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from palaestra_sim.scene.bodies import Build
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.dynamic_solids import DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose
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
from palaestra_sim.stub.others import OtherRobot
from palaestra_sim.stub.outline import covering, obstacle
from palaestra_sim.stub.rays import Fan, Met, Rounded, SlopedBeams, Upright

_Tall = tuple[Shape, tuple[float, float]]  # a shape, and the heights of its lower and its upper end


class _Level(NamedTuple):
    """The horizontal beams of one robot.

    Attributes:
        fan: the beams in two dimensions; its obstacles are at the height of every beam.
        heights: the heights of the lowest and of the highest beam, in the robot's frame.
        rest: the same beams in three dimensions, for obstacles that only some of the beams can meet, and for
            obstacles that are not upright.
    """

    fan: Fan
    heights: tuple[float, float]
    rest: SlopedBeams

    def cast(self, frame: tuple[float, float, float, float], height_m: float) -> Sequence[float]:
        """Return the distance in meters that each beam travels."""
        distances = self.fan.cast(frame)
        if self.rest.free:
            return distances
        return list(map(min, distances, self.rest.cast(frame, height_m)))


class StubPhysics:
    """Computes the motion and the sensor rays of one world, without masses and forces; see `Physics`."""

    abilities = Abilities(name="the stub")

    def __init__(self) -> None:
        self._moving: list[tuple[Figure, StubBody]] = []
        self._surroundings = PhysicsSettings()
        self._solids: tuple[Shape, ...] = ()
        self._tall: list[_Tall] = []
        self._parts: dict[StubBody, list[tuple[Shape, Pose]]] = {}
        self._level: dict[Figure, list[_Level]] = {}
        self._sloped: dict[Figure, list[SlopedBeams]] = {}
        self._view: View

    def body(self, build: Build) -> StubBody:
        """Return the body of a robot: upright cylinders between its lowest and highest point."""
        parts = covering(build.outline)
        outline, rim = [part for part, _ in parts], [shape for _, shape in parts]
        body = StubBody(build.base, outline, rim, build.heights)
        # The robot is still at the origin of the world, so these poses are relative to the robot.
        self._parts[body] = [(shape, shape.pose.inverse) for shape in build.outline]
        return body

    def begin(self, surroundings: PhysicsSettings) -> None:
        """Set the floors of the world; the stub ignores gravity and friction."""
        self._surroundings = surroundings

    def arrange(
        self,
        figures: Sequence[Figure],
        solids: Sequence[Shape],
        loose: Sequence[DynamicSolid],
        doors: Sequence[Link] = (),
    ) -> None:
        """Set the obstacles of each robot and of its rays."""
        del loose, doors  # both are empty, because `abilities` excludes such objects
        self._solids = tuple(solids)
        self._tall = [(shape, shape.heights()) for shape in solids]
        self._moving = [(it, it.body) for it in figures if isinstance(it.body, StubBody)]
        self._level = {it: beams for it, beams in self._level.items() if it in figures}
        self._sloped = {it: beams for it, beams in self._sloped.items() if it in figures}
        for figure in figures:
            others = [(it, body) for it, body in self._moving if it is not figure and body.radius > 0.0]
            robots = [(body, OtherRobot(body, it.place, self._parts[body])) for it, body in others]
            self._face(figure, robots)
            if not self._sloped.get(figure):
                continue
            around = [shape for shape in solids if not _is_on(figure, shape)]
            uprights = [_upright(shape) for shape in around if shape.prismatic]
            rounded: list[Met] = [_rounded(shape) for shape in around if not shape.prismatic]
            rounded += [robot for _, robot in robots]
            for sloped in self._sloped[figure]:
                sloped.face(uprights, self._surroundings.heights_m(), rounded)

    def advance(self, step_s: float) -> None:
        """Move the bodies by one basic step."""
        for figure, body in self._moving:
            if figure.powered:
                body.advance(step_s)

    def reset(self) -> None:
        """Do nothing: the physics has no state besides the state of the bodies."""

    def look(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function that computes the distance in meters that each beam of a robot travels now."""
        place, body = figure.place, figure.body
        if mount or not isinstance(body, StubBody) or any(not beam.level for beam in beams):
            sloped = SlopedBeams(beams)
            self._sloped.setdefault(figure, []).append(sloped)
            if isinstance(body, StubBody) and not mount:
                return lambda: sloped.cast(body.frame, place.height_m)
            return lambda: sloped.cast_from((mount or place).ground_pose)
        fan = Fan([beam.ray for beam in beams], [beam.reach_m for beam in beams])
        heights = [beam.height_m for beam in beams]
        level = _Level(fan, (min(heights), max(heights)), SlopedBeams(beams))
        self._level.setdefault(figure, []).append(level)
        return lambda: level.cast((body.x, body.y, body.c, body.s), place.height_m)

    def see(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function like `look`; but the beams stop at visible shapes, except those of the robot."""
        sight = VisualRays(self._view, figure.place, beams, mount)
        return lambda: [glance.distance_m for glance in sight.cast()]

    def push(self, target: Figure | DynamicSolid, push: Push) -> None:
        """Do nothing: robots have no masses, so a force has no effect; see `abilities`."""

    def show(self, view: View) -> None:
        """Set the visible shapes of the world, for lidars; the stub renders no images."""
        self._view = view

    def eye(self, place: Frame, lens: Lens) -> None:
        """Return None: the stub renders no images."""
        del place, lens

    def film(self, movie: Movie) -> None:
        """Return None: the stub renders no images."""
        del movie

    def contacts(self) -> Iterable[ContactPoint]:
        """Return the current contact points of robots with obstacles and with each other."""
        return contact_points(self._moving, self._solids)

    def _face(self, figure: Figure, others: Sequence[tuple[StubBody, OtherRobot]]) -> None:
        height = figure.place.height_m
        body = figure.body
        if isinstance(body, StubBody) and body.radius > 0.0:
            in_the_way = [shape for shape, _ in _between(self._tall, body.heights, height)]
            body.face(_neighborhood(in_the_way, body.radius), [it for it, _ in others])
        for level in self._level.get(figure, ()):
            self._face_level(level, height, others)

    def _face_level(
        self, level: _Level, height: float, others: Sequence[tuple[StubBody, OtherRobot]]
    ) -> None:
        """Set the obstacles of horizontal beams.

        Upright obstacles at the height of every beam go to `level.fan`, which is fast. All other obstacles go
        to `level.rest`.
        """
        low, high = level.heights[0] + height, level.heights[1] + height
        whole, partly = [], []
        rounded: list[Met] = [robot for _, robot in others if not robot.stands_along(low, high)]
        for shape, (bottom, top) in _between(self._tall, level.heights, height):
            if not shape.prismatic:
                rounded.append(_rounded(shape))
            elif bottom < low and high < top:
                whole.append(shape)
            else:
                partly.append(_upright(shape))
        along = [body for body, robot in others if robot.stands_along(low, high)]
        level.fan.face(_neighborhood(whole, level.fan.reach_m), along)
        level.rest.face(partly, (), rounded)


def _between(tall: Sequence[_Tall], heights: tuple[float, float], shift: float) -> list[_Tall]:
    """Return the shapes that overlap a range of heights.

    A shape that only touches the end of the range, such as a floor, is left out.
    """
    low, high = heights[0] + shift, heights[1] + shift
    return [(shape, ends) for shape, ends in tall if ends[0] < high and ends[1] > low]


def _is_on(figure: Figure, shape: Shape) -> bool:
    """Return whether a shape is part of a robot; the rays of this robot pass through such shapes."""
    return figure.place in shape.place.chain()


def _rounded(shape: Shape) -> Rounded:
    return Rounded(shape, shape.pose.inverse)


def _upright(shape: Shape) -> Upright:
    return Upright(obstacle(shape), *shape.heights())


def _neighborhood(shapes: Sequence[Shape], reach_m: float) -> Neighborhood:
    return Neighborhood([obstacle(shape) for shape in shapes], reach_m)
