"""The client of the conformance program: each call and topic with a deadline, without an installed ROS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.ros import RosService, RosSubscriber
from palaestra_trainer.ros.conformance.claims import FAILED, Answer
from palaestra_trainer.ros.conformance.player import plain

_DEADLINE_S: Final = 30.0  # at the first camera a simulator loads OpenGL, which may take long


class WireClient:
    """Calls services and subscribes to topics; `close` ends all connections."""

    def __init__(self) -> None:
        self._topics: dict[str, RosSubscriber] = {}
        self._heard: dict[str, Any] = {}

    def call(self, path: str, type_name: str, request: Mapping[str, Any]) -> Answer:
        """Call a service with a connection of its own; return the response, or the reason of the failure."""
        service = RosService(path, type_name, _DEADLINE_S)
        try:
            answer: Answer = plain(service(**request))
        except SimulatorFault as fault:
            return {FAILED: str(fault)}
        finally:
            service.close()
        return answer

    def listen(self, topic: str, type_name: str) -> None:
        """Subscribe to a topic, unless it is subscribed already or no node publishes it now."""
        if topic in self._topics:
            return
        subscriber = RosSubscriber(topic, type_name)
        try:
            subscriber.connect()
        except SimulatorFault:
            subscriber.close()
            return
        self._topics[topic] = subscriber

    def messages(self, topic: str) -> Sequence[Any]:
        """Return the messages of a topic that have arrived since the last call.

        Raises:
            SimulatorFault: the connection was lost, or a message cannot be read.
        """
        subscriber = self._topics.get(topic)
        return [] if subscriber is None else [plain(message) for message in subscriber.arrived()]

    def heard(self) -> Mapping[str, Any]:
        """Return the first message of each topic that has sent one."""
        for topic, subscriber in self._topics.items():
            try:
                messages = subscriber.arrived()
            except SimulatorFault:
                continue
            if messages:
                self._heard.setdefault(topic, plain(messages[0]))
        return dict(self._heard)

    def close(self) -> None:
        """Close all connections."""
        for subscriber in self._topics.values():
            subscriber.close()
