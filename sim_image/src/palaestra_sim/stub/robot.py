"""One simulated robot: its motors and sensors, and the noise that is its own.

The seed of the noise comes in the robot's `customData`, either as a whole number (`"7"`) or as JSON
(`'{"seed": 7}'`), and is taken when the world is loaded and at each `simulation_reset`. Anything
else leaves the seed as it was; the first one is WorldInfo.randomSeed. From a reset on, the noise is a
function of the seed and of the number of steps alone: every distance sensor draws at every step, in
the order of the world file, whether anybody looks or not.
"""

from __future__ import annotations

import json
import random
from collections.abc import Sequence

from palaestra_sim.stub.devices import PositionSensor, Sensor, TouchSensor, sample
from palaestra_sim.stub.motors import Motor
from palaestra_sim.stub.obstacles import Neighbourhood
from palaestra_sim.stub.physics import Body
from palaestra_sim.stub.places import Place
from palaestra_sim.stub.rays import Fan
from palaestra_sim.stub.robot_reader import RobotParts
from palaestra_sim.stub.shapes import Shape


class Robot:
    """A robot of the world, whether it drives or only watches.

    Attributes:
        name: Robot.name in the world file.
        motors: by device name.
        sensors: by device name; each has a `value` after a step.
        place: where it stands.
        body: what drives; None for a robot that only watches.
        custom_data: the customData field, as it stands now.
    """

    def __init__(self, parts: RobotParts, random_seed: int) -> None:
        self.parts = parts
        self.name = parts.name
        self.motors: dict[str, Motor] = parts.devices.motors
        self.sensors: dict[str, Sensor] = parts.devices.sensors
        self.place: Place = parts.place
        self.body: Body | None = parts.body
        self.custom_data = parts.node.text("customData") or ""
        self.seed = random_seed
        self._random = random.Random()  # noqa: S311 - noise, not secrets
        self._distance_sensors = parts.devices.of_distance()
        self._other_sensors = tuple(
            it for it in self.sensors.values() if isinstance(it, TouchSensor | PositionSensor)
        )
        self._fan = Fan(
            [it.ray for it in self._distance_sensors],
            [it.table.reach_m for it in self._distance_sensors],
        )
        self._stray_motors = tuple(
            it for it in self.motors.values() if self.body is None or not self.body.driven_by(it)
        )
        self.sow()

    def face(self, solids: Sequence[Shape], others: Sequence[Robot]) -> None:
        """Set what this robot can run into and see."""
        bodies = [it.body for it in others if it.body is not None and it.body.radius > 0.0]
        height = self.place.world_pose.position[2]
        if self.body is not None and self.body.radius > 0.0:
            in_the_way = _between(solids, self.parts.heights, height)
            self.body.face(_neighbourhood(in_the_way, self.body.radius), bodies)
        visible = _between(solids, self.parts.ray_heights, height)
        self._fan.face(_neighbourhood(visible, self._fan.reach_m), bodies)

    def advance(self, step_s: float) -> None:
        """Move on by one basic step."""
        if self.body is not None:
            self.body.advance(step_s)
        for motor in self._stray_motors:
            motor.speed_rad_s = motor.demand(step_s)
            motor.angle_rad += motor.speed_rad_s * step_s

    def sense(self) -> None:
        """Give every sensor its value of this moment."""
        gauss = self._random.gauss
        if self._distance_sensors:
            distances = self._fan.cast(self._frame())
            for sensor, distance in zip(self._distance_sensors, distances, strict=True):
                sensor.value = sensor.table.response(distance, gauss)
        for other in self._other_sensors:
            sample(other, gauss)

    def reset(self) -> None:
        """Return to the start of the world file: pose, rest, motors, noise. customData stays."""
        self.place.return_to_start()
        for motor in self.motors.values():
            motor.reset()
        self.halt()
        self.sow()

    def halt(self) -> None:
        """Take all motion away."""
        if self.body is not None:
            self.body.halt()

    def sow(self) -> None:
        """Begin the noise anew, with the seed that customData gives now."""
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
    """Return the shapes that reach into a range of heights; touching it (a floor) isn't reaching."""
    low, high = heights[0] + shift, heights[1] + shift
    found = []
    for shape in solids:
        bottom, top = shape.heights()
        if bottom < high and top > low:
            found.append(shape)
    return found


def _neighbourhood(shapes: Sequence[Shape], reach_m: float) -> Neighbourhood:
    return Neighbourhood([shape.obstacle() for shape in shapes], reach_m)
