"""The simulated Robotino: devices of Webots behind `RobotinoAbc`, and the scene around it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoReading, NoSuchSensor, WorldMisfit
from palaestra_trainer.robots.base import SENSOR_RANGE_M, SENSORS, Pose, RobotinoAbc
from palaestra_trainer.webots import (
    Camera,
    DistanceSensor,
    Motor,
    RangeFinder,
    Sensor,
    Simulation,
    TouchSensor,
    Webots,
    require_node,
    set_velocities,
)

PERIOD_MS = 192  # six basic steps of 32 ms

# Source: projects/robots/festo/robotino3 of Webots R2023b.
_WHEEL_RADIUS_M = 0.063
_WHEEL_DISTANCE_M = 0.1826
_SIN_60 = math.sqrt(0.75)

# Meters from volts for the GP2Y0A41, the default sensor of the model: a * V**b + c.
# Source: the sample controller of that model, R2023b.
_RANGE_SCALE, _RANGE_EXPONENT, _RANGE_OFFSET_M = 0.1594, -0.8533, -0.02916
_LEAST_VOLTS = 0.05  # below the sensor's range; keeps the power finite


class Robotino(RobotinoAbc):
    """A Robotino in Webots, or in any simulator that speaks its interface.

    Args:
        webots: the simulator. Each of its starts connects this robot, the newest of its name; if it runs
            already, `connect` must be called.
        node_name: the ROS name that the world gives the robot; by default the robot is its own supervisor.
        definition: the DEF name of the robot in the world.
        period_ms: simulated milliseconds in one `advance`.
        robots: the ROS names of all robots in the world; they step together. By default robot and supervisor.

    Attributes:
        node_name: the ROS name of the robot's controller, as it runs; for sensors and motors of your own.
    """

    def __init__(
        self,
        webots: Webots,
        node_name: str | None = None,
        definition: str = "ROBOTINO",
        period_ms: int = PERIOD_MS,
        robots: Iterable[str] = (),
    ) -> None:
        name = webots.name_of(node_name) if node_name else webots.robot_name
        self.node_name = name
        self.definition = definition
        self._observer = webots.observer
        self._wheels = tuple(Motor(name, f"wheel{number}_joint") for number in range(3))
        self._infrared = tuple(DistanceSensor(name, f"ir{number + 1}") for number in range(SENSORS))
        self._bumper = TouchSensor(name, "touch sensor")
        self._camera = Camera(name, "camera")
        self._depth_camera = RangeFinder(name, "depth camera")
        self._cameras: set[Sensor] = set()  # those in use
        others = map(webots.name_of, robots)
        together = dict.fromkeys((name, webots.robot_name, *others))
        self.simulation = Simulation(tuple(together), webots.supervisor, webots.observer, period_ms)
        self.simulation.track(definition)
        self.simulation.add((*self._infrared, self._bumper), self._wheels)
        webots.at_start(name, self.connect)

    @property
    def period_s(self) -> float:
        """Seconds of simulated time in one `advance`."""
        return self.simulation.period_ms / 1000.0

    def connect(self) -> None:
        """Enable the sensors and take hold of the wheels; each start of the simulator does it by itself.

        To be called when it runs already as the robot is made, and after its world was loaded anew.

        Raises:
            WorldMisfit: the world lacks the robot's node, or the robot a device of a Robotino.
            SimulatorDead, SimulatorHung, WrongData
        """
        self.close()  # connections to the simulator before this one
        self._observer.forget_handles()
        self.simulation.connect()

    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, shape (9,), forward first, counter-clockwise."""
        volts = [sensor.value for sensor in self._infrared]
        if None in volts:
            raise self._no_reading()
        return np.array([meters(volt) for volt in volts], dtype=np.float32)

    def bumped(self) -> bool:
        """Return whether the bumper touches something."""
        if self._bumper.value is None:
            raise self._no_reading()
        return bool(self._bumper.value)

    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Enable the Camera `camera`, the RangeFinder `depth camera`, or both; they stay enabled.

        Raises:
            NoSuchSensor: the robot is connected and lacks one of them, or the simulator renders no images.
            SimulatorDead, SimulatorHung, WrongData
        """
        for wanted, camera in ((color, self._camera), (depth, self._depth_camera)):
            if wanted:
                try:
                    self.simulation.use(camera)
                except WorldMisfit as misfit:
                    raise NoSuchSensor(str(misfit)) from misfit
                self._cameras.add(camera)

    def color_image(self) -> NDArray[np.uint8]:
        """Return what the camera sees, shape (height, width, 3), RGB; a view until the next step."""
        self._require_use(self._camera, "color")
        return self._camera.rgb

    def depth_image(self) -> NDArray[np.float32]:
        """Return meters for each pixel, shape (height, width); a view until the next step."""
        self._require_use(self._depth_camera, "depth")
        return self._depth_camera.depths

    def pose(self) -> Pose:
        """Return the true pose after the last step."""
        return Pose(*self.simulation.pose(self.definition))

    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the wanted velocity: forward, left (m/s) and counter-clockwise (rad/s), until changed."""
        set_velocities(zip(self._wheels, wheel_speeds(vx, vy, omega), strict=True))

    def advance(self) -> int:
        """Simulate one control period; return how many extra ones it took, normally 0.

        Raises:
            Paused: time stands; nothing was sent.
            SimulatorDead, SimulatorHung, WrongData: as `Simulation.step`.
        """
        return self.simulation.step()

    def close(self) -> None:
        """Drop all connections."""
        self.simulation.close()

    def _require_use(self, camera: Sensor, name: str) -> None:
        if camera not in self._cameras:
            raise NoSuchSensor(
                f"{self.definition}: its {name} camera is not in use; call use_cameras({name}=True), "
                "then advance()"
            )

    def _no_reading(self) -> NoReading:
        return NoReading(
            f"{self.definition}: its sensors have sent nothing yet; let a period pass by advance()"
        )


class RobotinoScene:
    """The scene around a simulated Robotino. Each start of the simulator looks for the mark.

    Args:
        webots: the simulator.
        robot: the robot that is placed.
        target: the DEF name of the mark on the floor.

    Attributes:
        supervisor: changes what else there is in the world, such as fields of nodes.
        observer: answers what the world is like.
        resets: since the simulator was last started.
    """

    def __init__(self, webots: Webots, robot: Robotino, target: str = "TARGET") -> None:
        self.supervisor = webots.supervisor
        self.observer = webots.observer
        self._robot = robot
        self._target = target
        self.resets = 0
        webots.at_start(f"mark {target}", lambda: require_node(webots.observer, target))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself: a copy would arrange the same simulation.

        gymnasium copies the arguments of an environment.
        """
        del memo
        return self

    def reset(self, seed: int, start: Pose, target: tuple[float, float]) -> None:
        """Begin anew: robot at rest at `start`, mark at `target` (x, y in meters), fresh readings.

        All chance until the next reset follows from `seed`, in [0, 2**31).

        Raises:
            Paused: time stands; nothing was changed.
            SimulatorDead, SimulatorHung
            WrongData: also when the world lacks the robot's node or the mark's.
        """
        self.resets += 1
        self._robot.simulation.reset(seed)
        self.supervisor.place(self._robot.definition, start.x_m, start.y_m, start.heading_rad)
        self.supervisor.place(self._target, *target)
        self.supervisor.stop_inertia(self._robot.definition)
        self._robot.advance()

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Put the node with DEF `name` to x, y, z (meters) with the next step; a reset undoes it.

        Raises:
            SimulatorDead, SimulatorHung
            WrongData: the world lacks the node, or the simulator refuses to move it.
        """
        self.supervisor.set_field(name, "translation", place)


def wheel_speeds(vx: float, vy: float, omega: float) -> Sequence[float]:
    """Return the speeds in rad/s of rear, front-right and front-left wheel for a twist in m/s and rad/s."""
    turn = omega * _WHEEL_DISTANCE_M
    return (
        (vy - turn) / _WHEEL_RADIUS_M,
        (-_SIN_60 * vx - 0.5 * vy - turn) / _WHEEL_RADIUS_M,
        (_SIN_60 * vx - 0.5 * vy - turn) / _WHEEL_RADIUS_M,
    )


def meters(volts: float) -> float:
    """Return the distance in meters, within the sensor's range, for a reading in volts."""
    distance: float = _RANGE_SCALE * max(volts, _LEAST_VOLTS) ** _RANGE_EXPONENT + _RANGE_OFFSET_M
    return min(max(distance, SENSOR_RANGE_M[0]), SENSOR_RANGE_M[1])
