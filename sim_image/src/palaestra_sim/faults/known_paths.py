"""Find the services and topics of a world.

The controllers of the world are started with nodes that only record the names of services and topics. With
this list, a fault with an unknown path is an error at the start. Otherwise the fault would never occur, and
its author would not notice.
"""

from __future__ import annotations

import contextlib
import difflib
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import filter as matching
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from palaestra_sim.faults.fault_state import FaultState
from palaestra_sim.faults.kinds import InjectedFault
from palaestra_sim.faults.options import Ordered
from palaestra_sim.faults.parser import FaultError
from palaestra_sim.faults.schedule import FaultSchedule, Life
from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.controller import RosController
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.ros_controller.served_robot import ServedRobot
from palaestra_sim.ros_controller.simulator import Load, RunningSimulator
from palaestra_sim.ros_interfaces import Fields, Handler

_ENABLES = ("/enable", "/recognition_enable")
_HASH = re.compile(r"_[0-9a-f]{6}$")  # the end of a generated ROS name; this end differs from job to job


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownPaths:
    """The services and topics of a world.

    Attributes:
        simulator: the name of the first robot, without the part that differs from job to job.
        services: the type of each service, by its path relative to the robot.
        topics: the type of each topic, by its path relative to the robot, including the topics of sensors
            that are not yet enabled.
    """

    simulator: str
    services: Mapping[str, str]
    topics: Mapping[str, str]


def survey(load: Load, world_path: Path) -> KnownPaths:
    """Return the services and topics of the world in the file `world_path`; `load` loads this world.

    Raises:
        WorldError: the file is wrong, or contains a node that cannot be simulated.
        OSError: the file cannot be read.
    """
    nodes: list[_Listener] = []

    def make_node(name: str) -> _Listener:
        nodes.append(_Listener(name))
        return nodes[-1]

    simulator = RunningSimulator(world_path, load, make_node)
    simulator.start()
    for node in nodes:
        node.enable_all(simulator.simulation.basic_step_ms)
    return KnownPaths(
        simulator=_HASH.sub("", nodes[0].name) if nodes else "",
        services={path: type_name for node in nodes for path, type_name in node.types.items()},
        topics={path: type_name for node in nodes for path, type_name in node.topics.items()},
    )


def survey_robot(robot: ServedRobot, name: str) -> KnownPaths:
    """Return the services and topics of one robot, whose ROS name is `name`; its sensors stay as they are."""
    node = _Listener(name)
    RosController(robot, node, FrontOptions(), lambda: 0.0).start()
    topics = {
        f"{device.path}/{topic.name}": topic.type_name
        for device in (*robot.devices, *robot.inputs)
        for topic in (*device.topics, *(it for stream in device.streams for it in stream.topics))
    }
    return KnownPaths(simulator=_HASH.sub("", name), services=node.types, topics=topics | node.topics)


def begin(ordered: Ordered, found: KnownPaths) -> FaultState:
    """Return the fault state of this process, for the faults `ordered` and the paths of its world.

    Raises:
        FaultError: a fault names a path that the world does not have.
    """
    check(ordered.faults, found)
    life = Life(seed=ordered.seed, simulator=found.simulator, number=ordered.life)
    return FaultState(FaultSchedule(faults=ordered.faults, life=life))


def check(faults: Iterable[InjectedFault], found: KnownPaths) -> None:
    """Check that the paths of every fault exist.

    Raises:
        FaultError: the world has no such service or topic.
    """
    for fault in faults:
        for what, path, known in (
            ("service", fault.service, found.services),
            ("topic", fault.topic, found.topics),
        ):
            if path and not matching(known, path):
                near = difflib.get_close_matches(path, known, cutoff=0.4) or sorted(known)[:3]
                fact = f"the world has no {what} {path}"
                raise FaultError(f"fault {fault.text}: {fact}; name another, such as {', '.join(near)}")


class _Silent:
    """A publisher without subscribers."""

    heard = False

    def send(self, fields: Fields) -> None:
        """Do nothing: it has no subscriber."""

    def send_stamped(self, fields: Fields) -> None:
        """Do nothing: it has no subscriber."""

    def send_value(self, value: float) -> None:
        """Do nothing: it has no subscriber."""


class _Listener:
    """A node that records its services and topics."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.blocked: Callable[[], bool] = lambda: False
        self.current_call: object | None = None
        self.services: dict[str, Handler] = {}
        self.types: dict[str, str] = {}
        self.topics: dict[str, str] = {}

    def enable_all(self, period_ms: int) -> None:
        """Enable every sensor, because only an enabled sensor has a topic; ignore devices that refuse."""
        for path, handler in self.services.items():
            if path.endswith(_ENABLES):
                with contextlib.suppress(ServiceFailed):
                    handler(SimpleNamespace(value=period_ms))

    def serve(self, path: str, type_name: str, handler: Handler) -> None:
        """Record a service."""
        self.services[path] = handler
        self.types[path] = type_name

    def together(self) -> contextlib.AbstractContextManager[None]:
        """Do nothing: this node registers no names."""
        return contextlib.nullcontext()

    def advertise(
        self,
        path: str,
        type_name: str,
        *,
        latched: bool = False,
        template: Fields | None = None,
        reading: str = "",
    ) -> _Silent:
        """Record a topic."""
        del latched, template, reading
        self.topics[path] = type_name
        return _Silent()

    def withdraw(self, publisher: Any) -> None:
        """Do nothing: the topic stays in the record."""

    def answer(self, call: Any, fields: Fields) -> None:
        """Do nothing: this node has no clients."""

    def later(self, delay_s: float, callback: Callable[[], None]) -> None:
        """Do nothing: only steps use delays, and no step runs here."""

    def close(self) -> None:
        """Do nothing: this node has no sockets."""
