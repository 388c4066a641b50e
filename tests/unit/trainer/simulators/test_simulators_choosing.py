"""The class of a job's robot decides which robot of the world it drives."""

from palaestra_protocol.control import RobotName
from palaestra_trainer.simulators.simulator import driven_robot

GATE = RobotName(robot="gate", ros_name="gate", supervisor=False, definition="GATE")
FIRST = RobotName(robot="one", ros_name="one", supervisor=False, definition="ROVER_1")
SECOND = RobotName(robot="two", ros_name="two", supervisor=False, definition="ROVER_2")
REFEREE = RobotName(robot="referee", ros_name="referee", supervisor=True, definition="REFEREE")


def test_a_class_drives_the_robot_that_it_names():
    """Two equal robots have devices with equal names, so only their DEF names distinguish them."""
    assert driven_robot([GATE, FIRST, SECOND, REFEREE], "ROVER_2") is SECOND


def test_a_class_may_name_the_supervisor():
    """The robot that learns is often its own supervisor, in a world with other robots."""
    assert driven_robot([GATE, REFEREE], "REFEREE") is REFEREE


def test_a_class_without_a_name_drives_the_first_robot_that_is_no_supervisor():
    """A class with a DEF name that no robot has drives this robot too; the DEF may be only in a PROTO."""
    assert driven_robot([REFEREE, GATE, FIRST], "") is GATE
    assert driven_robot([REFEREE, GATE, FIRST], "ROVER_9") is GATE
    assert driven_robot([REFEREE], "") is None
