"""What cameras, depth cameras and lidars return about their optics."""

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
        most_m: the greatest such distance.
        least_m: the least such distance.
    """

    focal_length_m: float
    distance_m: float
    most_m: float
    least_m: float


class ZoomInfo(NamedTuple):
    """The fields of view that a camera can have, in rad; both are the present one without a Zoom node."""

    least_rad: float
    most_rad: float


class RangeFinderInfo(NamedTuple):
    """The image of a depth camera.

    Attributes:
        width: width in pixels.
        height: height in pixels.
        field_of_view_rad: horizontal field of view, in rad.
        least_m: the least distance that is measured, in meters.
        most_m: the greatest distance that is measured, in meters.
    """

    width: int
    height: int
    field_of_view_rad: float
    least_m: float
    most_m: float


class LidarInfo(NamedTuple):
    """The rays of a lidar.

    Attributes:
        rays: the number of rays in each layer.
        layers: the number of layers.
        field_of_view_rad: horizontal field of view, in rad.
        vertical_field_of_view_rad: vertical field of view, in rad.
        least_m: the least distance that is measured, in meters.
        most_m: the greatest distance that is measured, in meters.
    """

    rays: int
    layers: int
    field_of_view_rad: float
    vertical_field_of_view_rad: float
    least_m: float
    most_m: float


class LidarFrequency(NamedTuple):
    """The rotations per second of a lidar's head: now, and the least and the greatest possible number."""

    frequency_hz: float
    least_hz: float
    most_hz: float


CAMERA_INFO: Final = Fact(
    "get_info",
    "camera_get_info",
    lambda it: CameraInfo(it.width, it.height, it.Fov, it.nearRange),
    "The size and field of view of the image: a `CameraInfo`.",
)
FOCUS_INFO: Final = Fact(
    "get_focus_info",
    "camera_get_focus_info",
    lambda it: FocusInfo(it.focalLength, it.focalDistance, it.maxFocalDistance, it.minFocalDistance),
    "The focus and its limits: a `FocusInfo`.",
)
ZOOM_INFO: Final = Fact(
    "get_zoom_info",
    "camera_get_zoom_info",
    lambda it: ZoomInfo(it.minFov, it.maxFov),
    "The limits of the field of view: a `ZoomInfo`.",
)
RANGE_FINDER_INFO: Final = Fact(
    "get_info",
    "range_finder_get_info",
    lambda it: RangeFinderInfo(it.width, it.height, it.Fov, it.minRange, it.maxRange),
    "The size, field of view and range of the image: a `RangeFinderInfo`.",
)
LIDAR_INFO: Final = Fact(
    "get_info",
    "lidar_get_info",
    lambda it: LidarInfo(
        it.horizontalResolution, it.numberOfLayers, it.fov, it.verticalFov, it.minRange, it.maxRange
    ),
    "The number of rays, the fields of view and the range: a `LidarInfo`.",
)
LIDAR_FREQUENCY: Final = Fact(
    "get_frequency_info",
    "lidar_get_frequency_info",
    lambda it: LidarFrequency(it.frequency, it.minFrequency, it.maxFrequency),
    "The rotations per second of the head: a `LidarFrequency`.",
)
