"""The mock robot's driver and our connection, each with a program of rospy at the other end."""

import importlib.util
import subprocess
import sys

import pytest

from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.real_robots.ros1 import Ros1Link
from tests.mock_robots import ended, started
from tests.waiting import eventually

pytestmark = pytest.mark.skipif(importlib.util.find_spec("rospy") is None, reason="rospy is not installed")

DRIVER = """
import sys, rospy
from geometry_msgs.msg import Twist
rospy.init_node("robotino_node", disable_signals=True)
odometry = rospy.Publisher("odom", Twist, queue_size=1)  # nav_msgs may be missing
rospy.Subscriber("cmd_vel", Twist, lambda it: print(it.linear.x, it.linear.y, it.angular.z, flush=True))
print("ready", flush=True)
sys.stdin.read()
"""
TELEOPERATION = """
import rospy
from geometry_msgs.msg import Twist
rospy.init_node("teleoperation", disable_signals=True)
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
rate = rospy.Rate(50)
twist = Twist()
twist.linear.x = 0.3
while True:
    publisher.publish(twist)
    rate.sleep()
"""
SENSORS = """
import os, sys, rospy
from std_msgs.msg import Bool
from sensor_msgs.msg import PointCloud
rospy.init_node("viewer", disable_signals=True)
def show(kind, value):
    os.write(1, f"{kind} {value}\\n".encode())  # one write per line, because each topic has a thread
rospy.Subscriber("bumper", Bool, lambda it: show("bumper", it.data))
rospy.Subscriber("distance_sensors", PointCloud, lambda it: show(it.header.frame_id, len(it.points)))
sys.stdin.read()
"""


@pytest.fixture
def program(monkeypatch):
    """Yield a function that starts a program of rospy in a namespace."""
    running = []

    def start(text, namespace):
        monkeypatch.setenv("ROS_NAMESPACE", namespace)
        words = [sys.executable, "-c", text]
        running.append(subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        return running[-1]

    yield start
    for each in running:
        each.kill()
        each.communicate()


def test_a_driver_of_rospy_receives_our_commands(master, program):
    """The driver of a real robot is another project's program, and uses rospy."""
    driver = program(DRIVER, "theirs")
    assert driver.stdout.readline() == "ready\n"
    link = Ros1Link(master.replace("http:", "ros1:").rstrip("/") + "/theirs")
    link.start(ReadingStore())
    link.send((0.25, -0.5, 1.0))
    received = driver.stdout.readline()
    link.close()

    assert received == "0.25 -0.5 1.0\n"


@pytest.mark.usefixtures("master")
def test_programs_of_rospy_drive_the_mock_and_see_its_sensors(program):
    """A person tries a program of a laboratory with the mock."""
    program(TELEOPERATION, "ours")
    viewer = program(SENSORS, "ours")
    process, mock = started("--ros1", "--speed=2", "--start=1.5,0,0")
    try:
        speed = eventually(lambda: mock.get("/mock/truth")["vx"], pace_s=0.01)
        lines = {viewer.stdout.readline()}
        while len(lines) < 2:
            lines.add(viewer.stdout.readline())
    finally:
        ended(process, mock)

    assert 0.0 < speed < 0.2001
    assert lines == {"bumper True\n", "base_link 9\n"}
