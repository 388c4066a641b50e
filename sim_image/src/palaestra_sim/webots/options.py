"""The controllerArgs of a robot, as Webots passes them to the controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.errors import SimError
from palaestra_sim.scene.arguments import ControllerArguments

_NAME: Final = "--name="
_MASTER: Final = "--ROS_MASTER_URI="
_FLAGS: Final = ("--synchronize", "--clock", "--auto-publish")
_REFUSED: Final = ("--use-sim-time", "--use-ros-control", "--robot-description")


class OptionError(SimError, ValueError):
    """The controllerArgs of a robot are wrong; the message has the argument and the remedy."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerOptions(ControllerArguments):
    """The options of one controller.

    Attributes:
        master_uri: the URI of the ROS master, if an argument names one; else "".
        unknown: the other arguments, which have no effect, as in Webots' controller.
    """

    master_uri: str
    unknown: tuple[str, ...]


def read_options(arguments: Sequence[str]) -> ControllerOptions:
    """Return the options in controllerArgs.

    Raises:
        OptionError: a required argument is missing, or this controller does not support an argument.
    """
    names = [it.removeprefix(_NAME) for it in arguments if it.startswith(_NAME)]
    if not names or not names[-1]:
        raise OptionError(
            "controllerArgs has no --name=; add --name=NAME, the prefix of the robot's ROS names"
        )
    if "--synchronize" not in arguments:
        raise OptionError(
            "controllerArgs has no --synchronize; add it, because this controller steps only on request"
        )
    refused = [it for it in arguments if it.partition("=")[0] in _REFUSED]
    if refused:
        raise OptionError(
            f"controllerArgs has {refused[0]}, which this controller does not support; remove it"
        )
    masters = [it.removeprefix(_MASTER) for it in arguments if it.startswith(_MASTER)]
    return ControllerOptions(
        name=names[-1],
        clock="--clock" in arguments,
        auto_publish="--auto-publish" in arguments,
        master_uri=masters[-1] if masters else "",
        unknown=tuple(it for it in arguments if it not in _FLAGS and not it.startswith((_NAME, _MASTER))),
    )
