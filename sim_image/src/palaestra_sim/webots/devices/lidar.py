"""Lidars: range images, laser scans and point clouds."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Final

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.scene.devices.lidar import POINT_FIELDS
from palaestra_sim.webots.devices.calls import DeviceCalls, Reading, commands, copied, served
from palaestra_sim.webots.library import LidarPoint

_FLOAT_BYTES: Final = 4
_POINT_BYTES: Final = ctypes.sizeof(LidarPoint)


def lidar(calls: DeviceCalls) -> ServedDevice:
    """Return a Lidar; each layer is a row of the range image, from the top down and from left to right."""
    timing = _angles(calls)
    device = served(
        calls,
        topics=(_range_image(calls), *_scans(calls, timing), _cloud(calls)),
        rows=(
            ("get_info", "lidar_get_info", lambda _: _info(calls)),
            ("get_frequency_info", "lidar_get_frequency_info", lambda _: _frequency_info(calls)),
            *commands(calls, "set_float", "set_frequency"),
            ("enable_point_cloud", "set_bool", partial(_switch_cloud, calls)),
            (
                "is_point_cloud_enabled",
                "node_get_status",
                lambda _: {"status": int(calls.is_point_cloud_enabled())},
            ),
            ("get_layer_range_image", "lidar_get_layer_range_image", partial(_layer_image, calls)),
            ("get_layer_point_cloud", "lidar_get_layer_point_cloud", partial(_layer_points, calls)),
        ),
    )
    return _timed(device, timing, calls.get_horizontal_resolution())


def _timed(device: ServedDevice, timing: dict[str, Any], columns: int) -> ServedDevice:
    """Return the device with scans whose times follow the sampling period."""
    enable = device.enabled

    def enabled(period_ms: int) -> None:
        enable(period_ms)
        scan_s = period_ms / 1000.0
        timing.update(scan_time=scan_s, time_increment=scan_s / columns)

    return replace(device, enabled=enabled)


def _info(calls: DeviceCalls) -> Fields:
    return {
        "horizontalResolution": calls.get_horizontal_resolution(),
        "numberOfLayers": calls.get_number_of_layers(),
        "fov": calls.get_fov(),
        "verticalFov": calls.get_vertical_fov(),
        "minRange": calls.get_min_range(),
        "maxRange": calls.get_max_range(),
    }


def _frequency_info(calls: DeviceCalls) -> Fields:
    return {
        "frequency": calls.get_frequency(),
        "minFrequency": calls.get_min_frequency(),
        "maxFrequency": calls.get_max_frequency(),
    }


def _switch_cloud(calls: DeviceCalls, request: Any) -> Fields:
    (calls.enable_point_cloud if request.value else calls.disable_point_cloud)()
    return {"success": True}


def _layer_image(calls: DeviceCalls, request: Any) -> Fields:
    image = _image(calls, 1)
    found = copied(_layer(calls, request.layer, "range_image"), image["step"])
    return {"image": {**image, "data": found[0]}}


def _layer_points(calls: DeviceCalls, request: Any) -> Fields:
    if not calls.is_point_cloud_enabled():
        raise ServiceFailed("the point cloud is not enabled; call enable_point_cloud")
    points = _layer(calls, request.layer, "point_cloud")
    count = calls.get_horizontal_resolution()
    return {"pointCloud": {"points": [{"x": it.x, "y": it.y, "z": it.z} for it in points[:count]]}}


def _layer(calls: DeviceCalls, layer: int, what: str) -> Any:
    """Return the pointer to the data of a layer.

    Raises:
        ServiceFailed: the lidar has no such layer, or no data yet; Webots' controller would crash.
    """
    count = calls.get_number_of_layers()
    if not 0 <= layer < count:
        raise ServiceFailed(f"the lidar has no layer {layer}; use a layer from 0 to {count - 1}")
    found = getattr(calls, f"get_layer_{what}")(layer)
    if not found:
        raise ServiceFailed("the lidar has not measured yet; enable it and make a step")
    return found


def _image(calls: DeviceCalls, height: int) -> dict[str, Any]:
    width = calls.get_horizontal_resolution()
    return {"height": height, "width": width, "encoding": "32FC1", "step": _FLOAT_BYTES * width}


def _range_image(calls: DeviceCalls) -> DeviceTopic:
    constants = _image(calls, calls.get_number_of_layers())
    size = constants["step"] * constants["height"]
    return DeviceTopic(
        name="range_image",
        type_name="sensor_msgs/Image",
        source=Reading(lambda: copied(calls.get_range_image(), size)),
        constants=constants,
        reading="data",
        many=True,
    )


def _scans(calls: DeviceCalls, timing: Fields) -> Iterator[DeviceTopic]:
    """Yield a scan for each layer; programs for older releases of Webots use the names of layers."""
    layers = calls.get_number_of_layers()
    names = [(f"laser_scan/layer{layer}", layer) for layer in range(layers)]
    if layers == 1:
        names.append(("laser_scan", 0))
    for name, layer in names:
        yield DeviceTopic(
            name=name,
            type_name="sensor_msgs/LaserScan",
            source=Reading(partial(_ranges, calls, layer)),
            constants=timing,
            reading="ranges",
            many=True,
        )


def _ranges(calls: DeviceCalls, layer: int) -> list[list[float]]:
    found = calls.get_layer_range_image(layer)
    return [found[: calls.get_horizontal_resolution()]] if found else []


def _angles(calls: DeviceCalls) -> dict[str, Any]:
    fov = calls.get_fov()
    return {
        "angle_min": -fov / 2.0,
        "angle_max": fov / 2.0,
        "angle_increment": fov / calls.get_horizontal_resolution(),
        "range_min": calls.get_min_range(),
        "range_max": calls.get_max_range(),
    }


def _cloud(calls: DeviceCalls) -> DeviceTopic:
    count = calls.get_number_of_layers() * calls.get_horizontal_resolution()
    size = _POINT_BYTES * count
    return DeviceTopic(
        name="point_cloud",
        type_name="sensor_msgs/PointCloud2",
        source=Reading(lambda: _points(calls, size)),
        constants={
            "height": 1,
            "width": count,
            "fields": POINT_FIELDS,
            "point_step": _POINT_BYTES,
            "row_step": size,
        },
        reading="data",
        many=True,
    )


def _points(calls: DeviceCalls, size: int) -> list[bytes]:
    return copied(calls.get_point_cloud(), size) if calls.is_point_cloud_enabled() else []
