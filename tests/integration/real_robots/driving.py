"""A program that drives a robot to and fro until the test kills it, cuts its network or makes it fail."""

import signal
import sys
import threading

from palaestra_trainer.real_robots.command_loop import Hooks
from palaestra_trainer.real_robots.connect import link_to
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.safety import SafetyRules
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.run.signals import Interruption


def main():
    """Drive the robot.

    The arguments are the robot's address, the speed of its clock, and the policy's action after four periods:
    `go` continues, `hang` waits forever, and `raise` raises an error.
    """
    address, speed, then = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    clock = RobotClock(speed)
    with Interruption() as interruption:
        hooks = Hooks(check=interruption.check)
        link = link_to(address, SensorLayout(), clock)
        with RealRobotino(link, SafetyRules(speed_m_s=0.5), clock=clock, hooks=hooks) as robot:
            robot.connect()
            for step in range(10_000):
                robot.drive(0.5 if step % 12 < 6 else -0.5, 0.0, 0.0)
                robot.advance()
                if step == 3:
                    print("driving", flush=True)  # noqa: T201
                    if then == "hang":
                        robot.drive(0.5, 0.0, 0.0)
                        threading.Event().wait()
                    if then == "raise":
                        raise ZeroDivisionError


if __name__ == "__main__":
    signal.alarm(120)  # ends this program soon even if the test that started it was killed
    main()
