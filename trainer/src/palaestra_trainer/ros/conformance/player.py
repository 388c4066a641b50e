"""Makes the calls of the claims with a client of any library.

In a request, the text "@name" stands for the first value in the response to the call `name`, e.g. the handle
of a node. The text "$FILES" stands for the folder of the files that the simulator reads and writes.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from palaestra_trainer.ros.conformance.claims import FAILED, Answer, Call, Claims

DEADLINE_S = 20.0
FILES = "$FILES"
_PAUSE_S = 0.02


class RosClient(Protocol):
    """A client of ROS."""

    def call(self, path: str, type_name: str, request: Mapping[str, Any]) -> Answer:
        """Call a service; return the response as a mapping, or the reason of a failure under `failed`."""
        ...

    def listen(self, topic: str, type_name: str) -> None:
        """Subscribe to a topic."""
        ...

    def heard(self) -> Mapping[str, Any]:
        """Return the first message of each topic that has sent one."""
        ...


class Player:
    """Makes the calls to one robot.

    Args:
        client: the client, which takes full names.
        robot: the ROS name of the robot.
        step_ms: the period of a step, in ms of simulated time.
        files: the folder of the files.
    """

    def __init__(self, client: RosClient, robot: str, step_ms: int, files: str) -> None:
        self._client = client
        self._robot = robot
        self._step_ms = step_ms
        self._files = files
        self._answers: dict[str, Answer] = {}

    def play(self, asked: Claims, *, ending: bool) -> tuple[Mapping[str, Answer], Mapping[str, Any]]:
        """Return the responses by name of the call, and the messages by topic.

        Args:
            asked: the claims.
            ending: whether to make the calls that restart and end the simulator too.
        """
        for call in asked.calls:
            self._make(call)
        for topic, type_name in asked.topics.items():
            self._client.listen(self._full(topic), type_name)
        heard = self._listen(asked.topics)
        for call in asked.last if ending else ():
            self._make_again(call)
        return self._answers, heard

    def _make(self, call: Call) -> Answer:
        name, path, type_name, request = call
        answer = self._client.call(self._full(path), type_name, self._filled(request))
        self._answers[name] = answer
        return answer

    def _make_again(self, call: Call) -> None:
        """Make a call until it succeeds, since a controller that restarts has no services for a moment."""
        end = time.monotonic() + DEADLINE_S
        while FAILED in self._make(call) and time.monotonic() < end:
            time.sleep(_PAUSE_S)

    def _listen(self, topics: Mapping[str, str]) -> Mapping[str, Any]:
        """Step until every topic has sent a message or the time is over; return the messages by path."""
        end = time.monotonic() + DEADLINE_S
        step = self._full("robot/time_step")
        heard: dict[str, Any] = {}
        while topics.keys() - heard.keys() and time.monotonic() < end:
            self._client.call(step, "webots_ros/set_int", {"value": self._step_ms})
            # The simulator refuses this sampling period and logs the refusal, so /rosout sends a message.
            self._client.call(self._full("battery_sensor/enable"), "webots_ros/set_int", {"value": 1})
            found = self._client.heard()
            heard = {topic: found[self._full(topic)] for topic in topics if self._full(topic) in found}
        return heard

    def _full(self, path: str) -> str:
        return path if path.startswith("/") else f"/{self._robot}/{path}"

    def _filled(self, request: Mapping[str, Any]) -> dict[str, Any]:
        return {name: self._value(value) for name, value in request.items()}

    def _value(self, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        if value.startswith("@"):
            answer = self._answers[value[1:]]
            return 0 if FAILED in answer else next(iter(answer.values()), 0)
        return value.replace(FILES, self._files)


def plain(value: Any) -> Any:
    """Return a message as mappings, lists and numbers."""
    if hasattr(value, "_asdict"):
        return {name: plain(it) for name, it in value._asdict().items()}
    if isinstance(value, bytes | memoryview):
        return list(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(it) for it in value]
    return value
