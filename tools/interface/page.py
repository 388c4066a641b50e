"""docs/reference/ros-interface.md: each service and topic with its type, md5, facade and simulators."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Final

from palaestra.api.generated_sections import between_marks
from palaestra_protocol.ros.rostypes import message_type, service_type
from palaestra_sim.scene.devices import DEVICES
from tools.interface import plan
from tools.interface.everything import FAILING, NOT_IN_WEBOTS, device_name, groups, offered
from tools.interface.facades import facade

PAGE = "docs/reference/ros-interface.md"
INTERFACE = "trainer/src/palaestra_trainer/ros/conformance/interface.json"
BEGIN = "<!-- generated: services and topics -->"
_TEST: Final = "test_ros_interface.py"
_OURS: Final = frozenset(("palaestra",))
_TITLES: Final = {
    "node": "Every node",
    "robot": "Robot",
    "supervisor": "Supervisor",
    "supervisor/node": "Supervisor: nodes",
    "supervisor/field": "Supervisor: fields",
    "battery_sensor": "Battery",
    "keyboard": "Keyboard",
    "joystick": "Joystick",
    "palaestra": "Services that Webots lacks",
    "": "Topics that are not below a robot",
}
_HEAD: Final = (
    "| path | type | md5 | Python | stub | MuJoCo | Webots | tested by |",
    "|---|---|---|---|---|---|---|---|",
)


def page(text: str) -> str:
    """Return docs/reference/ros-interface.md with new tables; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, tables())


def tables() -> str:
    """Return a table for the robot, the supervisor, each type of device, and our additional services."""
    surveys = [offered(simulator) for simulator in FAILING]
    services = groups({path: it for survey in surveys for path, it in survey.services.items()})
    topics = groups({path: it for survey in surveys for path, it in survey.topics.items()})
    sections = (
        _section(group, services.get(group, {}), topics.get(group, {}))
        for group in [*services, *(topics.keys() - services.keys())]
    )
    return "\n".join(sections)


def _section(group: str, services: Mapping[str, str], topics: Mapping[str, str]) -> str:
    rows = [_row(group, path, type_name, service_type(type_name).md5) for path, type_name in services.items()]
    rows += [_row(group, path, type_name, message_type(type_name).md5) for path, type_name in topics.items()]
    return "\n".join((f"### {_TITLES.get(group, group)}", "", *_HEAD, *rows, ""))


def _row(group: str, path: str, type_name: str, md5: str) -> str:
    shown = path.replace(device_name(group), "<name>", 1) if group in DEVICES else path
    states = " | ".join(_state(simulator, path) for simulator in FAILING)
    webots = "no" if group in _OURS or path in NOT_IN_WEBOTS else "yes"
    member = facade(group, path)
    python = f"`{member}`" if member else ""
    return f"| `{shown}` | {type_name} | `{md5}` | {python} | {states} | {webots} | {_TEST} |"


def _state(simulator: str, path: str) -> str:
    """Return `yes`, `fails` or `no` for a path in one of our simulators."""
    survey = offered(simulator)
    if path not in survey.services and path not in survey.topics:
        return "no"
    return "fails" if path in FAILING[simulator] else "yes"


def interface_file() -> str:
    """Return the content of `INTERFACE`."""
    return json.dumps(plan.interface(), indent=1) + "\n"
