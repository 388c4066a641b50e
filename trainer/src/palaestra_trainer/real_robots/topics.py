"""Topics that a person names in place of those of a robot's driver, as NAME=TOPIC.

NAME is the driver's default name of the topic. If no topic of the driver is renamed, none needs to be given.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Final

from palaestra_trainer.errors import ConfigurationError

Topics = Mapping[str, str]

ROS1: Final = ("bumper", "cmd_vel", "distance_sensors", "image_raw", "odom")
ROS2: Final = (*ROS1, "irsensor_scan")
_PART: Final = "[A-Za-z][A-Za-z0-9_]*"
_FORM: Final = re.compile(f"([a-z_0-9]+)=(/?{_PART}(?:/{_PART})*)")


def topics_of(given: Sequence[str]) -> dict[str, str]:
    """Return the topics in texts such as `odom=/robot/odom`, by the names of the driver.

    Raises:
        ConfigurationError: a text has another form, or a name occurs twice.
    """
    topics = dict[str, str]()
    for text in given:
        if (found := _FORM.fullmatch(text)) is None:
            raise ConfigurationError(f"--topic: {text!r} is not NAME=TOPIC, such as odom=/robot/odom")
        name, topic = found.groups()
        if name in topics:
            raise ConfigurationError(f"--topic: {name} is given twice; give one topic")
        topics[name] = topic
    return topics


def refuse_unknown(topics: Topics, known: Collection[str]) -> None:
    """Refuse a name that the connection neither reads nor publishes.

    Raises:
        ConfigurationError: a name is not one of `known`.
    """
    for name in topics:
        if name not in known:
            raise ConfigurationError(
                f"--topic: {name!r} is neither read nor published; use one of {', '.join(sorted(known))}"
            )


def remaps(topics: Topics) -> list[str]:
    """Return the arguments of ROS 2 that give a node these topics."""
    rules = [word for name, topic in topics.items() for word in ("-r", f"{name}:={topic}")]
    return ["--ros-args", *rules, "--"] if rules else []
