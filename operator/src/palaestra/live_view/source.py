"""Read the scene and the state of one simulator from its sidecar, or from a server with the same paths."""

from __future__ import annotations

import http.client
import os
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from http import HTTPStatus
from typing import Final, Generic, TypeVar

from palaestra.errors import PalaestraError
from palaestra_protocol.camera_picture import MOST_PICTURE_BYTES, CameraPicture
from palaestra_protocol.control import SimulatorState
from palaestra_protocol.fields import MOST_BYTES, Fields, ProtocolError, decoded
from palaestra_protocol.pod.status import TrainerStatus
from palaestra_protocol.scene import MOST_SCENE_BYTES, MOST_STATE_BYTES, SceneState, VisibleScene

_DEADLINE_S: Final = 3.0
_STANDBY: Final = "standby/"
_EPISODES_S: Final = 0.2
_PROGRESS_S: Final = 1.0
_MOST_ERROR_BYTES: Final = 4096
_Data = TypeVar("_Data", VisibleScene, SceneState)
_Value = TypeVar("_Value")


class ViewError(PalaestraError):
    """A run cannot be shown."""


class NotShown(ViewError):
    """This simulator cannot be shown; the message has the reason and the remedy."""


class NotNow(ViewError):
    """The simulator does not respond now, but may respond later."""


Fetch = Callable[[str, int], tuple[int, bytes]]


class _SpacedReader(Generic[_Value]):
    """Reads a value at most once in `every_s` seconds; in between, it returns the last value."""

    def __init__(self, read: Callable[[], _Value], every_s: float, clock: Callable[[], float]) -> None:
        self._read = read
        self._every_s = every_s
        self._clock = clock
        self._due = 0.0
        self._last: _Value | None = None

    def newest(self) -> _Value | None:
        """Return the newest value, or None."""
        if self._clock() >= self._due:
            self._due = self._clock() + self._every_s
            self._last = self._read()
        return self._last


class EpisodeReader:
    """Reads from a run's trainer the episodes of its simulators, a few times a second.

    Args:
        fetch: sends a request to the trainer, with the interface of `SidecarSource.fetch`.
        clock: returns the time in seconds since any fixed moment.
    """

    def __init__(self, fetch: Fetch, clock: Callable[[], float] = time.monotonic) -> None:
        self._fetch = fetch
        self._states = _SpacedReader(self._read, _EPISODES_S, clock)

    def of(self, name: str) -> SceneState | None:
        """Return the episode of a simulator; None if the trainer does not report this episode."""
        return (self._states.newest() or {}).get(name)

    def _read(self) -> dict[str, SceneState]:
        try:
            status, body = self._fetch("watch", MOST_STATE_BYTES)
            content = decoded(body, MOST_STATE_BYTES)
            if status != HTTPStatus.OK or not isinstance(content, dict):
                return {}
            return {str(name): SceneState.from_json(moment) for name, moment in content.items()}
        except (OSError, http.client.HTTPException, ProtocolError):
            return {}  # no trainer runs between two attempts, or the trainer is of an older release


class StatusReader:
    """Reads from a run's trainer the progress of the run, once a second.

    Args:
        fetch: sends a request to the trainer, with the interface of `SidecarSource.fetch`.
        clock: returns the time in seconds since any fixed moment.
    """

    def __init__(self, fetch: Fetch, clock: Callable[[], float] = time.monotonic) -> None:
        self._fetch = fetch
        self._progress = _SpacedReader(self._read, _PROGRESS_S, clock)

    def newest(self) -> TrainerStatus | None:
        """Return the progress of the run; None if the trainer does not report it."""
        return self._progress.newest()

    def _read(self) -> TrainerStatus | None:
        try:
            status, body = self._fetch("status", MOST_BYTES)
            return TrainerStatus.from_json(decoded(body, MOST_BYTES)) if status == HTTPStatus.OK else None
        except (OSError, http.client.HTTPException, ProtocolError, NotShown):
            return None  # the trainer is between two attempts, or the request is not allowed


@dataclass(frozen=True, slots=True, kw_only=True)
class SidecarSource:
    """One simulator, read from its sidecar.

    Attributes:
        name: the name of the simulator, for people.
        fetch: sends a GET request for a path, and returns status and body of the response. The body has at
            most the given number of bytes plus one, so that a longer body can be detected. The function
            raises OSError or HTTPException if no response arrives.
        episodes: reads the episodes from the run's trainer; None if they are unknown.
        run: reads the progress of the run; None if it is unknown.
        here: whether the simulator's processes run on this machine as this user, so that `signal` works.
    """

    name: str
    fetch: Fetch
    episodes: EpisodeReader | None = None
    run: StatusReader | None = None
    here: bool = False

    def scene(self) -> VisibleScene:
        """Return the visible shapes of the world.

        Raises:
            NotShown: this simulator has no scene, or sends an invalid scene.
            NotNow: the simulator does not run, or does not respond.
        """
        return self._read(VisibleScene, "scene", MOST_SCENE_BYTES)

    def state(self) -> SceneState:
        """Return the newest poses, with the values of the episode; raise the same errors as `scene`."""
        state = self._read(SceneState, "watch", MOST_STATE_BYTES)
        moment = None if self.episodes is None else self.episodes.of(self.name)
        if moment is None:
            return state
        return replace(
            state,
            target=moment.target,
            episode=moment.episode,
            step=moment.step,
            rewards=moment.rewards,
        )

    def picture(self) -> CameraPicture | None:
        """Return the newest picture of a robot's camera; None if no camera has sent one."""
        try:
            status, body = self.fetch("camera", MOST_PICTURE_BYTES)
            content = decoded(body, MOST_PICTURE_BYTES)
            if status != HTTPStatus.OK or content is None:
                return None
            return CameraPicture.from_json(content)
        except (OSError, http.client.HTTPException, ProtocolError, NotShown):
            return None  # the page works without the picture

    def progress(self) -> TrainerStatus | None:
        """Return the progress of the run; None if it is unknown."""
        return None if self.run is None else self.run.newest()

    def signal(self, number: int) -> None:
        """Send a signal to the simulator's process as a fault; the trainer then restarts the simulator.

        Raises:
            NotNow: the simulator does not run, or does not run on this machine.
        """
        try:
            pid = (
                SimulatorState.from_json(decoded(self.fetch("state", MOST_BYTES)[1])).pid
                if self.here
                else None
            )
            if pid is None:
                raise NotNow(f"{self.name}: its process does not run on this machine")
            os.kill(pid, number)
        except (OSError, http.client.HTTPException, ProtocolError) as error:
            raise NotNow(f"{self.name}: no signal could be sent to its process ({error})") from error

    def _read(self, kind: type[_Data], path: str, most_bytes: int) -> _Data:
        try:
            status, body = self.fetch(path, most_bytes)
        except (OSError, http.client.HTTPException) as error:
            raise NotNow(f"{self.name}: its sidecar does not respond ({error})") from error
        if status == HTTPStatus.SERVICE_UNAVAILABLE:
            raise NotNow(f"{self.name}: {_reason(body)}")
        if status != HTTPStatus.OK:
            raise NotShown(f"{self.name}: {_reason(body)}")
        try:
            return kind.from_json(decoded(body, most_bytes))
        except ProtocolError as error:
            raise NotShown(
                f"{self.name}: its sidecar sent an invalid response to /{path}: {error}"
            ) from error


def at_address(host: str, port: int) -> Fetch:
    """Return a function that reads from the sidecar at an address."""

    def fetch(path: str, most_bytes: int) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(host, port, timeout=_DEADLINE_S)
        try:
            connection.request("GET", f"/{path}")
            response = connection.getresponse()
            return response.status, response.read(most_bytes + 1)
        finally:
            connection.close()

    return fetch


def of_either(fetch: Fetch) -> Fetch:
    """Return a function that reads the running simulator of a sidecar with a standby.

    The function reads from the same simulator until the sidecar responds that this simulator does not run.
    """
    slots = deque(("", _STANDBY))

    def fetched(path: str, most_bytes: int) -> tuple[int, bytes]:
        status, body = fetch(f"{slots[0]}{path}", most_bytes)
        if status == HTTPStatus.SERVICE_UNAVAILABLE:
            slots.rotate()
        return status, body

    return fetched


def _reason(body: bytes) -> str:
    try:
        return Fields(decoded(body, _MOST_ERROR_BYTES)).text("error")
    except ProtocolError:
        return "its sidecar did not return a scene; the sidecar may be from an older release"
