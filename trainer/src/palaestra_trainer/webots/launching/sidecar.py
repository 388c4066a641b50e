"""A client of a sidecar's control port, which the Webots facade uses as its launcher."""

from __future__ import annotations

import http.client
import json
import time
from typing import Any, TypeVar
from urllib.parse import urlsplit

from palaestra_protocol.control import (
    STANDBY,
    ProtocolError,
    SidecarState,
    SimulatorState,
    StopRequest,
    decoded,
)
from palaestra_protocol.scene import MOST_SCENE_BYTES, MOST_STATE_BYTES, SceneState, VisibleScene
from palaestra_trainer.errors import SimulatorDead, SimulatorHung, WrongData

_TIMEOUT_S = 5.0
_POLL_S = 0.02
_REFUSED = 2  # our simulators exit with this code if the world, an option or a variable is wrong
_MOST_BYTES = 65536
_CONFLICT = 409

_Data = TypeVar("_Data", VisibleScene, SceneState)


class Sidecar:
    """A client for one simulator, which its sidecar controls.

    Every method raises SimulatorDead if the sidecar is gone, and SimulatorHung if it does not respond.

    Attributes:
        address: e.g. http://127.0.0.1:7100
        left_out: the parts of the world that the simulator left out at its last start, as lines of text.

    Args:
        address: see Attributes.
        name: the simulator's name, for messages.
        above: prefix of the URL paths of this simulator.
    """

    def __init__(self, address: str, name: str, above: str = "") -> None:
        parts = urlsplit(address)
        self._host, self._port = str(parts.hostname), parts.port
        self.address = address
        self.left_out: tuple[str, ...] = ()
        self._name = name
        self._above = above

    def standby(self) -> Sidecar:
        """Return a client for the standby of the same sidecar, which must run with --standby."""
        return Sidecar(self.address, self._name, STANDBY)

    def state(self) -> SimulatorState:
        """Return the state that the sidecar reports for its simulator."""
        return self._ask("GET", "/state")

    def first_state(self, deadline_s: float) -> SimulatorState:
        """Return the state; if the sidecar does not listen yet, wait for it.

        Raises:
            SimulatorDead, SimulatorHung: the sidecar did not respond within `deadline_s` seconds.
        """
        give_up = time.monotonic() + deadline_s
        while True:
            try:
                return self.state()
            except SimulatorDead:
                if time.monotonic() > give_up:
                    raise
            time.sleep(_POLL_S)  # a sidecar that is starting cannot report when it is ready

    def start(self) -> None:
        """Begin to start the simulator; do nothing if the simulator is already starting."""
        self._ask("POST", "/start", {})

    def confirm_ready(self) -> None:
        """Report to the sidecar that the simulator has responded to a request."""
        self.left_out = self._ask("POST", "/ready", {}).left_out

    def ready(self) -> bool:
        """Return whether the simulator runs and was confirmed as ready."""
        return self.state().state is SidecarState.READY

    def expect_stop(self, deadline_s: float) -> None:
        """Announce that the simulator will end; after `deadline_s` seconds, the sidecar kills it."""
        self._ask("POST", "/stop", StopRequest(deadline_s=deadline_s).to_json())

    def failure(self) -> str | None:
        """Return the reason why the simulator is not running; None while it runs or starts."""
        state = self.state()
        if state.state in {SidecarState.STARTING, SidecarState.READY}:
            return None
        return state.detail or f"its state is {state.state.value}"

    def refused(self) -> bool:
        """Return whether the simulator ended with exit code 2, with which a program refuses its input."""
        last = self.state().last_exit
        return last is not None and last.code == _REFUSED

    def scene(self) -> VisibleScene | None:
        """Return the visible objects of the world; None: the simulator does not describe its world."""
        return self._viewed(VisibleScene, "/scene", MOST_SCENE_BYTES)

    def scene_state(self) -> SceneState:
        """Return the poses after the last step; at most a thirtieth of a second old.

        Raises:
            WrongData: the simulator does not describe its world.
        """
        if (state := self._viewed(SceneState, "/watch", MOST_STATE_BYTES)) is None:
            raise WrongData(self._name, "does not describe its world")
        return state

    def wait_stopped(self, deadline_s: float) -> None:
        """Wait until the simulator has ended.

        Raises:
            SimulatorHung: the simulator did not end within `deadline_s` seconds.
        """
        give_up = time.monotonic() + deadline_s
        while self.state().state not in {SidecarState.IDLE, SidecarState.FAILED}:
            if time.monotonic() > give_up:
                raise SimulatorHung(self._name, f"did not end within {deadline_s:g} s")
            time.sleep(_POLL_S)  # the control port has no request that waits for an end

    def _viewed(self, kind: type[_Data], path: str, most_bytes: int) -> _Data | None:
        """Return the data for viewers at a path; None if the simulator does not have it."""
        status, text = self._response("GET", path, most_bytes=most_bytes + 1)
        if status == http.client.NOT_FOUND:
            return None
        if status == http.client.SERVICE_UNAVAILABLE:
            raise SimulatorDead(self._name, "does not describe its world now")
        if status != http.client.OK:
            raise self._refused_with(status, path)
        try:
            return kind.from_json(decoded(text, most_bytes))
        except ProtocolError as error:
            raise self._unreadable(path, error) from error

    def _ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> SimulatorState:
        status, text = self._response(method, path, body)
        if status not in {http.client.OK, _CONFLICT}:
            raise self._refused_with(status, path)
        try:
            return SimulatorState.from_json(decoded(text))
        except ProtocolError as error:
            raise self._unreadable(path, error) from error

    def _response(
        self, method: str, path: str, body: dict[str, Any] | None = None, most_bytes: int = _MOST_BYTES
    ) -> tuple[int, bytes]:
        """Return status and body of a response; at most `most_bytes` of the body are read."""
        connection = http.client.HTTPConnection(self._host, self._port, timeout=_TIMEOUT_S)
        try:
            connection.request(method, f"{self._above}{path}", None if body is None else json.dumps(body))
            answer = connection.getresponse()
            return answer.status, answer.read(most_bytes)
        except TimeoutError as error:
            raise SimulatorHung(self._name, "its sidecar does not respond") from error
        except (OSError, http.client.HTTPException) as error:
            raise SimulatorDead(self._name, f"its sidecar cannot be reached ({error})") from error
        finally:
            connection.close()

    def _refused_with(self, status: int, path: str) -> WrongData:
        fact = f"its sidecar responded to {self._above}{path} with HTTP status {status}"
        return WrongData(self._name, fact)

    def _unreadable(self, path: str, error: ProtocolError) -> WrongData:
        return WrongData(self._name, f"its sidecar sent an invalid response to {self._above}{path}: {error}")
