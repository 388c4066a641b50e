"""The devices of a robot: sensors, which publish their readings, and motors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, Final

from palaestra_trainer.errors import SimulatorHung, WrongData
from palaestra_trainer.ros import RosService, RosSubscriber, call_together
from palaestra_trainer.ros.service import DEADLINE_S
from palaestra_trainer.waiting.greenlets import let_others
from palaestra_trainer.webots.device import (
    Device,
    JointDevice,
    NodeDevice,
    lookup_table_fact,
    named,
    number_fact,
    text_fact,
)
from palaestra_trainer.webots.message_decoding import FLOAT64, RANGE, NumberReading
from palaestra_trainer.webots.motor_device import MotorDevice

# By number. Source: webots/distance_sensor.h
_TYPES: Final = ("generic", "infra-red", "sonar", "laser")


class Sensor(Device):
    """A sensor that is enabled with a period, and then read once in each step.

    Args:
        robot: the ROS name of the robot's controller.
        device: the device's name in the world, e.g. ir1
        type_name: the type of the sensor's topic.
        decode: a function that returns the value in the bytes of a message.
        topic: the name of the sensor's topic, below the name of the device.
        enabled_by: the name of the service that enables the sensor, below the name of the device.

    Attributes:
        robot: see above.
        device: see above.
        late: whether the next message to arrive may belong to the previous step.
        listed: whether the robot's list of devices has the sensor; keyboard and joystick are not in it.
        enable_deadline_s: the longest time that the simulator may take to enable the sensor.
    """

    __slots__ = ("_enable", "_period", "_value", "_values", "late")
    listed: ClassVar[bool] = True
    enable_deadline_s: ClassVar[float] = DEADLINE_S

    def __init__(
        self,
        robot: str,
        device: str,
        type_name: str,
        decode: Callable[[bytes | memoryview], Any] | None = None,
        topic: str = "value",
        enabled_by: str = "enable",
    ) -> None:
        super().__init__(robot, device)
        path = f"/{robot}/{self._path}"
        self._enable = RosService(f"{path}/{enabled_by}", "webots_ros/set_int", self.enable_deadline_s)
        self._period = f"{enabled_by.removesuffix('enable')}get_sampling_period"
        self._values = RosSubscriber(f"{path}/{topic}", type_name, decode)
        self._value: Any = None
        self.late = False

    @property
    def value(self) -> Any:
        """The last reading; None before the first step."""
        return self._value

    @property
    def sampling_period_ms(self) -> int:
        """The period with which the simulator samples the sensor, in ms of simulated time; 0: not at all.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        return int(self.call(self._period, "get_int", ask=True).value)

    def enable(self, period_ms: int) -> None:
        """Make the sensor publish every `period_ms` of simulated time, and subscribe to its topic.

        Raises:
            WrongData: the period is not a multiple of the step.
            SimulatorDead, SimulatorHung: as `RosService`.
        """
        if not self._enable(value=period_ms).success:
            raise self._refused(period_ms)
        self._values.connect()
        self.late = False

    def _refused(self, period_ms: int) -> WrongData:
        """Return the error for a period that the simulator refused."""
        return WrongData(
            self._enable.simulator,
            f"{self.device} refuses a period of {period_ms} ms; use a multiple of the world's basicTimeStep",
        )

    def read(self) -> bool:
        """Read the next message; if no message arrives in time, keep the old value and return False.

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
        """Read the last message that has already arrived; return False without such a message.

        Raises:
            SimulatorDead, WrongData: as `RosSubscriber`.
        """
        value = self._values.newest(None)
        self.late = value is None
        if value is not None:
            self._value = value
        return not self.late

    def disable(self) -> None:
        """Disable the sensor and unsubscribe; this ends other sensors of the same device too.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`; the subscription then stays.
        """
        self._enable(value=0)
        self.close()

    def close(self) -> None:
        """Close the connections."""
        super().close()
        self._enable.close()
        self._values.close()


class NodeSensor(Sensor, NodeDevice):
    """A sensor that is a node of the world."""

    __slots__ = ()


class DistanceSensor(NodeSensor):
    """A distance sensor; `value` is the output of its lookup table, which is volts for a Robotino."""

    __slots__ = ()
    lookup_table = lookup_table_fact()
    min_value = number_fact("get_min_value", "The least output of the lookup table.")
    max_value = number_fact("get_max_value", "The greatest output of the lookup table.")
    aperture_rad = number_fact("get_aperture", "The opening angle of the cone of rays, in rad.")
    nodes = ("DistanceSensor",)
    sensor_type = named(
        "get_type", _TYPES, 'The type of the sensor: "generic", "infra-red", "sonar" or "laser".'
    )

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Range", NumberReading(device, RANGE))


class PositionSensor(NodeSensor, JointDevice):
    """A sensor for the position of a joint; `value` is in radians or meters."""

    __slots__ = ()
    nodes = ("PositionSensor",)
    motor_name = text_fact("get_motor_name", 'The name of the motor on the same joint; "" without a motor.')
    brake_name = text_fact("get_brake_name", 'The name of the brake on the same joint; "" without a brake.')

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/Float64Stamped", NumberReading(device, FLOAT64))


class Motor(MotorDevice):
    """A motor under velocity control, such as that of a wheel.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world, e.g. wheel0_joint

    Attributes:
        robot: see above.
        device: see above.
        velocity: the last velocity in rad/s that the simulator confirmed; None before it confirms a command.
        velocity_service: the service that sets the velocity.
    """

    __slots__ = ("_position", "velocity", "velocity_service")

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device)
        self._position = self._services.get(f"{self._path}/set_position", "set_float")
        self.velocity: float | None = None
        self.velocity_service = self._services.get(f"{self._path}/set_velocity", "set_float")

    def set_velocity(self, velocity: float) -> None:
        """Turn at `velocity` rad/s from the next step on.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`; the next call sends the velocity again.
        """
        self.velocity = None
        self.velocity_service(value=velocity)
        self.velocity = velocity

    def set_position(self, position: float) -> None:
        """Turn to `position` rad; infinity switches to velocity control.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        # Under position control, the simulator confirms a negative velocity, but does not apply it.
        self.velocity = None
        self._position(value=position)

    def release(self) -> None:
        """Switch to velocity control and stop; this is needed at the start and after every reset.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self.set_position(math.inf)
        self.set_velocity(0.0)

    def close(self) -> None:
        """Close the connections."""
        self.velocity = None
        super().close()


def set_velocities(wanted: Iterable[tuple[Motor, float]]) -> None:
    """Set velocities of motors in rad/s from the next step on; send all requests together.

    A velocity that the simulator has confirmed for a motor is not sent again. So call `release` of the motors
    after a reset of the simulation.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: as `RosService`; the next call sends the velocities again.
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
