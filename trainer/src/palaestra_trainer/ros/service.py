"""Call a ROS service like a function, with a deadline."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from palaestra_protocol.ros.rostypes import service_type
from palaestra_protocol.ros.tcpros import LENGTH
from palaestra_trainer.errors import SimulatorDead, UnreadableAnswer, WrongData
from palaestra_trainer.ros.known_types import known_type, node_of
from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node import ensure_node
from palaestra_trainer.ros.tcpros_client import TcprosClient

DEADLINE_S = 5.0
_OK_BYTE = 1
_AHEAD_BYTES = 1 + LENGTH.size


class RosService:
    """One service with a persistent connection that opens at the first call, and again after a failure.

    Args:
        name: the full name, e.g. /robotino/robot/time_step
        type_name: e.g. webots_ros/set_int
        deadline_s: the longest time to wait for a response.

    Raises:
        ConfigurationError: the name is not a full name, or the type is not known.
    """

    __slots__ = ("_deadline_s", "_type", "_wire", "name", "simulator")

    def __init__(self, name: str, type_name: str, deadline_s: float = DEADLINE_S) -> None:
        self.name = name
        self.simulator = node_of(name)
        self._type = known_type(service_type, type_name)
        self._deadline_s = deadline_s
        self._wire: TcprosClient | None = None

    def __call__(self, **fields: Any) -> Any:
        """Send a request with `fields`, and return the response, an object with the fields of its type.

        Raises:
            SimulatorDead: no node serves the service, or the connection was lost.
            SimulatorHung: no response arrived within the deadline.
            WrongData: the service failed, or its response is invalid.
        """
        self.begin(**fields)
        return self.finish()

    def begin(self, **fields: Any) -> None:
        """Send a request; call `finish` exactly once before the next `begin`.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: for the reasons of a call.
        """
        self.send(self._type.request.frame(fields))

    def packed(self, **fields: Any) -> bytes:
        """Return the bytes of a request with `fields`, for `send`.

        Raises:
            ValueError: a value does not fit its field.
        """
        return self._type.request.frame(fields)

    def send(self, data: bytes) -> None:
        """Send a request that `packed` has returned; see `begin`.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: for the reasons of a call.
        """
        try:
            (self._wire or self._connect()).send(data)
        except BaseException:  # for Ctrl-C too, because the next call would read this request's response
            self.close()
            raise

    def finish(self) -> Any:
        """Return the response to the request that `begin` sent.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: for the reasons of a call.
        """
        wire = self._wire or self._asked()
        try:
            return self._read_answer(wire)
        except BaseException:  # for Ctrl-C too, because the next call would read this request's response
            self.close()
            raise

    def fileno(self) -> int:
        """Return the descriptor, which becomes readable when the response arrives or the connection is lost.

        Raises:
            SimulatorDead: `begin` has not sent a request.
        """
        return self._asked().fileno()

    def await_end(self, deadline_s: float) -> bool:
        """Wait until the node closes the connection, and return whether it did within the deadline.

        No response may be pending. Without a connection, the result is True at once.
        """
        return self._wire is None or self._wire.await_end(deadline_s)

    def close(self) -> None:
        """Close the connection; the next call opens a new one."""
        if self._wire is not None:
            self._wire.close()
            self._wire = None

    def _asked(self) -> TcprosClient:
        if self._wire is None:
            raise SimulatorDead(self.simulator, f"{self.name} has no pending request")
        return self._wire

    def _read_answer(self, wire: TcprosClient) -> Any:
        answer = wire.receive(1)
        payload = answer[_AHEAD_BYTES:]
        if answer[0] != _OK_BYTE:
            words = bytes(payload).decode(errors="replace")
            raise WrongData(self.simulator, f"{self.name} failed: {words}")
        try:
            return self._type.response.decode(payload)
        except ValueError as error:
            raise WrongData(self.simulator, f"{self.name} answered with {error}") from error

    def _connect(self) -> TcprosClient:
        node = ensure_node()
        try:
            address = Master(node).service_address(self.name)
        except UnreadableAnswer as error:
            raise WrongData(self.simulator, f"{self.name} cannot be looked up: {error}") from error
        if address is None:
            raise SimulatorDead(self.simulator, f"no node serves {self.name}")
        header = {
            "callerid": node,
            "md5sum": self._type.md5,
            "persistent": "1",
            "service": self.name,
            "type": self._type.name,
        }
        self._wire = TcprosClient(address, header, self.simulator, self._deadline_s)
        return self._wire


def is_served(name: str) -> bool:
    """Return whether a node serves the service with this full name.

    Raises:
        MasterLost: no master responds.
    """
    return Master(ensure_node()).service_address(name) is not None


def call_together(
    calls: Iterable[tuple[RosService, dict[str, Any]]], meanwhile: Callable[[RosService], None] | None = None
) -> list[Any]:
    """Send all requests, then wait for the responses and return them.

    Args:
        calls: pairs of a service and the fields of its request.
        meanwhile: called with the service of the last request, after all requests are sent and before the
            wait for responses.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: the first error of a call. All connections are then closed,
            because later requests would read the responses to these requests.
    """
    sent: list[RosService] = []
    try:
        for service, fields in calls:
            service.begin(**fields)
            sent.append(service)
        if meanwhile is not None and sent:
            meanwhile(sent[-1])
        return [service.finish() for service in sent]
    except BaseException:  # for Ctrl-C too, because later calls would read these requests' responses
        for service in sent:
            service.close()
        raise
