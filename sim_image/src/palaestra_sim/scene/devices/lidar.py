"""Lidar: layers of rays, whose distances are published as a range image, laser scans and a point cloud.

Each layer is a row of the image, from the top down. In a row, the rays go from left to right. While the lidar
is enabled, its rays are cast at each step. At other times no ray is cast, to save time. The distance of an
object nearer than `minRange` or beyond `maxRange` is infinite.

At each step, a rotating lidar casts the rays over which its head has turned since the step before. The first
ray of a layer points ahead, and the following rays go to the right, through a full turn. The distance of a
ray is 0 until the head has passed this ray. Source: WbLidar.cpp and RosLidar.cpp of Webots.
"""

from __future__ import annotations

import math
import struct
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row, UnsimulatedError
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.lidar_rays import LidarRays
from palaestra_sim.scene.devices.sensor_response import discrete
from palaestra_sim.scene.devices.step_timer import StepTimer
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.old_axes import looking

_FLOAT_BYTES: Final = 4
_MOST_RAYS: Final = 1_000_000
_ROUNDING: Final = 1e-6  # tolerance, so that a turn by exactly the angle of one ray includes that ray
_POINT: Final = struct.Struct("<fffif")  # x, y, z, layer, time
_FLOAT32, _INT32 = 7, 5  # the numbers of these types in sensor_msgs/PointField
POINT_FIELDS: Final = [
    {"name": name, "offset": offset, "datatype": datatype, "count": 1}
    for name, offset, datatype in (
        ("x", 0, _FLOAT32),
        ("y", 4, _FLOAT32),
        ("z", 8, _FLOAT32),
        ("layer", 12, _INT32),
        ("time", 16, _FLOAT32),
    )
]


@dataclass(slots=True, kw_only=True, eq=False)
class Lidar:
    """A lidar.

    Attributes:
        info: the response of `get_info`.
        frequency: the response of `get_frequency_info`.
        noise: standard deviation of a distance, as a fraction of the maximum range.
        resolution: the resolution of a distance; -1 for exact values.
        rays: the rays of the lidar.
        mount: the frame of the joint that moves the lidar; None if no joint moves it.
        period_ms: the sampling period; 0 while the lidar is not enabled.
        clouded: whether the point cloud is enabled.
        layers: the distances of the last step in meters, by layer.
        timing: `scan_time` and `time_increment` of the laser scans.
    """

    name: str
    model: str
    info: dict[str, Any]
    frequency: dict[str, float]
    noise: float
    resolution: float
    rays: LidarRays
    mount: Frame | None = None
    period_ms: int = 0
    clouded: bool = False
    layers: list[array[float]] = field(default_factory=list)
    timing: dict[str, Any] = field(default_factory=dict)

    @property
    def value(self) -> bytes:
        """The range image: a float32 for each ray, layer by layer."""
        return b"".join(layer.tobytes() for layer in self.layers)

    def enabled(self, period_ms: int) -> None:
        """Set the sampling period."""
        self.period_ms = period_ms
        scan_s = period_ms / 1000.0
        self.timing.update(scan_time=scan_s, time_increment=scan_s / self.info["horizontalResolution"])

    def points(self, layer: int) -> Iterator[Vector]:
        """Yield the points of a layer in the frame of the sensor; infinite where a ray met no object."""
        for distance_m, (x, y, z) in zip(self.layers[layer], self.rays.layer(layer), strict=True):
            if math.isinf(distance_m):
                yield math.inf, math.inf, math.inf
            else:
                yield x * distance_m, y * distance_m, z * distance_m


@dataclass(frozen=True, slots=True, eq=False)
class _Scan:
    """One layer, for a laser scan."""

    lidar: Lidar
    layer: int

    @property
    def value(self) -> Sequence[float]:
        return self.lidar.layers[self.layer]


@dataclass(frozen=True, slots=True, eq=False)
class _Cloud:
    """The point cloud, as a list with one item; the list is empty while the cloud is not enabled."""

    lidar: Lidar

    @property
    def value(self) -> list[bytes]:
        lidar = self.lidar
        if not lidar.clouded:
            return []
        packed = (
            _POINT.pack(*point, layer, 0.0)
            for layer in range(len(lidar.layers))
            for point in lidar.points(layer)
        )
        return [b"".join(packed)]


def _read(part: DevicePart) -> Lidar:
    number = part.number
    columns = max(1, int(number("horizontalResolution", 512.0)))
    layers = max(1, int(number("numberOfLayers", 4.0)))
    if (count := columns * layers) > _MOST_RAYS:
        part.refuse(f"a lidar with {count} rays", f"use {_MOST_RAYS} at most")
        columns = layers = 1
    info = {
        "horizontalResolution": columns,
        "numberOfLayers": layers,
        "fov": number("fieldOfView", 1.5708),
        "verticalFov": number("verticalFieldOfView", 0.2),
        "minRange": number("minRange", 0.01),
        "maxRange": number("maxRange", 1.0),
    }
    rays = LidarRays(
        frame=part.mounted(looking(part.node, part.place)),
        layers=layers,
        columns=columns,
        wide_rad=info["fov"],
        high_rad=info["verticalFov"],
        tilt_rad=number("tiltAngle", 0.0),
        reach_m=info["maxRange"],
        rotates=part.text("type", "fixed").lower() == "rotating",
    )
    return Lidar(
        name=part.name,
        model=part.text("model"),
        info=info,
        frequency={
            "frequency": number("defaultFrequency", 10.0),
            "minFrequency": number("minFrequency", 1.0),
            "maxFrequency": number("maxFrequency", 25.0),
        },
        noise=number("noise", 0.0),
        resolution=number("resolution", -1.0),
        rays=rays,
        mount=part.mount,
        layers=_unseen(rays),
    )


def _unseen(rays: LidarRays) -> list[array[float]]:
    """Return the distances before the first measurement."""
    return [array("f", [0.0 if rays.rotates else math.inf]) * rays.columns for _ in range(rays.layers)]


def _sampler(lidars: Sequence[Lidar], robot: Carrier) -> Sample:
    samples = [_rotating(lidar, robot) if lidar.rays.rotates else _fixed(lidar, robot) for lidar in lidars]

    def sample() -> None:
        for each in samples:
            each()

    return sample


def _fixed(lidar: Lidar, robot: Carrier) -> Sample:
    casts: list[Callable[[], Sequence[float]]] = []

    def sample() -> None:
        if not lidar.period_ms:
            return
        if not casts:  # many rays take memory, so they are created at the first use of the lidar
            columns = range(lidar.rays.columns)
            layers = [lidar.rays.beams(layer, columns) for layer in range(lidar.rays.layers)]
            casts.extend(robot.see(beams, lidar.mount) for beams in layers)
        for layer, cast in enumerate(casts):
            lidar.layers[layer] = array("f", (_seen(lidar, distance_m, robot.gauss) for distance_m in cast()))

    return sample


def _rotating(lidar: Lidar, robot: Carrier) -> Sample:
    timer, turns = StepTimer(robot), 0.0

    def sample() -> None:
        nonlocal turns
        elapsed_s, reset = timer.elapsed()
        if reset:
            turns = 0.0
            lidar.layers[:] = _unseen(lidar.rays)
        if lidar.period_ms and elapsed_s:
            before, turns = turns, turns + elapsed_s * lidar.frequency["frequency"]
            _sweep(lidar, robot, before, turns)

    return sample


def _sweep(lidar: Lidar, robot: Carrier, before: float, turns: float) -> None:
    """Cast the rays that the head passes between the angles `before` and `turns`, given in full turns."""
    rays = lidar.rays
    first, end = (math.floor(it * rays.columns + _ROUNDING) for it in (before, turns))
    columns = [column % rays.columns for column in range(max(first, end - rays.columns), end)]
    beams = [beam for layer in range(rays.layers) for beam in rays.beams(layer, columns)]
    places = ((layer, column) for layer in range(rays.layers) for column in columns)
    for (layer, column), distance_m in zip(places, robot.see(beams, lidar.mount)(), strict=True):
        lidar.layers[layer][column] = _seen(lidar, distance_m, robot.gauss)


def _seen(lidar: Lidar, distance_m: float, gauss: Callable[[float, float], float]) -> float:
    low, high = lidar.info["minRange"], lidar.info["maxRange"]
    if not low <= distance_m < high:
        return math.inf
    if lidar.noise:
        distance_m += lidar.noise * high * gauss(0.0, 1.0)
    return discrete(distance_m, lidar.resolution)


def _services(lidar: Lidar) -> tuple[Row, ...]:
    def set_frequency(request: Any) -> Fields:
        if lidar.frequency["minFrequency"] <= request.value <= lidar.frequency["maxFrequency"]:
            lidar.frequency["frequency"] = request.value
        return {"success": True}

    def enable_point_cloud(request: Any) -> Fields:
        lidar.clouded = request.value
        return {"success": True}

    return (
        ("get_info", "lidar_get_info", lambda _: lidar.info),
        ("get_frequency_info", "lidar_get_frequency_info", lambda _: lidar.frequency),
        ("set_frequency", "set_float", set_frequency),
        ("enable_point_cloud", "set_bool", enable_point_cloud),
        ("is_point_cloud_enabled", "node_get_status", lambda _: {"status": int(lidar.clouded)}),
        ("get_layer_range_image", "lidar_get_layer_range_image", lambda it: _layer_image(lidar, it.layer)),
        ("get_layer_point_cloud", "lidar_get_layer_point_cloud", lambda it: _layer_points(lidar, it.layer)),
    )


def _layer_image(lidar: Lidar, layer: int) -> Fields:
    _require(lidar, layer)
    return {"image": {**_image(lidar, 1), "data": lidar.layers[layer].tobytes()}}


def _layer_points(lidar: Lidar, layer: int) -> Fields:
    if not lidar.clouded:
        raise UnsimulatedError("the point cloud is not enabled; call enable_point_cloud")
    _require(lidar, layer)
    return {"pointCloud": {"points": [{"x": x, "y": y, "z": z} for x, y, z in lidar.points(layer)]}}


def _require(lidar: Lidar, layer: int) -> None:
    """Check that the layer exists; Webots would read a null pointer."""
    count = len(lidar.layers)
    if not 0 <= layer < count:
        raise UnsimulatedError(f"the lidar has no layer {layer}; use a layer from 0 to {count - 1}")


def _image(lidar: Lidar, height: int) -> Fields:
    width = lidar.info["horizontalResolution"]
    return {"height": height, "width": width, "encoding": "32FC1", "step": _FLOAT_BYTES * width}


def _topics(lidar: Lidar) -> tuple[DeviceTopic, ...]:
    layers = lidar.info["numberOfLayers"]
    lidar.timing.update(_angles(lidar))
    image = DeviceTopic(
        name="range_image",
        type_name="sensor_msgs/Image",
        source=lidar,
        constants=_image(lidar, layers),
        reading="data",
    )
    # Programs for older versions of Webots use topics with the names of the layers.
    scans = [(f"laser_scan/layer{layer}", layer) for layer in range(layers)]
    if layers == 1:
        scans.append(("laser_scan", 0))
    return image, *(_scan(lidar, name, layer) for name, layer in scans), _cloud(lidar)


def _scan(lidar: Lidar, name: str, layer: int) -> DeviceTopic:
    return DeviceTopic(
        name=name,
        type_name="sensor_msgs/LaserScan",
        source=_Scan(lidar, layer),
        constants=lidar.timing,
        reading="ranges",
    )


def _angles(lidar: Lidar) -> Fields:
    fov = lidar.info["fov"]
    return {
        "angle_min": -fov / 2.0,
        "angle_max": fov / 2.0,
        "angle_increment": fov / lidar.info["horizontalResolution"],
        "range_min": lidar.info["minRange"],
        "range_max": lidar.info["maxRange"],
    }


def _cloud(lidar: Lidar) -> DeviceTopic:
    count = lidar.info["numberOfLayers"] * lidar.info["horizontalResolution"]
    constants = {
        "height": 1,
        "width": count,
        "fields": POINT_FIELDS,
        "point_step": _POINT.size,
        "row_step": _POINT.size * count,
    }
    return DeviceTopic(
        name="point_cloud",
        type_name="sensor_msgs/PointCloud2",
        source=_Cloud(lidar),
        constants=constants,
        reading="data",
        many=True,
    )


LIDAR: Final = DeviceType(
    node="Lidar",
    name="lidar",
    without_effect="near spherical rotatingHead",
    fields="""tiltAngle SFFloat 0; horizontalResolution SFInt32 512; fieldOfView SFFloat 1.5708;
        verticalFieldOfView SFFloat 0.2; numberOfLayers SFInt32 4; near SFFloat 0.01;
        minRange SFFloat 0.01; maxRange SFFloat 1; spherical SFBool TRUE; type SFString fixed;
        noise SFFloat 0; resolution SFFloat -1; defaultFrequency SFFloat 10; minFrequency SFFloat 1;
        maxFrequency SFFloat 25; rotatingHead SFNode""",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
    enabled=Lidar.enabled,
)
