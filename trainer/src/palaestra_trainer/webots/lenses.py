"""The optics of cameras, depth cameras and lidars."""

from __future__ import annotations

from typing import Final, NamedTuple

from palaestra_trainer.webots.device import Fact


class CameraInfo(NamedTuple):
    """The image of a camera.

    Attributes:
        width: width in pixels.
        height: height in pixels.
        field_of_view_rad: horizontal field of view, in rad.
        near_m: the least distance at which objects are visible, in meters.
    """

    width: int
    height: int
    field_of_view_rad: float
    near_m: float


class FocusInfo(NamedTuple):
    """The Focus node of a camera; zeros without this node.

    Attributes:
        focal_length_m: focal length in meters.
        distance_m: the distance at which objects are sharp, in meters.
        min_distance_m: the least such distance.
        max_distance_m: the greatest such distance.
    """

    focal_length_m: float
    distance_m: float
    min_distance_m: float
    max_distance_m: float


class ZoomInfo(NamedTuple):
    """The least and the greatest field of view of a camera, in rad; equal if it has no Zoom node."""

    min_rad: float
    max_rad: float


class RangeFinderInfo(NamedTuple):
    """The image of a depth camera.

    Attributes:
        width: width in pixels.
        height: height in pixels.
        field_of_view_rad: horizontal field of view, in rad.
        min_range_m: the least distance that is measured, in meters.
        max_range_m: the greatest distance that is measured, in meters.
    """

    width: int
    height: int
    field_of_view_rad: float
    min_range_m: float
    max_range_m: float


class LidarInfo(NamedTuple):
    """The rays of a lidar.

    Attributes:
        rays: the number of rays in each layer.
        layers: the number of layers.
        field_of_view_rad: horizontal field of view, in rad.
        vertical_field_of_view_rad: vertical field of view, in rad.
        min_range_m: the least distance that is measured, in meters.
        max_range_m: the greatest distance that is measured, in meters.
    """

    rays: int
    layers: int
    field_of_view_rad: float
    vertical_field_of_view_rad: float
    min_range_m: float
    max_range_m: float


class LidarFrequency(NamedTuple):
    """The rotations per second of a lidar's head: now, and the least and the greatest possible number."""

    frequency_hz: float
    min_hz: float
    max_hz: float


CAMERA_INFO: Final = Fact(
    "get_info",
    "camera_get_info",
    lambda info: CameraInfo(info.width, info.height, info.Fov, info.nearRange),
    "The size and field of view of the image: a `CameraInfo`.",
)
FOCUS_INFO: Final = Fact(
    "get_focus_info",
    "camera_get_focus_info",
    lambda info: FocusInfo(
        info.focalLength, info.focalDistance, info.minFocalDistance, info.maxFocalDistance
    ),
    "The focus and its limits: a `FocusInfo`.",
)
ZOOM_INFO: Final = Fact(
    "get_zoom_info",
    "camera_get_zoom_info",
    lambda info: ZoomInfo(info.minFov, info.maxFov),
    "The limits of the field of view: a `ZoomInfo`.",
)
RANGE_FINDER_INFO: Final = Fact(
    "get_info",
    "range_finder_get_info",
    lambda info: RangeFinderInfo(info.width, info.height, info.Fov, info.minRange, info.maxRange),
    "The size, field of view and range of the image: a `RangeFinderInfo`.",
)
LIDAR_INFO: Final = Fact(
    "get_info",
    "lidar_get_info",
    lambda info: LidarInfo(
        info.horizontalResolution,
        info.numberOfLayers,
        info.fov,
        info.verticalFov,
        info.minRange,
        info.maxRange,
    ),
    "The number of rays, the fields of view and the range: a `LidarInfo`.",
)
LIDAR_FREQUENCY: Final = Fact(
    "get_frequency_info",
    "lidar_get_frequency_info",
    lambda info: LidarFrequency(info.frequency, info.minFrequency, info.maxFrequency),
    "The rotations per second of the head: a `LidarFrequency`.",
)
