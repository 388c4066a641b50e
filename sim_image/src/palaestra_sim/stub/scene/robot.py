"""One simulated robot: its motors, its sensors, and its noise.

The seed of the noise comes in the robot's `customData`, either as a whole number (`"7"`) or as JSON
(`'{"seed": 7}'`), and is taken when the world is loaded and at each `simulation_reset`. Anything
else leaves the seed as it was; the first one is WorldInfo.randomSeed. From a reset on, the noise is a
function of the seed and of the number of steps alone. Every sensor with noise draws at every step, also
while it is not enabled: types in the order of the table of devices, sensors in that of the world file.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Mapping, Sequence

from palaestra_sim.stub.physics.body import Body
from palaestra_sim.stub.physics.geometry import Vector
from palaestra_sim.stub.physics.motors import Motor
from palaestra_sim.stub.physics.obstacles import Neighborhood
from palaestra_sim.stub.physics.rays import Beam, Fan, SlopedBeams, Upright
from palaestra_sim.stub.scene.battery import Battery
from palaestra_sim.stub.scene.devices import DEVICES
from palaestra_sim.stub.scene.devices.kind import Sample, Source
from palaestra_sim.stub.scene.motion import Motion, Trail, motion_of
from palaestra_sim.stub.scene.nodes.scene_node import FieldContent
from palaestra_sim.stub.scene.places import Place
from palaestra_sim.stub.scene.robot_reader import RobotParts
from palaestra_sim.stub.scene.shapes import Shape


class Robot:
    """A robot of the world, whether it drives or only watches.

    Attributes:
        name: Robot.name in the world file.
        motors: by device name.
        sensors: by device name; each has a `value` after a step.
        samplers: give all sensors their values of this moment, in this order.
        gauss: returns the next number of the robot's noise, from mean and deviation.
        place: its frame.
        body: None for a robot that only watches.
        battery: without energy if the robot has none.
    """

    def __init__(self, parts: RobotParts, random_seed: int) -> None:
        self.parts = parts
        self.name = parts.name
        self.motors: dict[str, Motor] = parts.devices.motors
        self.sensors: Mapping[str, Source] = parts.devices.sensors
        self.place: Place = parts.place
        self.body: Body | None = parts.body
        self.battery = Battery(parts.node)
        self._has_battery = self.battery.value >= 0.0
        self.seed = random_seed
        self._random = random.Random()  # noqa: S311 - noise, not secrets
        self.gauss = self._random.gauss
        self._fans: list[tuple[Fan, tuple[float, float]]] = []
        self._sloped: list[SlopedBeams] = []
        self._trails: list[Trail] = []
        self.samplers: tuple[Sample, ...] = tuple(
            kind.sampler(devices, self)
            for kind in DEVICES.values()
            if kind.sampler is not None and (devices := parts.devices.of(kind))
        )
        self._stray_motors = tuple(
            it for it in self.motors.values() if self.body is None or not self.body.driven_by(it)
        )
        self.sow()

    @property
    def custom_data(self) -> str:
        """The customData field, as it is now."""
        return self.parts.node.text("customData") or ""

    @custom_data.setter
    def custom_data(self, text: str) -> None:
        self.parts.node.fields["customData"] = FieldContent([text])

    def face(self, solids: Sequence[Shape], others: Sequence[Robot]) -> None:
        """Set the obstacles of this robot and its rays."""
        bodies = [it.body for it in others if it.body is not None and it.body.radius > 0.0]
        height = self.place.world_pose.position[2]
        if self.body is not None and self.body.radius > 0.0:
            in_the_way = _between(solids, self.parts.heights, height)
            self.body.face(_neighborhood(in_the_way, self.body.radius), bodies)
        for fan, heights in self._fans:
            fan.face(_neighborhood(_between(solids, heights, height), fan.reach_m), bodies)
        for sloped in self._sloped:
            sloped.face(
                [_upright(shape) for shape in solids], [it for robot in others for it in robot.outline]
            )

    @property
    def outline(self) -> tuple[Upright, ...]:
        """Its body, as others see it; none if nothing can run into it."""
        if self.body is None or self.body.radius == 0.0:
            return ()
        low, high = self.parts.heights
        height = self.place.world_pose.position[2]
        return (Upright(self.body, low + height, high + height),)

    def look(self, beams: Sequence[Beam]) -> Callable[[], Sequence[float]]:
        """Return a function that returns how far each beam travels now, in meters; see `Carrier`."""
        frame = self._frame
        if any(not beam.level for beam in beams):
            sloped = SlopedBeams(beams)
            self._sloped.append(sloped)
            place = self.place
            return lambda: sloped.cast(frame(), place.translation[2])
        fan = Fan([beam.ray for beam in beams], [beam.reach_m for beam in beams])
        heights = [beam.height_m for beam in beams]
        self._fans.append((fan, (min(heights), max(heights))))
        cast = fan.cast
        return lambda: cast(frame())

    def touching(self, outline: Sequence[Shape]) -> int:
        """Return the parts of the body that these shapes are, as bits of `Body.touched`."""
        return sum(1 << index for index, shape in enumerate(self.parts.rim) if shape in outline)

    def motion(self, place: Place) -> Motion:
        """Return how a place on the robot moves in the world; see `Carrier`."""
        return motion_of(place, self.body)

    def follow(self, place: Place) -> Callable[[], Vector]:
        """Return a function that returns the acceleration of a place; see `Carrier`."""
        trail = Trail(place, self.body)
        self._trails.append(trail)
        return trail.acceleration

    def advance(self, step_s: float) -> None:
        """Move on by one basic step; with an empty battery, stand still."""
        if self._has_battery and self._exhausted(step_s):
            self.halt()
            return
        for trail in self._trails:
            trail.begin(step_s)
        if self.body is not None:
            self.body.advance(step_s)
        for motor in self._stray_motors:
            motor.advance(step_s)

    def _exhausted(self, step_s: float) -> bool:
        self.battery.drain(step_s)
        return self.battery.empty

    def reset(self) -> None:
        """Return to the start of the world file: pose, rest, motors, battery, noise. customData stays."""
        self.battery.reset()
        self.place.return_to_start()
        for motor in self.motors.values():
            motor.reset()
        self.halt()
        for trail in self._trails:
            trail.reset()
        self.sow()

    def halt(self) -> None:
        """Stop all motion."""
        if self.body is not None:
            self.body.halt()

    def sow(self) -> None:
        """Restart the noise with the seed that is now in customData."""
        self.seed = seed_of(self.custom_data, self.seed)
        self._random.seed(self.seed)

    def _frame(self) -> tuple[float, float, float, float]:
        if self.body is not None:
            return self.body.frame
        pose = self.place.world_pose
        return pose.position[0], pose.position[1], pose.rotation[0], pose.rotation[3]


def seed_of(custom_data: str, otherwise: int) -> int:
    """Return the seed in a robot's customData: `7` or `{"seed": 7}`; else `otherwise`."""
    try:
        value = json.loads(custom_data)
    except (ValueError, RecursionError):
        return otherwise
    if isinstance(value, dict):
        value = value.get("seed")
    return value if isinstance(value, int) and not isinstance(value, bool) else otherwise


def _between(solids: Sequence[Shape], heights: tuple[float, float], shift: float) -> list[Shape]:
    """Return the shapes that reach into a range of heights; touching it, like a floor, is not enough."""
    low, high = heights[0] + shift, heights[1] + shift
    found = []
    for shape in solids:
        bottom, top = shape.heights()
        if bottom < high and top > low:
            found.append(shape)
    return found


def _upright(shape: Shape) -> Upright:
    return Upright(shape.obstacle(), *shape.heights())


def _neighborhood(shapes: Sequence[Shape], reach_m: float) -> Neighborhood:
    return Neighborhood([shape.obstacle() for shape in shapes], reach_m)
