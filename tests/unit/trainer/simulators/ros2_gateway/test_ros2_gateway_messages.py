"""The contents of a gateway's messages."""

import math
from types import SimpleNamespace

import pytest

from palaestra_protocol.scene import SceneState, VisibleNode, VisibleScene
from palaestra_trainer.simulators.ros2_gateway import messages
from palaestra_trainer.simulators.ros2_gateway.publishing import filled

POSE = (1.0, 2.0, 3.0, 0.5, 0.1, 0.2, 0.3)


def scene(*robots):
    """Return a scene with these robots and a can."""
    nodes = [VisibleNode(name=name, robot=True, pose=POSE) for name in robots]
    return VisibleScene(world="arena.wbt", revision=1, nodes=(*nodes, VisibleNode(name="CAN")))


def test_the_clock_has_all_digits_of_the_simulated_time():
    """Messages of one time must have equal stamps, even after hours of simulated time."""
    assert messages.clock(86400.032) == {"clock": {"sec": 86400, "nanosec": 32_000_000}}


def test_a_pose_keeps_its_height_and_its_tilt():
    """A gateway also shows robots that climb or fly, whose pose is not only x, y and heading."""
    place = messages.odometry(1.5, POSE)["pose"]["pose"]
    moved = messages.transform(1.5, POSE)["transform"]

    assert place["position"] == moved["translation"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert place["orientation"] == moved["rotation"] == {"w": 0.5, "x": 0.1, "y": 0.2, "z": 0.3}


def test_an_unknown_velocity_is_marked_as_unknown():
    """Readers would take 0 for a robot that stands."""
    content = messages.odometry(1.5, POSE)

    assert content["twist"]["covariance"][0] == -1.0
    assert content["pose"]["covariance"] == [0.0] * 36
    assert (content["header"]["frame_id"], content["child_frame_id"]) == ("odom", "base_link")


def test_volts_become_meters_and_an_infinity_where_nothing_is_near():
    """Webots publishes the reading of a Robotino's sensors in volts."""
    content = messages.infrared_scan(1.5, [0.0, 2.0, 1.0, *[0.0] * 6])

    assert content["ranges"][0] == math.inf
    assert content["ranges"][1] == pytest.approx(0.0591, abs=1e-3)
    assert content["ranges"][2] == pytest.approx(0.1302, abs=1e-3)
    assert content["angle_increment"] == pytest.approx(math.radians(40.0))


def test_a_picture_and_a_scan_get_the_simulated_time():
    """The stamp of a simulator's sensor is the wall clock, at which no transform exists."""
    header = SimpleNamespace(frame_id="camera")
    picture = SimpleNamespace(
        header=header, height=1, width=2, encoding="bgra8", is_bigendian=0, step=8, data=bytes(range(8))
    )
    rays = dict.fromkeys(
        ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min"), 0
    )
    scan = SimpleNamespace(header=header, range_max=5, ranges=(1, 2), intensities=(), **rays)

    shown = messages.image(2.25, picture)
    swept = messages.laser_scan(2.25, scan)

    stamp = {"stamp": {"sec": 2, "nanosec": 250_000_000}, "frame_id": "camera"}
    assert shown["header"] == swept["header"] == stamp
    assert shown["data"].tobytes() == bytes(range(8))
    assert swept["ranges"] == [1.0, 2.0]


def test_a_robot_that_never_moved_stands_where_the_scene_has_it():
    """A state has only the poses of nodes that move or were moved."""
    state = SceneState(time_s=0.0, poses={"robotino": POSE[::-1]})

    assert messages.robot_pose(scene("robotino"), state, "robotino") == POSE[::-1]
    assert messages.robot_pose(scene("arm"), state, "arm") == POSE


def test_the_joints_of_other_robots_are_left_out():
    """RViz draws one robot model, and joints of the same name in another robot would move this model."""
    state = SceneState(time_s=0.0, joints={"a/wheel": 1.0, "b/wheel": 2.0})

    assert messages.joints_of(scene("a", "b"), state, "b") == {"wheel": 2.0}
    assert messages.joints_of(scene("b"), SceneState(time_s=0.0, joints={"arm/1": 3.0}), "b") == {
        "arm/1": 3.0
    }


def test_fields_of_inner_messages_are_set():
    """The gateway gets the content of a message as nested dicts, as for a bag."""
    message = SimpleNamespace(header=SimpleNamespace(stamp=SimpleNamespace(sec=0), frame_id=""), name=[])

    filled(message, {"header": {"stamp": {"sec": 7}, "frame_id": "odom"}, "name": ["a"]})

    assert (message.header.stamp.sec, message.header.frame_id, message.name) == (7, "odom", ["a"])
