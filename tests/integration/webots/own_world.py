"""A simulator with a world of the test's own, whose robot `r` has DEF name R and is a supervisor."""

from contextlib import contextmanager

from palaestra_trainer.robots.simulated import SimulatedRobot
from palaestra_trainer.webots import Webots
from tests.values.worlds import STEP_MS

DEADLINE_S = 60.0


class OwnRobot(SimulatedRobot):
    """A robot without devices in a world without a mark; a subclass adds devices in `equip`."""

    period_ms = STEP_MS
    target = None


@contextmanager
def running(text, folder, driver, kind=OwnRobot, name="r"):
    """Yield facade and robot of a simulator that has this world, after one step.

    Args:
        text: the text of the world file.
        folder: the folder for this file.
        driver: the name of the simulator.
        kind: the class of the robot.
        name: the ROS name of the robot, which is the supervisor.
    """
    world = folder / "world.wbt"
    world.write_text(text)
    webots = Webots(name, world, driver=driver, start_deadline_s=DEADLINE_S)
    robot = kind(webots)
    try:
        with webots:
            robot.advance()
            yield webots, robot
    finally:
        robot.close()
        webots.close()
