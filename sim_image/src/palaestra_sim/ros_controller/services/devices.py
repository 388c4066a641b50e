"""The services and topics of devices; a device publishes values after a client has enabled it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from palaestra_sim.ros_interfaces import Fields, NodeInterface, PublisherInterface, Row, Service
from palaestra_sim.scene.devices.device_type import (
    DeviceTopic,
    Enable,
    Stream,
    ValueSource,
    never,
    whole_steps,
)


@dataclass(slots=True, eq=False)
class Feed:
    """One topic of a device.

    If a client enables the device again with another period, the topic gets a second publisher, as in Webots'
    controller. Subscribers then get the messages of both publishers.

    Attributes:
        path: the path of the topic, relative to the robot.
        type_name: the message type.
        template: the constant fields of the header.
        constants: the other constant fields; their values are read when the topic begins.
        source: the object that has the current value; None if the topic never has messages.
        reading: the field with the value; "" means the last field.
        many: whether the value is a sequence; each of its items is sent in a separate message.
        whole: whether the value is a mapping of all fields.
        stamped: whether the messages have a header.
        publishers: the publishers, by period in ms.
        newest: the value that was sent last; None before the first message, and after the topic has ended.
    """

    path: str
    type_name: str
    template: Fields
    constants: Fields
    source: ValueSource | None
    reading: str = ""
    many: bool = False
    whole: bool = False
    stamped: bool = True
    publishers: dict[int, PublisherInterface] = field(default_factory=dict)
    newest: Any = None

    def begin(self, node: NodeInterface, period_ms: int) -> None:
        """Start to publish with the period `period_ms`, in addition to earlier periods."""
        if period_ms not in self.publishers:
            template = {**self.template, **self.constants}
            self.publishers[period_ms] = node.advertise(
                self.path, self.type_name, template=template, reading=self.reading
            )

    def end(self, node: NodeInterface) -> None:
        """Withdraw all publishers."""
        for publisher in self.publishers.values():
            node.withdraw(publisher)
        self.publishers.clear()
        self.newest = None

    def publish(self, elapsed_ms: int) -> None:
        """Send the value to the subscribers, once for each publisher that is due.

        If the topic has no subscriber, the value is not read, because reading may take time: for example, a
        camera renders an image.
        """
        source = self.source
        if source is None:
            return
        for period_ms, publisher in self.publishers.items():
            if elapsed_ms % period_ms == 0 and publisher.heard:
                for value in source.value if self.many else (source.value,):
                    self._send(publisher, value)
                    self.newest = value

    def _send(self, publisher: PublisherInterface, value: Any) -> None:
        if self.whole:
            publisher.send_stamped(value)
        elif not self.stamped:
            publisher.send({self.reading: value})
        elif self.reading:
            publisher.send_stamped({self.reading: value})
        else:
            publisher.send_value(value)


class Outlet:
    """All topics of one device; its service `enable` starts and stops all of them.

    Args:
        node: the ROS node that publishes the topics.
        path: the first part of the paths, made from the name of the device.
        topics: the topics of the device.
        accepts: returns whether the device accepts a period.
        enabled: called after each change with the sampling period in ms; 0 means that the device is off.
        prefix: a prefix of the paths `enable` and `get_sampling_period`, such as "recognition_".

    Attributes:
        feeds: a feed for each topic.
    """

    def __init__(
        self,
        node: NodeInterface,
        path: str,
        topics: Iterable[DeviceTopic],
        accepts: Enable,
        enabled: Callable[[int], None] = lambda _period_ms: None,
        prefix: str = "",
    ) -> None:
        header = {"header": {"frame_id": f"{node.name}/{path}"}}
        self.feeds = tuple(
            Feed(
                f"{path}/{it.name}",
                it.type_name,
                header if it.stamped else {},
                it.constants,
                it.source,
                reading=it.reading,
                many=it.many,
                whole=it.whole,
                stamped=it.stamped,
            )
            for it in topics
        )
        self._node = node
        self._path = f"{path}/{prefix}"
        self._enabled = enabled
        self._accepts = accepts
        self._periods_ms: set[int] = set()

    def enable(self, period_ms: int, step_ms: int) -> bool:
        """Start to publish with the period `period_ms`, or stop if the period is 0.

        Return whether the device accepts the period.

        Raises:
            UnsimulatedError: the device cannot start; for example, a camera on a machine that cannot render.
        """
        if period_ms == 0:
            self._periods_ms.clear()
            for feed in self.feeds:
                feed.end(self._node)
            self._enabled(0)
            return True
        if not self._accepts(period_ms, step_ms):
            return False
        self._enabled(min(self._periods_ms | {period_ms}))
        self._periods_ms.add(period_ms)
        for feed in self.feeds:
            feed.begin(self._node, period_ms)
        return True

    def services(self, step_ms: Callable[[], int], warn: Callable[[str], None]) -> tuple[Service, ...]:
        """Return the services `enable` and `get_sampling_period`.

        Args:
            step_ms: returns the duration of the controller's last step.
            warn: called with a sentence if a sampling period is refused.
        """

        def enable(request: Any) -> dict[str, Any]:
            success = self.enable(request.value, step_ms())
            if not success:
                warn(
                    f"{self._path}enable: refused the period {request.value} ms; use a multiple of the step, "
                    f"{step_ms()} ms, for a device that this simulator can enable"
                )
            return {"success": success}

        def get_sampling_period(_request: Any) -> dict[str, Any]:
            return {"value": min(self._periods_ms, default=0)}

        return (
            Service(f"{self._path}enable", "webots_ros/set_int", enable),
            Service(f"{self._path}get_sampling_period", "webots_ros/get_int", get_sampling_period),
        )


def stream_outlet(node: NodeInterface, path: str, stream: Stream) -> Outlet:
    """Return the outlet of those topics of a device that have a separate `enable` service."""
    accepts = never if stream.silent else whole_steps
    return Outlet(node, path, stream.topics, accepts, stream.enabled, stream.prefix)


def services_below(path: str, rows: Iterable[Row]) -> tuple[Service, ...]:
    """Return the services in `rows`, with paths below `path`."""
    return tuple(
        Service(f"{path}/{name}", f"webots_ros/{type_name}", handler) for name, type_name, handler in rows
    )
