"""Robots on one line, for the worlds that a test writes."""

COMPLETE = '\nRobot { name "robotino" controller "ros" controllerArgs ["--name=NAME" "--synchronize"] }'
"""A robot in which the generator changes only the name."""


def robot(arguments: str, name: str = "robotino") -> str:
    """Return a robot on one line, with this text of arguments."""
    return f'Robot {{ name "{name}" controller "ros" {arguments} }}'
