"""The ROS log of a controller: the topic `/rosout`, and the services with which tools set the log level.

Every roscpp node has this topic and these services; rqt_logger_level uses them. The simulator logs only the
requests and the sampling periods that it refuses. The other messages of roscpp's log are about roscpp itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

from palaestra_sim.errors import SimError
from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_interfaces import Fields, Handler, NodeInterface, PublisherInterface, Service

_LEVELS: Final = {"debug": 1, "info": 2, "warn": 4, "error": 8, "fatal": 16}  # Source: rosgraph_msgs/Log
_LOGGER: Final = "ros"


class NodeLog:
    """The log of one node.

    Args:
        node: the node in whose name messages are logged.
        clock: returns seconds of real time since 1970.
    """

    def __init__(self, node: NodeInterface, clock: Callable[[], float] = time.time) -> None:
        self._node = node
        self._clock = clock
        self._levels = {_LOGGER: "info", "ros.roscpp": "info", "ros.roscpp.superdebug": "warn"}
        self._publisher: PublisherInterface | None = None

    def table(self) -> tuple[Service, ...]:
        """Return the services."""
        return (
            Service("get_loggers", "roscpp/GetLoggers", self._get_loggers),
            Service("set_logger_level", "roscpp/SetLoggerLevel", self._set_logger_level),
        )

    def open(self) -> None:
        """Advertise `/rosout`."""
        self._publisher = self._node.advertise("/rosout", "rosgraph_msgs/Log")

    def error(self, text: str) -> None:
        """Publish an error, unless the log level is above `error`."""
        self._publish("error", text)

    def warning(self, text: str) -> None:
        """Publish a warning, unless the log level is above `warn`."""
        self._publish("warn", text)

    def _publish(self, level: str, text: str) -> None:
        if self._publisher is None or _LEVELS[self._levels[_LOGGER]] > _LEVELS[level]:
            return
        seconds, rest_s = divmod(self._clock(), 1.0)
        stamp = {"secs": int(seconds), "nsecs": int(rest_s * 1e9)}
        self._publisher.send(
            {
                "header": {"stamp": stamp},
                "level": _LEVELS[level],
                "name": f"/{self._node.name}",
                "msg": text,
            }
        )

    def reporting(self, path: str, handler: Handler) -> Handler:
        """Return a handler that also logs each failure of the service `path`.

        A `SimError` becomes a `ServiceFailed`, so that the client gets the error text.
        """

        def handle(request: Any) -> Any:
            try:
                return handler(request)
            except (SimError, ServiceFailed) as error:
                self.error(f"{path}: {error}")
                raise ServiceFailed(str(error)) from error

        return handle

    def _get_loggers(self, _request: Any) -> Fields:
        return {"loggers": [{"name": name, "level": level} for name, level in self._levels.items()]}

    def _set_logger_level(self, request: Any) -> Fields:
        level = request.level.lower()
        if level not in _LEVELS:
            raise ServiceFailed(f"{request.level!r} is not a level; use {', '.join(_LEVELS)}")
        self._levels[request.logger] = level
        return {}
