"""Sensors and cameras of a model as devices of Webots.

A sensor that measures one number becomes a PositionSensor; exceptions are distance and touch sensors. A
sensor that measures several numbers becomes the matching device of Webots, such as a Gyro. If Webots has no
such device, the sensor becomes a `MujocoSensor` of `generic_devices`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.camera import ModelCamera
from palaestra_sim.mujoco.mjcf.generic_devices import MUJOCO_SENSOR, MujocoSensor, type_name_of
from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.devices.accelerometer import ACCELEROMETER, Accelerometer
from palaestra_sim.scene.devices.camera import CAMERA, Camera
from palaestra_sim.scene.devices.device_type import Carrier, DeviceT, DeviceType, Sample, Shaft
from palaestra_sim.scene.devices.distance_sensor import DISTANCE_SENSOR, DistanceSensor, DistanceSensorType
from palaestra_sim.scene.devices.gps import GPS, Gps
from palaestra_sim.scene.devices.gyro import GYRO, Gyro
from palaestra_sim.scene.devices.inertial_unit import INERTIAL_UNIT, InertialUnit
from palaestra_sim.scene.devices.position_sensor import POSITION_SENSOR, PositionSensor
from palaestra_sim.scene.devices.sensor_response import Axes
from palaestra_sim.scene.devices.touch_sensor import TOUCH_SENSOR, TouchSensor
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.lookup_table import LookupTable

_NOWHERE: Final = Frame(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))  # this frame is never read
_PLAIN: Final = Axes(table=None, on=(True, True, True), resolution=-1.0)
_FORCE: Final = 1  # the value that `get_type` of a touch sensor returns
_PIXELS: Final = (64, 64)  # Webots' default, for a camera without a resolution


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A device, its device type, and the function that sets its value."""

    kind: DeviceType[Any]
    device: Any
    sample: Sample


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelSensor:
    """A sensor of the model.

    Attributes:
        model: the whole model.
        number: the id of the sensor in the model.
        name: the name of the device.
        numbers: a view of the sensor's current numbers in MuJoCo's data.
        shaft: the joint that the sensor measures; a new joint, which is not used, if the sensor measures no
            joint.
    """

    model: Model
    number: int
    name: str
    numbers: Any
    shaft: Shaft


def in_webots(model: Any, number: int) -> bool:
    """Return whether Webots has a device for a sensor of the model."""
    return _maker(model, number) is not None


def measured(sensor: ModelSensor) -> Measured:
    """Return the device of a sensor: a device of Webots, or a device that publishes the numbers unchanged."""
    make = _maker(sensor.model.model, sensor.number) or _numbers
    return make(sensor)


def camera(parent: Model, number: int, name: str) -> Measured:
    """Return the device of a camera; MuJoCo renders its images."""
    model = parent.model
    width, height = model.cam_resolution[number].tolist()
    size = (width, height) if width > 1 and height > 1 else _PIXELS
    upward = math.radians(float(model.cam_fovy[number]))
    extent_m = float(model.stat.extent)
    lens = Lens(
        size=size,
        field_of_view_rad=2.0 * math.atan(math.tan(upward / 2.0) * size[0] / size[1]),
        near_m=float(model.vis.map.znear) * extent_m,
        far_m=float(model.vis.map.zfar) * extent_m,
    )
    camera = ModelCamera(parent, number, lens)
    device = Camera(name=name, model="", place=_NOWHERE, lens=lens, spherical=False, exposure=1.0, eye=camera)
    return Measured(kind=_CAMERA, device=device, sample=lambda: None)


def _by_model(_devices: Sequence[Any], _robot: Carrier) -> Sample:
    """Return a function that does nothing: `MjcfSimulation` samples the sensors of the model."""
    return lambda: None


def _own(kind: DeviceType[DeviceT]) -> DeviceType[DeviceT]:
    return replace(kind, sampler=_by_model)


def _maker(model: Any, number: int) -> Callable[[ModelSensor], Measured] | None:
    type_ = int(model.sensor_type[number])
    return _OF_ONE.get(type_, _number) if model.sensor_dim[number] == 1 else _OF_SEVERAL.get(type_)


def _numbers(sensor: ModelSensor) -> Measured:
    device = MujocoSensor(
        name=sensor.name, type_name=type_name_of(sensor.model.model, sensor.number), numbers=sensor.numbers
    )
    return Measured(kind=_MUJOCO_SENSOR, device=device, sample=device.sample)


def _number(sensor: ModelSensor) -> Measured:
    device = PositionSensor(name=sensor.name, shaft=sensor.shaft, resolution=-1.0, noise=0.0)

    def sample() -> None:
        device.value = float(sensor.numbers[0])

    return Measured(kind=_POSITION_SENSOR, device=device, sample=sample)


def _distance(sensor: ModelSensor) -> Measured:
    """Return a distance sensor; its value is the maximum range if the ray meets no surface."""
    model = sensor.model.model
    reach_m = float(model.sensor_cutoff[sensor.number]) or float(model.vis.map.zfar * model.stat.extent)
    table = LookupTable([(0.0, 0.0, 0.0), (reach_m, reach_m, 0.0)])
    device = DistanceSensor(
        name=sensor.name,
        model="",
        beams=(),
        weights=(),
        table=table,
        rows=table.rows,
        type=DistanceSensorType.LASER,
        aperture_rad=0.0,
    )

    def sample() -> None:
        distance_m = float(sensor.numbers[0])
        device.value = reach_m if distance_m < 0.0 else min(reach_m, distance_m)

    return Measured(kind=_DISTANCE_SENSOR, device=device, sample=sample)


def _touch(sensor: ModelSensor) -> Measured:
    device = TouchSensor(name=sensor.name, model="", outline=[], type=_FORCE, table=None, value=0.0)

    def sample() -> None:
        device.value = float(sensor.numbers[0])

    return Measured(kind=_TOUCH_SENSOR, device=device, sample=sample)


def _accelerometer(sensor: ModelSensor) -> Measured:
    device = Accelerometer(name=sensor.name, model="", place=_NOWHERE, gravity=0.0, axes=_PLAIN)
    return Measured(kind=_ACCELEROMETER, device=device, sample=_vector(device, sensor))


def _gyro(sensor: ModelSensor) -> Measured:
    device = Gyro(name=sensor.name, model="", place=_NOWHERE, axes=_PLAIN)
    return Measured(kind=_GYRO, device=device, sample=_vector(device, sensor))


def _inertial_unit(sensor: ModelSensor) -> Measured:
    device = InertialUnit(name=sensor.name, model="", place=_NOWHERE, noise=0.0, resolution=-1.0)

    def sample() -> None:
        w, x, y, z = sensor.numbers.tolist()
        device.value = x, y, z, w

    return Measured(kind=_INERTIAL_UNIT, device=device, sample=sample)


def _gps(sensor: ModelSensor) -> Measured:
    model, number = sensor.model, sensor.number
    what, which = int(model.model.sensor_objtype[number]), int(model.model.sensor_objid[number])
    device = Gps(
        name=sensor.name,
        model="",
        place=_NOWHERE,
        reference=(0.0, 0.0, 0.0),
        accuracy=0.0,
        resolution=-1.0,
        speed_noise=0.0,
        speed_resolution=-1.0,
    )
    position = _vector(device, sensor)

    def sample() -> None:
        position()
        (vx, vy, vz), _ = model.velocity(what, which)
        device.speed_vector.value = vx, vy, vz
        device.speed.value = math.hypot(vx, vy, vz)

    return Measured(kind=_GPS, device=device, sample=sample)


def _vector(device: Gps | Gyro | Accelerometer, sensor: ModelSensor) -> Sample:
    def sample() -> None:
        x, y, z = sensor.numbers.tolist()
        device.value = x, y, z

    return sample


_POSITION_SENSOR: Final = _own(POSITION_SENSOR)
_DISTANCE_SENSOR: Final = _own(DISTANCE_SENSOR)
_ACCELEROMETER: Final = _own(ACCELEROMETER)
_GYRO: Final = _own(GYRO)
_INERTIAL_UNIT: Final = _own(INERTIAL_UNIT)
_GPS: Final = _own(GPS)
_TOUCH_SENSOR: Final = _own(TOUCH_SENSOR)
_MUJOCO_SENSOR: Final = _own(MUJOCO_SENSOR)
# `camera` above has already set the device's `eye`, which `Camera.attach` would replace.
_CAMERA: Final = replace(CAMERA, attach=lambda _camera, _robot: None)
_OF_ONE: Final[dict[int, Callable[[ModelSensor], Measured]]] = {
    int(mujoco.mjtSensor.mjSENS_RANGEFINDER): _distance,
    int(mujoco.mjtSensor.mjSENS_TOUCH): _touch,
}
_OF_SEVERAL: Final[dict[int, Callable[[ModelSensor], Measured]]] = {
    int(mujoco.mjtSensor.mjSENS_ACCELEROMETER): _accelerometer,
    int(mujoco.mjtSensor.mjSENS_GYRO): _gyro,
    int(mujoco.mjtSensor.mjSENS_FRAMEQUAT): _inertial_unit,
    int(mujoco.mjtSensor.mjSENS_FRAMEPOS): _gps,
}
