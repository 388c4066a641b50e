"""A small ROS 2 driver of a mock robot, with the topics and the QoS of rto_node.

Arguments: the address of the mock robot, the speed of its clock, and options. `--clock` publishes /clock.
`--best-effort` publishes odometry and the scan with best-effort QoS. `--latched` keeps the bumper's last
state for later subscribers. `--camera` publishes pictures with the QoS of ROS 2 for sensors. A line `FRAME X
Y` on standard input publishes a goal. The driver writes `ready` when it has started.
"""

import math
import sys
import threading

import rclpy
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import Bool

from tests.mock_robots import Client

RATE_HZ = 30.0
CLOCK_HZ = 100.0
PICTURE = (160, 120)
RADIUS_M = 0.225  # rto_node measures the ranges of its scan from the center of the robot


class Driver:
    """Forwards readings and commands between a mock robot and the topics of a node."""

    def __init__(self, node, address, speed, options):
        self.node = node
        self.robot, self.clock = Client(address), Client(address)
        self.bumped = None
        self.over = False
        effort = ReliabilityPolicy.BEST_EFFORT if "--best-effort" in options else ReliabilityPolicy.RELIABLE
        kept = DurabilityPolicy.TRANSIENT_LOCAL if "--latched" in options else DurabilityPolicy.VOLATILE
        sensors = QoSProfile(depth=10, reliability=effort)
        self.odom = node.create_publisher(Odometry, "odom", sensors)
        self.scan = node.create_publisher(LaserScan, "irsensor_scan", sensors)
        self.bumper = node.create_publisher(Bool, "bumper", QoSProfile(depth=10, durability=kept))
        self.goal = node.create_publisher(PoseStamped, "goal_pose", 10)
        self.times = node.create_publisher(Clock, "/clock", 10)
        node.create_subscription(Twist, "cmd_vel", self.command, 10)
        node.create_timer(1.0 / RATE_HZ / speed, self.read)
        if "--camera" in options:
            self.images = node.create_publisher(Image, "image_raw", qos_profile_sensor_data)
            node.create_timer(1.0 / RATE_HZ / speed, self.look)
        if "--clock" in options:
            node.create_timer(1.0 / CLOCK_HZ / speed, self.tick)

    def command(self, message):
        """Forward a command."""
        self.robot.send("/data/omnidrive", [message.linear.x, message.linear.y, message.angular.z])

    def read(self):
        """Publish all readings, but the bumper's state only when it changes, as rto_node does."""
        x, y, heading, *velocity, _ = self.robot.get("/data/odometry")
        odometry = Odometry()
        odometry.header.frame_id, odometry.child_frame_id = "odom", "base_link"
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = float(x), float(y)
        orientation = odometry.pose.pose.orientation
        orientation.z, orientation.w = math.sin(heading / 2.0), math.cos(heading / 2.0)
        odometry.twist.twist.linear.x, odometry.twist.twist.linear.y = map(float, velocity[:2])
        odometry.twist.twist.angular.z = float(velocity[2])
        self.odom.publish(odometry)
        distances = self.robot.get("/data/distancesensorarray")
        scan = LaserScan(angle_increment=math.radians(40.0), range_min=0.05, range_max=0.65)
        scan.ranges = [distance + RADIUS_M for distance in distances]
        self.scan.publish(scan)
        bumped = self.robot.get("/data/bumper")["value"]
        if bumped != self.bumped and not (self.bumped is None and not bumped):
            self.bumper.publish(Bool(data=bumped))
        self.bumped = bumped

    def look(self):
        """Publish a picture."""
        width, height = PICTURE
        pixels = self.robot.picture(PICTURE)[:, :, ::-1]
        self.images.publish(
            Image(width=width, height=height, encoding="bgr8", step=3 * width, data=pixels.tobytes())
        )

    def tick(self):
        """Publish the robot's time."""
        time_s = self.clock.get("/mock/truth")["time_s"]
        message = Clock()
        message.clock.sec, message.clock.nanosec = int(time_s), int(time_s % 1.0 * 1e9)
        self.times.publish(message)

    def send_goals(self):
        """Publish a goal for each line of standard input; the end of the input ends the driver."""
        for line in sys.stdin:
            frame, x, y = line.split()
            goal = PoseStamped()
            goal.header.frame_id = frame
            goal.pose.position.x, goal.pose.position.y = float(x), float(y)
            self.goal.publish(goal)
        self.over = True


def main():
    """Serve until standard input ends."""
    rclpy.init(args=sys.argv)
    driver = Driver(rclpy.create_node("rto_node"), sys.argv[1], float(sys.argv[2]), sys.argv[3:])
    threading.Thread(target=driver.send_goals, daemon=True).start()
    print("ready", flush=True)  # noqa: T201
    while not driver.over:
        rclpy.spin_once(driver.node, timeout_sec=0.1)


if __name__ == "__main__":
    main()
