"""Make devices with names from all actuators, sensors and cameras of a model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf import generic_devices, motors
from palaestra_sim.mujoco.mjcf.generic_devices import MujocoActuator
from palaestra_sim.mujoco.mjcf.model import HINGE, SLIDE, Model
from palaestra_sim.mujoco.mjcf.motors import ActuatorMotor, ModelActuator
from palaestra_sim.mujoco.mjcf.sensors import ModelSensor, camera, in_webots, measured
from palaestra_sim.ros_interfaces import as_ros_name
from palaestra_sim.scene.devices.device_type import Devices, DeviceType, Sample, Shaft
from palaestra_sim.scene.devices.motors import LINEAR_MOTOR, ROTATIONAL_MOTOR
from palaestra_sim.scene.joints import Joint
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.world.mjcf import LEFT_OUT, Description

_ACTUATOR: Final = "actuator"
_CAMERA: Final = "camera"
_SENSOR: Final = "sensor"


@dataclass(slots=True, kw_only=True)
class Equipment:
    """The devices of a robot.

    Attributes:
        devices: all devices, by the name of the device.
        joints: for each device on a joint, the id of that joint, by the name of the device.
        numbers: the place in `ctrl` of each actuator's control, and the number in the model of each sensor,
            by the name of the device.
        motors: the actuators that are motors.
        actuators: the actuators that are not motors.
        samples: functions that set the values of the sensors.
        refused: an error for each mistake with a device.
        left_out: an error for each sensor or actuator that the user left out, because Webots has no such
            device.
    """

    devices: Devices = field(default_factory=Devices)
    joints: dict[str, int] = field(default_factory=dict)
    numbers: dict[str, int] = field(default_factory=dict)
    motors: list[ActuatorMotor] = field(default_factory=list)
    actuators: list[MujocoActuator] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)
    refused: list[WorldError] = field(default_factory=list)
    left_out: list[WorldError] = field(default_factory=list)


def equip(model: Model, description: Description, leave_out: LeaveOut) -> Equipment:
    """Return the devices of a model, with the names that the description gives them."""
    return _Fitter(model, description, leave_out).fit()


def body_of(model: Any) -> int | None:
    """Return the number of the robot's body.

    The first actuator with a joint or a site decides: the robot is the top-level body that contains this
    joint or site. If actuators move only tendons, the robot is the first body. Return None if the model has
    no body.
    """
    for index in range(model.nactuator):
        target, other = model.actuator_trnid[index].tolist()
        transmission = model.actuator_trntype[index]
        spherical = transmission == mujoco.mjtTrn.mjTRN_SO3  # turns a ball joint, or a site against another
        if transmission in motors.JOINTS or (spherical and other < 0):
            return int(model.body_rootid[model.jnt_bodyid[target]])
        if spherical or transmission == mujoco.mjtTrn.mjTRN_SITE:
            return int(model.body_rootid[model.site_bodyid[target]])
    return 1 if model.nbody > 1 else None


class _Fitter:
    def __init__(self, model: Model, description: Description, leave_out: LeaveOut) -> None:
        self._model = model
        self._description = description
        self._leave_out = leave_out
        self._names = dict(description.devices)
        self._known: set[str] = set()
        self._shafts: dict[int, Shaft] = {}
        self._defaults = _actuator_names(model.model)
        self._sensor_names = _sensor_names(model.model)
        self._found = Equipment()

    def fit(self) -> Equipment:
        """Return the devices."""
        model = self._model.model
        self._model.settle()  # computes the lengths of tendons, because motors read these lengths
        for index in range(model.nactuator):
            self._add_actuator(index)
        for index in range(model.nsensor):
            self._add_sensor(index)
        for index in range(model.ncam):
            default = model.camera(index).name or f"camera{index}"
            name = self._name(_CAMERA, default, f"{default}_camera")
            if name is not None:
                found = camera(self._model, index, name)
                self._add(_CAMERA, found.kind, found.device, None)
        self._found.refused += self._unknown()
        return self._found

    def _add_actuator(self, index: int) -> None:
        model = self._model.model
        joint = motors.joint_of(model, index)
        default = self._defaults[index]
        control = motors.control_of(model, index)
        if control is None:
            self._add_own_actuator(index)
            return
        name = self._name(_ACTUATOR, default, f"{default}_actuator")
        if name is None:
            return
        address = motors.control_address(model, index)
        actuator = ModelActuator(
            control=control[0],
            scale=control[1],
            length=motors.length_of(self._model, index),
            read=self._reader(address),
            write=self._writer(address),
            force=motors.force_of(self._model, index),
        )
        motor = ActuatorMotor(motors.spec_of(model, index, name, *control), actuator)
        turns = joint is not None and model.jnt_type[joint] == HINGE
        if self._add(_ACTUATOR, ROTATIONAL_MOTOR if turns else LINEAR_MOTOR, motor, joint):
            self._found.motors.append(motor)
            self._found.numbers[name] = address

    def _add_own_actuator(self, index: int) -> None:
        """Add a device for each control of an actuator that is not a motor."""
        model = self._model.model
        type_name = generic_devices.actuator_type_of(model, index)
        address = motors.control_address(model, index)
        for place, input_name in enumerate(generic_devices.input_names_of(model, index)):
            default = "_".join(filter(None, (self._defaults[index], input_name)))
            name = self._name(_ACTUATOR, default, f"{default}_actuator", generic_devices.FOLDER)
            if name is None or self._is_left_out(_ACTUATOR, model.actuator(index).name, name, type_name):
                continue
            number = address + place
            actuator = generic_devices.actuator_of(model, self._model.data, number, name)
            if self._add(_ACTUATOR, generic_devices.MUJOCO_ACTUATOR, actuator, None):
                self._found.actuators.append(actuator)
                self._found.numbers[name] = number

    def _add_sensor(self, index: int) -> None:
        model = self._model.model
        type_name = generic_devices.type_name_of(model, index)
        what, which = int(model.sensor_objtype[index]), int(model.sensor_objid[index])
        given = model.sensor(index).name
        folder = "" if in_webots(model, index) else generic_devices.FOLDER
        other = f"{given}_{type_name}" if given else f"{self._sensor_names[index]}_sensor"
        name = self._name(_SENSOR, self._sensor_names[index], other, folder)
        if name is None or (folder and self._is_left_out(_SENSOR, given, name, type_name)):
            return
        start = int(model.sensor_adr[index])
        joint = which if what == mujoco.mjtObj.mjOBJ_JOINT and self._is_simple(which) else None
        found = measured(
            ModelSensor(
                model=self._model,
                number=index,
                name=name,
                numbers=self._model.data.sensordata[start : start + int(model.sensor_dim[index])],
                shaft=Shaft() if joint is None else self._shaft(joint),
            )
        )
        if self._add(_SENSOR, found.kind, found.device, None if folder else joint):
            self._found.samples.append(found.sample)
            self._found.numbers[name] = index

    def _add(self, section: str, kind: DeviceType[Any], device: Any, joint: int | None) -> bool:
        name: str = device.name
        devices = self._found.devices
        if trouble := devices.trouble_with(name):
            key = f"device:{section}/{name.removeprefix(generic_devices.FOLDER)}"
            remedy = f'rename one: <text name="{key}" data="..."/> in <custom>'
            error = self._description.error(section, name, trouble, remedy)
            self._found.refused.append(error)
            return False
        devices.add(name, kind, device)
        if joint is not None:
            shaft = devices.shafts[name] = self._shaft(joint)
            shaft.names.setdefault(kind.role, name)
            if isinstance(device, ActuatorMotor) and shaft.motor is None:
                shaft.motor = device
            self._found.joints[name] = joint
        return True

    def _name(self, section: str, default: str, other: str, folder: str = "") -> str | None:
        """Return the name of a device, with the prefix `folder`; None if the user left the device out.

        MuJoCo allows all characters in names; characters that ROS does not allow are replaced. In a model, a
        sensor and a camera, for example, may have the same name. If a device of another `section` already has
        the name, this device gets the name `other`.
        """
        key = f"{section}/{default}"
        self._known.add(key)
        plain = as_ros_name(default)
        if key not in self._names and f"{folder}{plain}" in self._found.devices.rows:
            return f"{folder}{as_ros_name(other)}"
        name = self._names.get(key, plain)
        return None if name == LEFT_OUT else f"{folder}{name}"

    def _is_left_out(self, section: str, given: str, name: str, type_name: str) -> bool:
        """Return whether the user leaves out devices of this type; if so, record the device in `left_out`."""
        if type_name not in self._leave_out.types:
            return False
        fact = f"the {section} {name!r} of type {type_name} has no device in Webots"
        self._found.left_out.append(self._description.error(section, given, fact, "left out"))
        return True

    def _unknown(self) -> Iterator[WorldError]:
        """Yield an error for each device in `<custom>` that the model does not have."""
        for key in self._names:
            if key not in self._known:
                section = key.partition("/")[0] + "/"
                known = ", ".join(sorted(it for it in self._known if it.startswith(section))) or "none"
                fact = f"the model has no {key}"
                yield self._description.error("custom", f"device:{key}", fact, f"write one of: {known}")

    def _is_simple(self, joint: int) -> bool:
        return joint >= 0 and int(self._model.model.jnt_type[joint]) in {HINGE, SLIDE}

    def _shaft(self, joint: int) -> Shaft:
        slides = self._model.model.jnt_type[joint] == SLIDE
        axis = (1.0, 0.0, 0.0)  # an arbitrary axis: only MuJoCo computes the motion of the joint
        return self._shafts.setdefault(joint, Shaft(joint=Joint(axis=axis, slides=bool(slides))))

    def _reader(self, address: int) -> Callable[[], float]:
        controls = self._model.data.ctrl
        return lambda: float(controls[address])

    def _writer(self, address: int) -> Callable[[float], None]:
        controls = self._model.data.ctrl

        def write(value: float) -> None:
            controls[address] = value

        return write


def _actuator_names(model: Any) -> list[str]:
    """Return a name for each actuator: its own name, the name of its joint, or "actuator" and its number.

    Several actuators of one joint may lack names; for example, a position servo and a velocity servo. Their
    names then end with their kinds, or with their numbers if the kinds are equal.
    """
    joints = [motors.joint_of(model, index) for index in range(model.nactuator)]
    plain = [
        model.actuator(index).name or ("" if joint is None else model.jnt(joint).name) or f"actuator{index}"
        for index, joint in enumerate(joints)
    ]
    of_plain = Counter(plain)
    unclear = [of_plain[name] > 1 and not model.actuator(index).name for index, name in enumerate(plain)]
    kinds = [
        f"{name}_{motors.kind_of(model, index)}" if unclear[index] else name
        for index, name in enumerate(plain)
    ]
    return _numbered(kinds)


def _sensor_names(model: Any) -> list[str]:
    """Return a name for each sensor: its own name, or the name of the measured object with the sensor's type.

    If the object has no name either, the sensor's number replaces it. If several sensors would get the same
    name, their names end with their numbers.
    """
    given = [model.sensor(index).name for index in range(model.nsensor)]
    objects = [
        mujoco.mj_id2name(model, int(model.sensor_objtype[index]), int(model.sensor_objid[index]))
        if model.sensor_objid[index] >= 0
        else None
        for index in range(model.nsensor)
    ]
    return _numbered(
        [
            name or f"{objects[index] or index}_{generic_devices.type_name_of(model, index)}"
            for index, name in enumerate(given)
        ]
    )


def _numbered(names: Sequence[str]) -> list[str]:
    """Return `names`; a name that occurs several times gets its index in the list as a suffix."""
    counts = Counter(names)
    return [f"{name}{index}" if counts[name] > 1 else name for index, name in enumerate(names)]
