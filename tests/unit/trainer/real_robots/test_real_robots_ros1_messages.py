"""The messages of the driver for ROS 1 as readings."""

import math

import numpy as np
import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.ros1_messages import distances_of, fields_of, odometry_of
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.geometry import Pose

NINE = [0.05, 0.06, 0.07, 0.08, 0.09, 0.10, 0.11, 0.12, 0.41]


def arrived(type_name, fields):
    """Return a message as a subscriber decodes it."""
    codec = message_type(type_name).codec
    return codec.decode(codec.encode(fields))


def odom(heading=0.0, x=0.0, turn=None):
    """Return a message of odometry at a pose."""
    turn = {"z": math.sin(0.5 * heading), "w": math.cos(0.5 * heading)} if turn is None else turn
    fields = {
        "pose": {"pose": {"position": {"x": x, "y": -2.0}, "orientation": turn}},
        "twist": {"twist": {"linear": {"x": 0.1, "y": 0.2}, "angular": {"z": 0.3}}},
    }
    return arrived("nav_msgs/Odometry", fields)


def cloud(distances_m):
    """Return the points that the driver publishes for these distances."""
    angles = [math.radians(40.0 * number) for number in range(len(distances_m))]
    points = [
        {"x": (far + 0.2) * math.cos(angle), "y": (far + 0.2) * math.sin(angle), "z": 0.05}
        for far, angle in zip(distances_m, angles, strict=True)
    ]
    return arrived("sensor_msgs/PointCloud", {"points": points})


@pytest.mark.parametrize("heading", [0.0, 1.5, -3.0, math.pi])
def test_odometry_has_pose_and_velocity(heading):
    """The driver sends the heading as a quaternion."""
    found = odometry_of(odom(heading, x=1.0))

    assert found.pose == Pose(1.0, -2.0, pytest.approx(heading))
    assert found.velocity == (0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    "message", [odom(x=math.nan), odom(turn={"w": 1.5}), odom(turn={})], ids=["nan", "yaw in w", "zeros"]
)
def test_odometry_that_is_no_pose_is_refused(message):
    """One public bridge puts the heading into orientation.w, which would be read as another heading."""
    with pytest.raises(LinkError, match=r"odom: .* which a Robotino does not send"):
        odometry_of(message)


def test_distances_are_those_beyond_the_sensors():
    """The driver adds 0.2 m, because its points are in the frame of the robot."""
    found = distances_of(cloud(NINE), SensorLayout())

    assert found.dtype == np.float32
    assert found == pytest.approx([*NINE[:8], 0.40], abs=1e-6)


def test_the_order_of_the_sensors_is_obeyed():
    """A robot whose sensors are counted clockwise has the same driver."""
    found = distances_of(cloud(NINE), SensorLayout(order="clockwise"))

    assert found == pytest.approx([0.05, 0.40, *NINE[7:0:-1]], abs=1e-6)


@pytest.mark.parametrize("distances_m", [NINE[:8], [*NINE, 0.1], [*NINE[:8], math.inf]])
def test_points_that_are_not_nine_distances_are_refused(distances_m):
    """A missing sensor would shift the others."""
    with pytest.raises(LinkError, match=r"distance_sensors: .* are not 9 distances"):
        distances_of(cloud(distances_m), SensorLayout())


def test_a_command_has_the_two_velocities_along_the_floor_and_the_turn():
    """The driver reads only linear.x, linear.y and angular.z."""
    sent = arrived("geometry_msgs/Twist", fields_of((0.1, -0.2, 0.3)))

    assert (sent.linear, sent.angular) == ((0.1, -0.2, 0.0), (0.0, 0.0, 0.3))
