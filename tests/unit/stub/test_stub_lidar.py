"""Lidar: the distances along its rays, and its messages."""

import math
import struct

import pytest

from palaestra_sim.ros.node import ServiceFailed

WALL = "Solid { translation 2 0 0.5 children [ Shape { geometry Box { size 0.2 8 1 } } ] }"
FLAT = "horizontalResolution 5 numberOfLayers 1 fieldOfView 1.5 minRange 0.1 maxRange 3"
TALL = "horizontalResolution 3 numberOfLayers 3 fieldOfView 0.3 verticalFieldOfView 1.0 maxRange 5"
ROBOT = """Robot {{ supervisor TRUE controller "ros" controllerArgs [ "--name=seer" "--synchronize" ]
  children [ Lidar {{ name "eye" translation 0 0 0.5 {} }} ] }}"""


@pytest.fixture
def seer(start, world, ros):
    """`seer(fields)` returns the node of a robot whose lidar looks at a wall 1.9 m ahead and 1 m high."""

    def begin(fields, objects=WALL):
        start(world(objects, robot=ROBOT.format(fields)))
        return ros.node("seer")

    return begin


def seen(robot, *topics):
    """Enable the lidar, make a step, and return one message of each topic."""
    inboxes = [robot.inbox(f"eye/{topic}") for topic in topics]
    assert robot.get("eye/enable", value=64) is True
    for _ in range(2):
        robot.call("robot/time_step", value=32)
    (messages,) = zip(*inboxes, strict=True)
    return messages


def floats(data):
    """Return the float32 numbers of an image."""
    return struct.unpack(f"<{len(data) // 4}f", data)


def test_the_rays_of_a_layer_go_from_left_to_right(seer):
    """Each ray goes through the middle of its pixel; the distance is measured along the ray, not the axis."""
    image, scan = seen(seer(FLAT), "range_image", "laser_scan")
    expected = [1.9 / math.cos(angle) for angle in (0.6, 0.3, 0.0, -0.3, -0.6)]

    assert (image["height"], image["width"], image["encoding"], image["step"]) == (1, 5, "32FC1", 20)
    assert floats(image["data"]) == pytest.approx(expected)
    assert list(scan["ranges"]) == pytest.approx(expected)


def test_a_scan_has_the_angles_and_times_of_the_controller(seer):
    """As in the real controller, a scan takes as long as the sampling period that the client enabled."""
    scan, older = seen(seer(FLAT), "laser_scan", "laser_scan/layer0")

    assert (scan["angle_min"], scan["angle_max"], scan["angle_increment"]) == (-0.75, 0.75, 0.3)
    assert (scan["range_min"], scan["range_max"]) == (0.1, 3.0)
    assert scan["scan_time"] == 0.064
    assert scan["time_increment"] == pytest.approx(0.064 / 5)
    assert list(older["ranges"]) == list(scan["ranges"])


def test_several_layers_look_up_and_down(seer):
    """The top layer looks over the wall, and the lowest at the floor.

    With several layers, each has its own scan.
    """
    robot = seer(TALL, WALL + "Solid { children [ Shape { geometry Plane { size 20 20 } } ] }")
    image, middle = seen(robot, "range_image", "laser_scan/layer1")
    top, _, low = (floats(image["data"])[row * 3 + 1] for row in range(3))

    assert top == math.inf
    assert middle["ranges"][1] == pytest.approx(1.9)
    assert low == pytest.approx(0.5 / math.sin(0.5))
    assert not robot.publishers("eye/laser_scan")


def test_nothing_nearer_or_farther_than_the_range_is_seen(seer):
    """A client cannot distinguish the two cases, because the distance is infinite in both."""
    (near,) = seen(seer(FLAT.replace("minRange 0.1", "minRange 2.1")), "laser_scan")

    assert list(near["ranges"]) == pytest.approx([1.9 / math.cos(0.6), *[math.inf] * 3, 1.9 / math.cos(0.6)])


def test_a_cloud_of_points_comes_while_it_is_enabled(seer):
    """The 20 bytes of each point are x forward, y left, z up, the layer and the time."""
    robot = seer(FLAT)
    clouds = robot.inbox("eye/point_cloud")
    seen(robot, "range_image")
    assert clouds == []
    with pytest.raises(ServiceFailed, match="the point cloud is not enabled; call enable_point_cloud"):
        robot.call("eye/get_layer_point_cloud", layer=0)

    assert robot.get("eye/enable_point_cloud", value=True) is True
    assert robot.get("eye/is_point_cloud_enabled") == 1
    seen(robot, "range_image")
    (cloud,) = clouds
    first = struct.unpack_from("<fffif", cloud["data"])
    assert (cloud["height"], cloud["width"], cloud["point_step"], cloud["row_step"]) == (1, 5, 20, 100)
    assert first == pytest.approx((1.9, 1.9 * math.tan(0.6), 0.0, 0, 0.0))
    point = robot.get("eye/get_layer_point_cloud", layer=0).points[2]
    assert (point.x, point.y, point.z) == pytest.approx((1.9, 0.0, 0.0), abs=1e-6)


def test_a_layer_can_be_asked_for(seer):
    """Webots would read a null pointer for a layer that the lidar does not have."""
    robot = seer(TALL)
    seen(robot, "range_image")

    image = robot.get("eye/get_layer_range_image", layer=1)
    assert (image.height, image.width) == (1, 3)
    assert floats(image.data)[1] == pytest.approx(1.9)
    with pytest.raises(ServiceFailed, match="has no layer 3; use a layer from 0 to 2"):
        robot.call("eye/get_layer_range_image", layer=3)


def test_the_settings_are_answered(seer):
    """As in libController, a frequency beyond the limits changes nothing."""
    robot = seer(FLAT)
    info = robot.call("eye/get_info")

    assert (info.horizontalResolution, info.numberOfLayers, info.fov, info.maxRange) == (5, 1, 1.5, 3.0)
    for frequency in (20.0, 30.0):
        assert robot.get("eye/set_frequency", value=frequency) is True
    assert robot.call("eye/get_frequency_info").frequency == 20.0


def test_a_lidar_that_is_not_enabled_casts_no_rays(seer):
    """Rays take processor time; the image stays as it was at the last step with an enabled lidar."""
    robot = seer(FLAT)
    robot.call("robot/time_step", value=32)
    assert set(floats(robot.get("eye/get_layer_range_image", layer=0).data)) == {math.inf}

    seen(robot, "range_image")
    assert min(floats(robot.get("eye/get_layer_range_image", layer=0).data)) == pytest.approx(1.9)


def test_noise_is_a_share_of_the_range_and_a_resolution_rounds(seer):
    """The noise is added before the distance is rounded."""
    (scan,) = seen(seer(f"{FLAT} noise 0.05 resolution 0.25"), "laser_scan")

    assert all(math.remainder(distance, 0.25) == 0.0 for distance in scan["ranges"])
    assert list(scan["ranges"]) != pytest.approx([2.25, 2.0, 2.0, 2.0, 2.25])
