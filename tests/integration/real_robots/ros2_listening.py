"""A program that subscribes the topics of a gateway, and writes each message as a line of JSON.

Its arguments are those of ROS. It ends when its standard input closes.
"""

import json
import sys
import threading

from palaestra_trainer.ros.ros2_node import Ros2Node, require

DEPTH = 10


def main():
    """Subscribe, and write until standard input closes."""
    node = Ros2Node("listening", arguments=sys.argv[1:])
    qos = require("rclpy.qos")
    profile = qos.QoSProfile(depth=DEPTH, reliability=qos.ReliabilityPolicy.BEST_EFFORT)
    lock = threading.Lock()

    def write(topic, content):
        with lock:
            print(json.dumps({"topic": topic, **content}), flush=True)  # noqa: T201

    for package, name, topic, read in (
        ("rosgraph_msgs", "Clock", "/clock", lambda message: {"time_s": seconds(message.clock)}),
        ("nav_msgs", "Odometry", "odom", odometry),
        ("sensor_msgs", "JointState", "joint_states", joints),
        ("sensor_msgs", "LaserScan", "irsensor_scan", scan),
        ("sensor_msgs", "Image", "camera/image", image),
    ):
        kind = getattr(require(f"{package}.msg"), name)

        def take(message, topic=topic, read=read):
            write(topic, read(message))

        node.ros.create_subscription(kind, topic, take, profile)
    node.start()
    print("ready", flush=True)  # noqa: T201
    sys.stdin.read()
    node.close()


def seconds(stamp):
    """Return a stamp in seconds."""
    return stamp.sec + stamp.nanosec * 1e-9


def odometry(message):
    """Return the content of an Odometry."""
    at, turn = message.pose.pose.position, message.pose.pose.orientation
    return {
        "time_s": seconds(message.header.stamp),
        "pose": [at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z],
        "frames": [message.header.frame_id, message.child_frame_id],
        "speed_known": bool(message.twist.covariance[0] >= 0.0),
    }


def joints(message):
    """Return the content of a JointState."""
    return {"positions": dict(zip(message.name, message.position, strict=True))}


def scan(message):
    """Return the content of a LaserScan; JSON has no infinity."""
    return {"ranges": [str(each) for each in message.ranges]}


def image(message):
    """Return the content of an Image without its pixels."""
    return {"size": [message.width, message.height], "encoding": message.encoding, "bytes": len(message.data)}


if __name__ == "__main__":
    main()
