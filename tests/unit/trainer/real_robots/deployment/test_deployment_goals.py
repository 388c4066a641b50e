"""Goals of a policy node: the newest one counts, and between goals no command is sent."""

import pytest

from palaestra_trainer.real_robots.deployment.goals import Goals, NewGoal, QuietLink
from palaestra_trainer.waiting.check import go_on


class NotedLink:
    """A connection that keeps its commands."""

    address = "ros2:"

    def __init__(self):
        self.sent = []

    def send(self, twist):
        """Keep a command."""
        self.sent.append(twist)


def test_the_newest_goal_is_taken_and_then_no_goal_waits():
    """A person who gives a second goal no longer wants the first one."""
    goals = Goals()
    goals.put((1.0, 0.0))
    goals.put((0.0, 0.0))

    assert goals.waits
    assert goals.take(go_on) == (0.0, 0.0)
    assert not goals.waits


def test_the_wait_for_a_goal_ends_when_the_check_raises():
    """Ctrl-C makes the check raise, and must end a node that has no goal."""

    def check():
        raise NewGoal

    with pytest.raises(NewGoal):
        Goals().take(check)


def test_a_quiet_connection_sends_nothing():
    """Other nodes may drive the robot while the policy has no goal."""
    noted = NotedLink()
    link = QuietLink(noted)
    link.send((0.1, 0.0, 0.0))
    link.quiet = False
    link.send((0.2, 0.0, 0.0))

    assert link.address == "ros2:"
    assert noted.sent == [(0.2, 0.0, 0.0)]
