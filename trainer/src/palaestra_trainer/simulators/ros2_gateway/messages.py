"""The contents of ROS 2 messages from a simulator's data, as plain dicts; pure functions.

Times are the simulated seconds since the last reset. Poses are those of `palaestra_protocol.scene`.
"""

from __future__ import annotations

import array
from collections.abc import Mapping, Sequence
from typing import Any, Final

from palaestra_protocol.scene import PoseNumbers, SceneState, VisibleScene
from palaestra_trainer.bags import messages
from palaestra_trainer.bags.messages import Content
from palaestra_trainer.robots.base import SENSOR_RANGE_M
from palaestra_trainer.robots.infrared import meters

_FLAT: Final = (0.0, 0.0, 0.0)


def clock(time_s: float) -> Content:
    """Return a Clock."""
    return {"clock": messages.header(time_s, "")["stamp"]}


def odometry(time_s: float, pose: PoseNumbers) -> Content:
    """Return an Odometry with a pose in the world's frame, here named `odom`, and an unknown velocity.

    In a fast simulator, two states are too far apart in time to compute a velocity from their difference.
    """
    content = messages.odometry(time_s, _FLAT, None)
    position, orientation = _parts(pose)
    place = {"pose": {"position": position, "orientation": orientation}}
    return content | {"pose": content["pose"] | place}


def transform(time_s: float, pose: PoseNumbers) -> Content:
    """Return a TransformStamped from `odom` to `base_link`."""
    (content,) = messages.transform(time_s, _FLAT)["transforms"]
    translation, rotation = _parts(pose)
    return dict(content) | {"transform": {"translation": translation, "rotation": rotation}}


def joint_state(time_s: float, joints: Mapping[str, float]) -> Content:
    """Return a JointState with the positions of joints, in rad or m; velocities and efforts are unknown."""
    return {
        "header": messages.header(time_s, messages.BASE),
        "name": list(joints),
        "position": [float(position) for position in joints.values()],
    }


def infrared_scan(time_s: float, volts: Sequence[float]) -> Content:
    """Return the LaserScan of a Robotino's nine distance sensors, which measure volts."""
    return messages.ranges(time_s, [meters(volt) for volt in volts], SENSOR_RANGE_M)


def image(time_s: float, message: Any) -> Content:
    """Return an Image with the pixels of `message`, which has the fields of sensor_msgs/Image of ROS 1."""
    return {
        "header": messages.header(time_s, message.header.frame_id),
        "height": int(message.height),
        "width": int(message.width),
        "encoding": str(message.encoding),
        "is_bigendian": int(message.is_bigendian),
        "step": int(message.step),
        "data": array.array("B", bytes(message.data)),  # for any other type, rclpy checks each element
    }


def laser_scan(time_s: float, message: Any) -> Content:
    """Return a LaserScan with the ranges of `message`, a LaserScan of ROS 1."""
    angles = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
    limits = ("range_min", "range_max")
    return {
        "header": messages.header(time_s, message.header.frame_id),
        **{name: float(getattr(message, name)) for name in (*angles, *limits)},
        "ranges": [float(each) for each in message.ranges],
        "intensities": [float(each) for each in message.intensities],
    }


def robot_pose(scene: VisibleScene, state: SceneState, node: str) -> PoseNumbers:
    """Return the current pose of a scene's node; the scene has the poses of nodes that never moved."""
    if node in state.poses:
        return state.poses[node]
    return next(each.pose for each in scene.nodes if each.name == node)


def joints_of(scene: VisibleScene, state: SceneState, robot: str) -> dict[str, float]:
    """Return the joints of one robot, by names without the robot's name.

    In a world with several robots, the name of a joint in `state` begins with the name of its robot.
    """
    if not any(node.robot and node.name != robot for node in scene.nodes):
        return dict(state.joints)
    above = f"{robot}/"
    return {name.removeprefix(above): value for name, value in state.joints.items() if name.startswith(above)}


def _parts(pose: PoseNumbers) -> tuple[Content, Content]:
    x, y, z, qw, qx, qy, qz = pose
    return {"x": x, "y": y, "z": z}, {"x": qx, "y": qy, "z": qz, "w": qw}
