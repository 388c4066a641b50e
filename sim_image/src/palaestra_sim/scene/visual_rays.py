"""Cast rays against visible shapes, for infra-red DistanceSensors and for lidars without rendering. Pure.

A ray stops at the first surface that faces it. The ray passes through the robot that carries the sensor, and
through shapes that contain the ray's origin. The formula of the reflection is from
reference/distancesensor.md of Webots, "Infra-Red Sensors".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Final, NamedTuple

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector, dot, minus, turn
from palaestra_sim.scene.meshes import Mesh, nearest_triangle
from palaestra_sim.scene.sensor_rays import Beam
from palaestra_sim.scene.textures import Paint, Textures, returned_light
from palaestra_sim.scene.visuals import Drawn, View

_PARALLEL: Final = 1e-12


class Glance(NamedTuple):
    """The result of casting a ray.

    Attributes:
        distance_m: the distance to the shape; the reach of the ray if it meets no shape.
        reflection: the share of infra-red light that the shape returns; 1 if the ray meets no shape.
    """

    distance_m: float
    reflection: float


class VisualRays:
    """The rays of one robot's sensors, which stop at visible shapes.

    Args:
        view: the visible part of the world.
        carrier: the frame of the robot.
        beams: the rays, in the frame `mount`.
        mount: a frame on the robot, which a joint moves; None for the frame of the robot.
        textures: whether textures affect the reflection.
    """

    def __init__(
        self,
        view: View,
        carrier: Frame,
        beams: Sequence[Beam],
        mount: Frame | None = None,
        *,
        textures: bool = False,
    ) -> None:
        self._view = view
        self._textures = textures
        self._carrier = carrier
        self._mount = mount or carrier
        self._bundles = [
            (origin, [(direction, reach_m) for _, direction, reach_m in rays])
            for origin, rays in groupby(map(_ray, beams), key=itemgetter(0))
        ]
        self._seen = (-1, -1)
        self._standing: list[_Target] = []
        self._moving: list[_Target] = []

    def cast(self) -> list[Glance]:
        """Return the current result of each ray."""
        self._refresh()
        for target in self._moving:
            target.place()
        targets = [*self._standing, *self._moving]
        pose = self._mount.world_pose
        return [glance for origin, rays in self._bundles for glance in _bundle(targets, pose, origin, rays)]

    def _refresh(self) -> None:
        """Collect the shapes again if a shape was changed, or if a client moved a shape."""
        seen = (self._view.changes, self._view.moves)
        if seen == self._seen:
            return
        self._seen = seen
        self._standing, self._moving = [], []
        for thing in self._view.things():
            chain = [] if thing.place is None else list(thing.place.chain())
            if self._carrier in chain:
                continue
            of_its_kind = self._moving if any(place.moves for place in chain) else self._standing
            of_its_kind.append(_Target(thing, self._view.textures if self._textures else None))


class _Target:
    """A visible shape, at the pose of its last update."""

    __slots__ = ("_paint", "_thing", "center", "half_height_m", "hit", "inward", "radius_m", "reflection")

    def __init__(self, thing: Drawn, textures: Textures | None) -> None:
        self._thing = thing
        self._paint: Paint | None = None
        if textures is not None and thing.look is not None:
            self._paint = textures.paint(thing.look, thing.geometry, thing.color[3], thing.tiles)
        self.hit = surface_of(thing)
        self.radius_m = _radius(thing)
        self.reflection = reflection(thing)
        self.place()

    def place(self) -> None:
        """Update the pose to the current pose of the shape."""
        thing = self._thing
        pose = thing.pose
        self.inward = pose.inverse
        self.center = pose.position
        up = pose.rotation[6:]
        box_m = sum(abs(share) * length / 2.0 for share, length in zip(up, thing.size, strict=True))
        self.half_height_m = self.radius_m if thing.mesh else box_m

    def light(self, origin: Vector, direction: Vector, distance_m: float) -> float:
        """Return the share of light that returns where a ray, in the shape's frame, meets the shape."""
        if self._paint is None:
            return self.reflection
        x, y, z = (
            2.0 * (at + distance_m * way) / length
            for at, way, length in zip(origin, direction, self._thing.size, strict=True)
        )
        return self._paint.reflection((x, y, z))


def reflection(thing: Drawn) -> float:
    """Return the share of infra-red light that a shape returns, 0.2 to 1."""
    red, _, _, opaque = thing.color
    return returned_light(red * opaque, thing.roughness)


def _ray(beam: Beam) -> tuple[Vector, Vector, float]:
    """Return origin, unit direction and reach of a beam, in the robot's frame."""
    x, y, across, along = beam.ray
    stretch = math.hypot(1.0, beam.slope)
    direction = (across / stretch, along / stretch, beam.slope / stretch)
    return (x, y, beam.height_m), direction, beam.reach_m


def _bundle(
    targets: Sequence[_Target], pose: Pose, origin: Vector, rays: Sequence[tuple[Vector, float]]
) -> Iterator[Glance]:
    """Yield the results of rays with one origin; origin and directions are in the frame of `pose`."""
    start = pose.carry(origin)
    farthest = max(reach_m for _, reach_m in rays)
    near = []
    for target in targets:
        offset = minus(target.center, start)
        beyond = dot(offset, offset) - target.radius_m**2  # negative: the origin is inside the target's ball
        if beyond < 0.0 or math.hypot(*offset) - target.radius_m < farthest:
            near.append((target, *offset, target.radius_m, beyond, target.inward.carry(start)))
    near.sort(key=itemgetter(5))  # the nearest target first, because it hides the most rays
    level = [row for row in near if abs(row[3]) <= row[0].half_height_m]
    for direction, reach_m in rays:
        dx, dy, dz = towards = turn(pose.rotation, direction)
        nearest, met = reach_m, None
        for target, x, y, z, radius_m, beyond, inside in near if dz else level:
            along = x * dx + y * dy + z * dz
            if along - radius_m > nearest or (beyond > 0.0 and (along < 0.0 or beyond > along * along)):
                continue
            inward = turn(target.inward.rotation, towards)
            distance_m = target.hit(inside, inward)
            if distance_m < nearest:
                nearest, met = distance_m, (target, inside, inward)
        yield Glance(nearest, 1.0 if met is None else met[0].light(met[1], met[2], nearest))


def _radius(thing: Drawn) -> float:
    """Return the radius of a ball that contains a shape; its center is the origin of the shape's frame."""
    if thing.mesh is None:
        return math.hypot(*thing.size) / 2.0
    return max(math.dist((0.0, 0.0, 0.0), point) for point in _scaled(thing.mesh, thing.size))


Surface = Callable[[Vector, Vector], float]


def surface_of(thing: Drawn) -> Surface:
    """Return a function from origin and direction, in the shape's frame, to the distance in meters."""
    half = thing.size[0] / 2.0, thing.size[1] / 2.0, thing.size[2] / 2.0
    if thing.mesh is not None:
        return _of_mesh(_scaled(thing.mesh, thing.size), thing.mesh)
    match thing.kind:
        case "ball":
            return lambda origin, direction: _ball(origin, direction, half)
        case "cylinder":
            return lambda origin, direction: _cylinder(origin, direction, half)
        case "capsule":
            return lambda origin, direction: _capsule(origin, direction, half)
    if thing.geometry == "Plane":
        return lambda origin, direction: _sheet(origin, direction, half)
    return lambda origin, direction: _box(origin, direction, half)


def _box(origin: Vector, direction: Vector, half: Vector) -> float:
    enter, leave, inside = 0.0, math.inf, True
    for axis in (0, 1, 2):
        at, towards, reach = origin[axis], direction[axis], half[axis]
        outside = at >= reach or at <= -reach
        inside = inside and not outside
        if -_PARALLEL < towards < _PARALLEL:
            if outside:
                return math.inf
            continue
        first, second = (-reach - at) / towards, (reach - at) / towards
        if first > second:
            first, second = second, first
        enter = max(enter, first)
        leave = min(leave, second)
        if enter > leave:
            return math.inf
    return math.inf if inside else enter


def _sheet(origin: Vector, direction: Vector, half: Vector) -> float:
    """Return the meters to the upper side of a box; a Plane has only this side."""
    above = origin[2] - half[2]
    if above < 0.0 or direction[2] > -_PARALLEL:
        return math.inf
    distance = -above / direction[2]
    x, y = origin[0] + distance * direction[0], origin[1] + distance * direction[1]
    return distance if abs(x) <= half[0] and abs(y) <= half[1] else math.inf


def _ball(origin: Vector, direction: Vector, half: Vector) -> float:
    """Return the distance in meters to an ellipsoid; the calculation scales it to a ball of radius 1."""
    ox, oy, oz = (at / size for at, size in zip(origin, half, strict=True))
    dx, dy, dz = (towards / size for towards, size in zip(direction, half, strict=True))
    return _root(dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - 1.0)


def _root(square: float, half_linear: float, constant: float) -> float:
    """Return the first root of a ray's equation; infinite without a root ahead, or for a ray from inside."""
    under = half_linear * half_linear - square * constant
    if constant < 0.0 or under < 0.0 or square < _PARALLEL:
        return math.inf
    first = (-half_linear - math.sqrt(under)) / square
    return first if first >= 0.0 else math.inf


def _cylinder(origin: Vector, direction: Vector, half: Vector) -> float:
    """Return the distance in meters to a cylinder around z, whose cross-section may be an ellipse."""
    ox, oy, dx, dy = origin[0] / half[0], origin[1] / half[1], direction[0] / half[0], direction[1] / half[1]
    apart = ox * ox + oy * oy - 1.0
    if apart < 0.0 and abs(origin[2]) < half[2]:
        return math.inf
    side = _root(dx * dx + dy * dy, ox * dx + oy * dy, apart)
    found = side if abs(origin[2] + side * direction[2]) <= half[2] else math.inf
    if abs(direction[2]) > _PARALLEL:
        end = (-math.copysign(half[2], direction[2]) - origin[2]) / direction[2]
        if end >= 0.0 and math.hypot(ox + end * dx, oy + end * dy) <= 1.0:
            found = min(found, end)
    return found


def _capsule(origin: Vector, direction: Vector, half: Vector) -> float:
    """Return the distance to a capsule around z in meters; `half` includes its caps."""
    radius = half[0]
    straight = max(half[2] - radius, 0.0)
    ox, oy, oz = origin
    dx, dy, dz = direction
    if math.dist(origin, (0.0, 0.0, max(-straight, min(straight, oz)))) < radius:
        return math.inf
    side = _root(dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - radius * radius)
    found = side if abs(oz + side * dz) <= straight else math.inf
    for cap in (-straight, straight):
        at = oz - cap
        found = min(found, _root(1.0, ox * dx + oy * dy + at * dz, ox * ox + oy * oy + at * at - radius**2))
    return found


def _scaled(mesh: Mesh, scale: Vector) -> list[Vector]:
    return [(x * scale[0], y * scale[1], z * scale[2]) for x, y, z in mesh.points]


def _of_mesh(points: Sequence[Vector], mesh: Mesh) -> Surface:
    """Return the surface of triangles that a ray meets only from outside."""
    scaled = Mesh(tuple(points), mesh.triangles)
    return lambda origin, direction: nearest_triangle(scaled, origin, direction, front=True)
