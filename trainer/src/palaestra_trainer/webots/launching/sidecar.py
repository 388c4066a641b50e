"""A client of a sidecar's control port; the Webots facade uses it as its launcher."""

from __future__ import annotations

import http.client
import json
import time
from typing import Any
from urllib.parse import urlsplit

from palaestra_protocol.control import (
    STANDBY,
    ProtocolError,
    SidecarState,
    SimulatorState,
    StopRequest,
    decoded,
)
from palaestra_trainer.errors import SimulatorDead, SimulatorHung, WrongData

_TIMEOUT_S = 5.0
_POLL_S = 0.02
_REFUSED = 2  # the exit code of our simulators for a world, an option or a variable that is wrong
_MOST_BYTES = 65536
_CONFLICT = 409


class Sidecar:
    """One simulator behind the control port of its sidecar.

    Every method raises SimulatorDead if the sidecar is gone, and SimulatorHung if it does not respond.

    Attributes:
        address: e.g. http://127.0.0.1:7100
        left_out: the parts that the simulator left out of its world at its last start, in lines for people.

    Args:
        address: see Attributes.
        name: the simulator's name, for messages.
        above: prefix of this simulator's paths.
    """

    def __init__(self, address: str, name: str, above: str = "") -> None:
        parts = urlsplit(address)
        self._host, self._port = str(parts.hostname), parts.port
        self.address = address
        self.left_out: tuple[str, ...] = ()
        self._name = name
        self._above = above

    def standby(self) -> Sidecar:
        """Return the second simulator of the same sidecar; the sidecar must run with --standby."""
        return Sidecar(self.address, self._name, STANDBY)

    def state(self) -> SimulatorState:
        """Return the state that the sidecar reports for its simulator."""
        return self._ask("GET", "/state")

    def first_state(self, deadline_s: float) -> SimulatorState:
        """Return the state; wait if the sidecar does not listen yet.

        Raises:
            SimulatorDead, SimulatorHung: it did not respond within `deadline_s` seconds.
        """
        give_up = time.monotonic() + deadline_s
        while True:
            try:
                return self.state()
            except SimulatorDead:
                if time.monotonic() > give_up:
                    raise
            time.sleep(_POLL_S)  # the sidecar is still starting; no call can wait for the end of its start

    def start(self) -> None:
        """Start the simulator without waiting for it; do nothing if it is already starting."""
        self._ask("POST", "/start", {})

    def confirm_ready(self) -> None:
        """Report to the sidecar that the simulator has responded to a real request."""
        self.left_out = self._ask("POST", "/ready", {}).left_out

    def ready(self) -> bool:
        """Return whether the simulator runs and was confirmed as ready."""
        return self.state().state is SidecarState.READY

    def expect_stop(self, deadline_s: float) -> None:
        """Announce that the simulator will end; the sidecar kills it after `deadline_s` seconds."""
        self._ask("POST", "/stop", StopRequest(deadline_s=deadline_s).to_json())

    def failure(self) -> str | None:
        """Return the reason why the simulator is not running; None while it runs or starts."""
        state = self.state()
        if state.state in {SidecarState.STARTING, SidecarState.READY}:
            return None
        return state.detail or f"its state is {state.state.value}"

    def refused(self) -> bool:
        """Return whether it ended with exit code 2, by which a program refuses its input."""
        last = self.state().last_exit
        return last is not None and last.code == _REFUSED

    def wait_stopped(self, deadline_s: float) -> None:
        """Wait until the simulator has ended.

        Raises:
            SimulatorHung: it did not end within `deadline_s` seconds.
        """
        give_up = time.monotonic() + deadline_s
        while self.state().state not in {SidecarState.IDLE, SidecarState.FAILED}:
            if time.monotonic() > give_up:
                raise SimulatorHung(self._name, f"did not end within {deadline_s:g} s")
            time.sleep(_POLL_S)  # the control port has no request that waits

    def _ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> SimulatorState:
        connection = http.client.HTTPConnection(self._host, self._port, timeout=_TIMEOUT_S)
        try:
            connection.request(method, f"{self._above}{path}", None if body is None else json.dumps(body))
            answer = connection.getresponse()
            text = answer.read(_MOST_BYTES)
        except TimeoutError as error:
            raise SimulatorHung(self._name, "its sidecar does not respond") from error
        except (OSError, http.client.HTTPException) as error:
            raise SimulatorDead(self._name, f"its sidecar is gone ({error})") from error
        finally:
            connection.close()
        if answer.status not in {http.client.OK, _CONFLICT}:
            raise WrongData(self._name, f"its sidecar responded to {self._above}{path} with {answer.status}")
        try:
            return SimulatorState.from_json(decoded(text))
        except ProtocolError as error:
            raise WrongData(
                self._name, f"its sidecar responded to {self._above}{path} with {error}"
            ) from error
