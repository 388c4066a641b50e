"""The devices of a robot: sensors that publish, motors that obey."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from palaestra_trainer.errors import SimulatorHung, WrongData
from palaestra_trainer.ros import RosService, RosSubscriber, call_together
from palaestra_trainer.turns import let_others
from palaestra_trainer.webots.readings import BOOL, FLOAT64, RANGE, Reading
from palaestra_trainer.webots.services import Services

# Webots replaces these in names of devices, and nothing else.
_REPLACED = str.maketrans("-. ()", "_____")


def topic_name(device: str) -> str:
    """Return the device's name as it stands in paths, e.g. touch_sensor for "touch sensor"."""
    return device.translate(_REPLACED)


class Sensor:
    """A sensor: enabled with a period, then read once a step.

    Args:
        robot: the ROS name of the robot's controller.
        device: the device's name in the world, e.g. ir1
        type_name: the type of its topic.
        decode: reads the value out of a message's bytes.

    Attributes:
        robot: see above.
        device: see above.
        late: whether what arrives until the next step may belong to the one before.
    """

    __slots__ = ("_enable", "_value", "_values", "device", "late", "robot")

    def __init__(
        self,
        robot: str,
        device: str,
        type_name: str,
        decode: Callable[[bytes | memoryview], Any] | None = None,
    ) -> None:
        self.robot = robot
        self.device = device
        path = f"/{robot}/{topic_name(device)}"
        self._enable = RosService(f"{path}/enable", "webots_ros/set_int")
        self._values = RosSubscriber(f"{path}/value", type_name, decode)
        self._value: Any = None
        self.late = False

    @property
    def value(self) -> Any:
        """The last reading; None before the first step."""
        return self._value

    def enable(self, period_ms: int) -> None:
        """Let the sensor publish every `period_ms` of simulated time, and subscribe.

        Raises:
            WrongData: the period is not a multiple of the step.
            SimulatorDead, SimulatorHung: as `RosService`.
        """
        if not self._enable(value=period_ms).success:
            raise WrongData(
                self._enable.simulator,
                f"{self.device} refuses a period of {period_ms} ms; use a multiple of the step",
            )
        self._values.connect()
        self.late = False

    def read(self) -> bool:
        """Take the next message; False when it did not come in time, the value stays then.

        Raises:
            SimulatorDead, WrongData: as `RosSubscriber`.
        """
        try:
            self._value = self._values.next()
        except SimulatorHung:
            self.late = True
            return False
        return True

    def read_arrived(self) -> bool:
        """Take the last message that has arrived already; False when there is none.

        Raises:
            SimulatorDead, WrongData: as `RosSubscriber`.
        """
        value = self._values.newest(None)
        self.late = value is None
        if value is not None:
            self._value = value
        return not self.late

    def disable(self) -> None:
        """Stop the sensor and unsubscribe.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`; it stays subscribed then.
        """
        self._enable(value=0)
        self.close()

    def close(self) -> None:
        """Drop the connections."""
        self._enable.close()
        self._values.close()


class DistanceSensor(Sensor):
    """A distance sensor; `value` is what its lookup table gives, volts for a Robotino."""

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Range", Reading(device, RANGE))


class TouchSensor(Sensor):
    """A bumper; `value` is True while something touches it."""

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/BoolStamped", Reading(device, BOOL))


class PositionSensor(Sensor):
    """The position of a joint; `value` in radians or metres."""

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/Float64Stamped", Reading(device, FLOAT64))


class Motor:
    """A motor under velocity control.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world, e.g. wheel0_joint

    Attributes:
        robot: see above.
        device: see above.
        velocity: rad/s, as the simulator has confirmed it; None while it is not known what it made of it.
        velocity_service: sets it.
    """

    __slots__ = ("_position", "_services", "device", "robot", "velocity", "velocity_service")

    def __init__(self, robot: str, device: str) -> None:
        services = Services(robot)
        name = topic_name(device)
        self.robot = robot
        self.device = device
        self._services = services
        self._position = services.get(f"{name}/set_position", "set_float")
        self.velocity: float | None = None
        self.velocity_service = services.get(f"{name}/set_velocity", "set_float")

    def set_velocity(self, velocity: float) -> None:
        """Turn at `velocity` rad/s from the next step on.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`; it will be sent again.
        """
        self.velocity = None
        self.velocity_service(value=velocity)
        self.velocity = velocity

    def set_position(self, position: float) -> None:
        """Turn to `position` rad; infinity means velocity control.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self.velocity = None  # a backward one, set before, was confirmed and yet refused
        self._position(value=position)

    def release(self) -> None:
        """Stand still under velocity control, as needed at the start and after every reset.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self.set_position(math.inf)
        self.set_velocity(0.0)

    def close(self) -> None:
        """Drop the connections."""
        self.velocity = None
        self._services.close()


def set_velocities(wanted: Iterable[tuple[Motor, float]]) -> None:
    """Let motors turn at velocities in rad/s from the next step on, with all requests sent at once.

    A motor goes on as it was told, so that what it has confirmed is not sent again; whoever resets the
    simulation must `release` its motors.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: as `RosService`; whatever was sent will be sent again.
    """
    changes = [(motor, velocity) for motor, velocity in wanted if velocity != motor.velocity]
    if not changes:
        return
    for motor, _ in changes:
        motor.velocity = None
    call_together(
        [(motor.velocity_service, {"value": velocity}) for motor, velocity in changes], meanwhile=let_others
    )
    for motor, velocity in changes:
        motor.velocity = velocity
