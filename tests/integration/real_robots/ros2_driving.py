"""A program that drives a robot over ROS 2, and writes its last readings as JSON.

Arguments: the address, the speed of the robot's clock, and the robot's speed in m/s for 6 periods.
"""

import json
import sys

from palaestra_trainer.errors import TrainerError
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.ros2 import Ros2Link
from palaestra_trainer.real_robots.safety import SafetyRules


def main():
    """Drive, and write pose, distances and bumper, or the error."""
    address, speed, forward = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    clock = RobotClock(speed)
    try:
        with RealRobotino(Ros2Link(address, clock=clock), SafetyRules(speed_m_s=0.5), clock=clock) as robot:
            robot.connect()
            for _ in range(6):
                robot.drive(forward, 0.0, 0.0)
                robot.advance()
            robot.stand()
            robot.advance()
            found = {
                "x": robot.pose().x_m,
                "distances": robot.distances().tolist(),
                "bumped": robot.bumped(),
            }
    except TrainerError as error:
        found = {"error": f"{type(error).__name__}: {error}"}
    print(json.dumps(found))  # noqa: T201


if __name__ == "__main__":
    main()
