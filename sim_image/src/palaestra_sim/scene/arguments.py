"""Read the controllerArgs of a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.validation import NodeReader

# With these arguments, the controller of Webots steps by itself, or lets other programs control the motors.
# Our simulators do not support these arguments.
_REFUSED: Final = ("--use-sim-time", "--use-ros-control")


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerArguments:
    """The arguments that a simulator uses; like the controller of Webots, it ignores all other arguments.

    Attributes:
        name: the name of the ROS node, and the prefix of all its paths.
        clock: whether to publish /clock.
        auto_publish: whether every sensor is enabled from the start.
    """

    name: str
    clock: bool = False
    auto_publish: bool = False


def read_arguments(reading: NodeReader, node: SceneNode) -> ControllerArguments:
    """Return the arguments of a robot whose controller is "ros".

    `--name` is required, because without this argument the topics of two robots would have the same names.
    `--synchronize` is required, because without this argument no client controls the steps.
    """
    texts = node.texts("controllerArgs")
    names = [text.removeprefix("--name=") for text in texts if text.startswith("--name=")]
    if not names and not reading.leave_out.names:
        reading.refuse(node, "controllerArgs without --name=", "add --name=NAME")
    if "--synchronize" not in texts and not reading.leave_out.names:
        fact = f"controllerArgs without --synchronize: {reading.simulator} steps only on request"
        reading.refuse(node, fact, "add it")
    for text in texts:
        if text in _REFUSED:
            reading.lacks(node, f"{reading.simulator} does not know {text}")
    name = names[-1] if names else ""
    return ControllerArguments(name=name, clock="--clock" in texts, auto_publish="--auto-publish" in texts)
