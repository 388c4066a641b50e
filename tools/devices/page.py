"""The devices of the stub, in docs/reference/simulators.md: a row for each row of the stub's own table."""

from __future__ import annotations

from typing import Any

from palaestra.api.generated_sections import between_marks
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.device_type import DeviceType
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics

PAGE = "docs/reference/simulators.md"
BEGIN = "<!-- generated: devices of the stub -->"


def page(text: str) -> str:
    """Return docs/reference/simulators.md with a new table; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, table())


def table() -> str:
    """Return a row for each type of device: its topics, services, and fields without effect."""
    rows = (_row(kind) for kind in DEVICES.values())
    return "\n".join(("| node | topics | services | fields without effect |", "|---|---|---|---|", *rows, ""))


def _row(kind: DeviceType[Any]) -> str:
    device = _device(kind)
    topics = ", ".join(f"`{it.name}` ({it.type_name})" for it in kind.topics(device))
    services = ", ".join(f"`{path}`" for path, _, _ in kind.services(device))
    ignored = ", ".join(f"`{name}`" for name in kind.without_effect.split())
    return f"| {kind.node} | {topics} | {services} | {ignored} |"


def _device(kind: DeviceType[Any]) -> object:
    """Return a device of a type, from a world that has only this device."""
    node = f"{kind.node} {{ }}"
    part = f"HingeJoint {{ device {node} }}" if kind.on_joint else node
    world = f"#VRML_SIM R2023b utf8\nRobot {{ children [ {part} ] }}\n"
    (robot,) = Simulation.load(world.encode(), StubPhysics()).robots
    (device,) = robot.parts.devices.of(kind)
    return device
