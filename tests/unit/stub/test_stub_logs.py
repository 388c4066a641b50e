"""The log of a controller: `/rosout` and the log level, as in each roscpp node."""

import pytest

from palaestra_sim.ros.node import ServiceFailed


def test_a_refusal_is_logged(robot):
    """A person with `rqt_console` sees the mistake of the client."""
    inbox = robot.inbox("/rosout")
    with pytest.raises(ServiceFailed):
        robot.call("wheel0_joint/set_torque", value=1.0)

    (message,) = inbox
    assert message["name"] == "/robotino"
    assert message["level"] == 8
    assert message["msg"].startswith("wheel0_joint/set_torque: torques are not simulated")
    assert message["header"]["stamp"]["secs"] > 0


def test_a_higher_level_silences_it(robot):
    """`rosservice call /robotino/set_logger_level ros fatal` has the same effect."""
    inbox = robot.inbox("/rosout")
    robot.call("set_logger_level", logger="ros", level="FATAL")
    with pytest.raises(ServiceFailed):
        robot.call("wheel0_joint/set_torque", value=1.0)

    assert inbox == []
    assert ("ros", "fatal") in [tuple(it) for it in robot.get("get_loggers")]


def test_an_unknown_level_is_refused(robot):
    """A person who mistypes a level needs the list of the five levels of ROS."""
    with pytest.raises(ServiceFailed, match="'loud' is not a level; use debug, info, warn, error, fatal"):
        robot.call("set_logger_level", logger="ros", level="loud")
