"""Devices for sensors and actuators of a model for which Webots has no device.

The names of these devices begin with `mujoco/`; no device of Webots has such a name. A sensor publishes its
numbers unchanged. A client sets the control of an actuator directly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, Never

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, DeviceType

FOLDER: Final = "mujoco/"  # prefix of the names of these generic devices
_BODY: Final = int(mujoco.mjtTrn.mjTRN_BODY)
_TYPES: Final = {
    int(mujoco.mjtGain.mjGAIN_MUSCLE): "muscle",
    int(mujoco.mjtGain.mjGAIN_DCMOTOR): "dcmotor",
    int(mujoco.mjtGain.mjGAIN_SO3): "orientation",
    int(mujoco.mjtGain.mjGAIN_PID): "pid",
}


@dataclass(slots=True, kw_only=True, eq=False)
class MujocoSensor:
    """A sensor that measures several numbers.

    Attributes:
        name: the name of the device.
        type_name: the type of the sensor in the model, such as framelinvel.
        numbers: a view of the sensor's current numbers in MuJoCo's data.
        model: the result of the service `get_model`.
        value: the numbers of the last sample.
    """

    name: str
    type_name: str
    numbers: Any
    model: str = ""
    value: tuple[float, ...] = ()

    def sample(self) -> None:
        """Copy the current numbers to `value`."""
        self.value = tuple(self.numbers.tolist())


@dataclass(slots=True, kw_only=True, eq=False)
class MujocoActuator:
    """A control of an actuator that is not a motor, such as a muscle, an adhesion or an orientation servo.

    Attributes:
        name: the name of the device.
        controls: the controls of all actuators in MuJoCo's data.
        number: the index of this control.
        low, high: the minimum and the maximum control; infinite if the model has no limits.
        model: the result of the service `get_model`.
    """

    name: str
    controls: Any
    number: int
    low: float = -math.inf
    high: float = math.inf
    model: str = ""
    _wanted: float | None = field(default=None, init=False)

    @property
    def control(self) -> float:
        """The control: the last value that a client has set, or the value in MuJoCo's data."""
        return float(self.controls[self.number]) if self._wanted is None else self._wanted

    def set_control(self, value: float) -> bool:
        """Set the control for the following basic steps; a value outside the limits is cut to the limit.

        Return False, and change nothing, if `value` is not finite.
        """
        if not math.isfinite(value):
            return False
        self._wanted = max(self.low, min(self.high, value))
        return True

    def command(self) -> None:
        """Write the control that a client has set to MuJoCo's data."""
        if self._wanted is not None:
            self.controls[self.number] = self._wanted

    def reset(self) -> None:
        """Discard the control that a client has set."""
        self._wanted = None


def actuator_of(model: Any, data: Any, number: int, name: str) -> MujocoActuator:
    """Return the device for control `number`, of an actuator that is not a motor."""
    low, high = -math.inf, math.inf
    if model.actuator_ctrllimited[number]:
        low, high = model.actuator_ctrlrange[number].tolist()
    return MujocoActuator(name=name, controls=data.ctrl, number=number, low=low, high=high)


def type_name_of(model: Any, number: int) -> str:
    """Return the type of a sensor as in the XML of the model, such as framelinvel."""
    name: str = mujoco.mjtSensor(int(model.sensor_type[number])).name
    return name.removeprefix("mjSENS_").lower()


def actuator_type_of(model: Any, number: int) -> str:
    """Return the type of an actuator that is not a motor, as in the XML of the model, such as muscle."""
    if model.actuator_trntype[number] == _BODY:
        return "adhesion"
    return _TYPES.get(int(model.actuator_gaintype[number]), "general")


def input_names_of(model: Any, number: int) -> list[str]:
    """Return a name for each control of an actuator; one empty name if the actuator has a single control."""
    count = int(model.actuator_ctrlnum[number])
    if count == 1:
        return [""]
    return [mujoco.mj_actuatorInputName(model, number, place) or str(place) for place in range(count)]


def _topics(sensor: MujocoSensor) -> tuple[DeviceTopic, ...]:
    count = len(sensor.numbers)
    layout = {"dim": [{"label": sensor.type_name, "size": count, "stride": count}]}
    topic = DeviceTopic(
        name="value",
        type_name="std_msgs/Float64MultiArray",
        source=sensor,
        constants={"layout": layout},
        reading="data",
        stamped=False,
    )
    return (topic,)


def _services(actuator: MujocoActuator) -> tuple[Row, ...]:
    def set_control(request: Any) -> Fields:
        return {"success": actuator.set_control(request.value)}

    return (
        ("set_control", "set_float", set_control),
        ("get_control", "get_float", lambda _: {"value": actuator.control}),
        ("get_min_control", "get_float", lambda _: {"value": actuator.low}),
        ("get_max_control", "get_float", lambda _: {"value": actuator.high}),
    )


def _in_no_world(part: DevicePart) -> Never:
    raise TypeError(f"a world file of Webots cannot have a {part.node.type_name}")


MUJOCO_SENSOR: Final = DeviceType(
    node="MujocoSensor",
    name="sensor",
    fields="",
    read=_in_no_world,
    topics=_topics,
)
MUJOCO_ACTUATOR: Final = DeviceType(
    node="MujocoActuator",
    name="actuator",
    fields="",
    read=_in_no_world,
    services=_services,
)
