"""A ROS node that applies faults to its requests, responses and messages.

The node wraps each connection. After the header of a connection, the wrapper forwards, changes, delays or
drops each message, as the fault state decides. In all other respects, the node behaves like a `RosNode`. A
stub without faults uses `RosNode` itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from palaestra_protocol.ros.rostypes import Codec
from palaestra_sim.faults.corruption import damaged_answer, damaged_message
from palaestra_sim.faults.fault_state import Damage, FaultState, Ruling
from palaestra_sim.faults.kinds import STEP_PATH
from palaestra_sim.faults.process_faults import ProcessFaults
from palaestra_sim.ros.links import Connection, Endpoint
from palaestra_sim.ros.loop import Loop
from palaestra_sim.ros.node import RosNode, ServiceEnd
from palaestra_sim.ros.topics import PublishedTopic


@dataclass(frozen=True, slots=True, kw_only=True)
class Failing:
    """The fault state and the process faults, which all nodes of one stub share."""

    course: FaultState
    effects: ProcessFaults


class FaultyNode(RosNode):
    """A RosNode with injected faults.

    Args:
        loop: the event loop of the node's sockets.
        name: the node's name and the prefix of its relative paths.
        master_uri: the URI of the ROS master.
        failing: the faults, which all nodes of a stub share.
    """

    def __init__(self, loop: Loop, name: str, master_uri: str, failing: Failing) -> None:
        super().__init__(loop, name, master_uri)
        self._failing = failing
        self._held_steps = 0
        self._master_lost = False

    def lose_master(self) -> None:
        """Record that `close` must leave the names of this node registered at the master."""
        self._master_lost = True

    def close(self) -> None:
        """Close like a RosNode; after `lose_master`, leave the names registered."""
        self._failing.course.closed(self.name)
        if self._master_lost:
            self.abandon()
        else:
            super().close()

    def request(self, end: ServiceEnd, payload: bytes) -> None:
        """Handle a request; if a slow step is in progress, handle it after the step."""
        if self._held_steps:
            self._waiting.append((end, payload))
        else:
            super().request(end, payload)

    def take_waiting(self) -> None:
        """Handle the waiting requests, unless a slow step is in progress."""
        if not self._held_steps:
            super().take_waiting()

    def receive(self, path: str, answers: _Answers, pass_on: Callable[[], None]) -> None:
        """Forward, delay or drop a request from a connection, as the fault state decides."""
        ruling = self._failing.course.request(self.name, path)
        if not self._failing.effects.happen(ruling.effects) or ruling.lost:
            return
        answers.damages = ruling.damages
        if ruling.delay_s > 0.0:
            self._hold(path, ruling, answers, pass_on)
        else:
            pass_on()

    def _hold(self, path: str, ruling: Ruling, answers: _Answers, pass_on: Callable[[], None]) -> None:
        held = int(path == STEP_PATH)
        self._held_steps += held

        def release() -> None:
            self._held_steps -= held
            if not answers.closed:
                pass_on()
            self.later(0.0, self.take_waiting)

        self.later(ruling.delay_s, release)

    def _greet(self, link: Connection, header: Mapping[str, str]) -> Endpoint:
        if "service" in header:
            return self._greet_faulty_client(link, header)
        name = header.get("topic", "")
        messages = _Messages(self, link, self._failing.course, self._path(name), self._topics.get(name))
        return super()._greet(messages, header)

    def _greet_faulty_client(self, link: Connection, header: Mapping[str, str]) -> Endpoint:
        name = header["service"]
        known = self._services.get(name)
        answers = _Answers(link, None if known is None else known[0].response)
        return _Requests(self, self._path(name), answers, super()._greet(answers, header))

    def _path(self, name: str) -> str:
        """Return a name in the form of fault descriptions: relative to the robot, or global (`/`)."""
        return name.removeprefix(f"/{self.name}/")


class _Requests:
    """Receives the requests of one client to one service, and applies faults to them."""

    def __init__(self, node: FaultyNode, path: str, answers: _Answers, endpoint: Endpoint) -> None:
        self._node = node
        self._path = path
        self._answers = answers
        self._endpoint = endpoint

    def receive(self, payload: bytes) -> None:
        self._node.receive(self._path, self._answers, lambda: self._endpoint.receive(payload))

    def lost(self) -> None:
        self._endpoint.lost()


class _Answers:
    """The connection of a service's client; the class changes responses as faults require.

    Attributes:
        link: the wrapped connection.
        damages: the changes to the next response.
    """

    def __init__(self, link: Connection, response: Codec | None) -> None:
        self.link = link
        self.damages: tuple[Damage, ...] = ()
        self._response = response

    @property
    def closed(self) -> bool:
        return self.link.closed

    def send(self, data: bytes) -> None:
        damages, self.damages = self.damages, ()
        if damages and self._response is not None:
            data = damaged_answer(self._response, data, damages)
        self.link.send(data)

    def send_newest(self, data: bytes) -> None:
        self.link.send_newest(data)

    def finish(self) -> None:
        self.link.finish()

    def close(self) -> None:
        self.link.close()


class _Messages:
    """The connection of a subscriber; the class drops, delays or changes messages as faults require.

    Attributes:
        link: the wrapped connection.
    """

    def __init__(
        self, node: FaultyNode, link: Connection, course: FaultState, path: str, topic: PublishedTopic | None
    ) -> None:
        self.link = link
        self._node = node
        self._course = course
        self._path = path
        self._topic = topic

    @property
    def closed(self) -> bool:
        return self.link.closed

    def send(self, data: bytes) -> None:
        self.link.send(data)

    def send_newest(self, data: bytes) -> None:
        ruling = self._course.message(self._path)
        if ruling.lost:
            return
        if ruling.damages and self._topic is not None:
            data = damaged_message(self._topic.type.name, data, ruling.damages, self._topic.reading)
        if ruling.delay_s > 0.0:
            self._node.later(ruling.delay_s, lambda: self._send_late(data))
        else:
            self.link.send_newest(data)

    def finish(self) -> None:
        self.link.finish()

    def close(self) -> None:
        self.link.close()

    def _send_late(self, data: bytes) -> None:
        if not self.closed:
            self.link.send_newest(data)
