"""Read the scene and the state of one simulator from its sidecar, or from anything that serves the same."""

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
    """This simulator is not shown; the text says why, and what to do."""


class NotNow(ViewError):
    """The simulator does not respond now; it may later."""


Fetch = Callable[[str, int], tuple[int, bytes]]


class _SpacedReader(Generic[_Value]):
    """Reads a value at most once in `every_s` seconds, and returns the newest one in between."""

    def __init__(self, read: Callable[[], _Value], every_s: float, clock: Callable[[], float]) -> None:
        self._read = read
        self._every_s = every_s
        self._clock = clock
        self._due = 0.0
        self._last: _Value | None = None

    def newest(self) -> _Value | None:
        """Return the newest value; None if none has been read."""
        if self._clock() >= self._due:
            self._due = self._clock() + self._every_s
            self._last = self._read()
        return self._last


class EpisodeReader:
    """Where the simulators of a run are in their episodes, as its trainer reports it; a few times a second.

    Args:
        fetch: reads from the trainer, as `SidecarSource.fetch`.
        clock: returns seconds, from any origin.
    """

    def __init__(self, fetch: Fetch, clock: Callable[[], float] = time.monotonic) -> None:
        self._fetch = fetch
        self._states = _SpacedReader(self._read, _EPISODES_S, clock)

    def of(self, name: str) -> SceneState | None:
        """Return the episode of a simulator; None if the trainer does not report it."""
        return (self._states.newest() or {}).get(name)

    def _read(self) -> dict[str, SceneState]:
        try:
            status, body = self._fetch("watch", MOST_STATE_BYTES)
            content = decoded(body, MOST_STATE_BYTES)
            if status != HTTPStatus.OK or not isinstance(content, dict):
                return {}
            return {str(name): SceneState.from_json(moment) for name, moment in content.items()}
        except (OSError, http.client.HTTPException, ProtocolError):
            return {}  # between two attempts, or of an older release


class StatusReader:
    """The progress of a run, as its trainer reports it; once a second.

    Args:
        fetch: reads from the trainer, as `SidecarSource.fetch`.
        clock: returns seconds, from any origin.
    """

    def __init__(self, fetch: Fetch, clock: Callable[[], float] = time.monotonic) -> None:
        self._fetch = fetch
        self._progress = _SpacedReader(self._read, _PROGRESS_S, clock)

    def newest(self) -> TrainerStatus | None:
        """Return the progress; None if the trainer does not report it."""
        return self._progress.newest()

    def _read(self) -> TrainerStatus | None:
        try:
            status, body = self._fetch("status", MOST_BYTES)
            return TrainerStatus.from_json(decoded(body, MOST_BYTES)) if status == HTTPStatus.OK else None
        except (OSError, http.client.HTTPException, ProtocolError, NotShown):
            return None  # between two attempts, or not allowed


@dataclass(frozen=True, slots=True, kw_only=True)
class SidecarSource:
    """One simulator behind its sidecar.

    Attributes:
        name: of the simulator, for people.
        fetch: returns status and body of the response to a GET of a path, at most so many bytes and one more.
            It raises OSError or HTTPException if there is no response.
        episodes: of the run's trainer; None if they are not known.
        run: the progress of the run; None if it is not known.
        here: whether its processes are those of this machine and this person, so that `signal` works.
    """

    name: str
    fetch: Fetch
    episodes: EpisodeReader | None = None
    run: StatusReader | None = None
    here: bool = False

    def scene(self) -> VisibleScene:
        """Return the looks of the world.

        Raises:
            NotShown: this simulator has no scene, or sends something else.
            NotNow: it does not run, or does not respond.
        """
        return self._read(VisibleScene, "scene", MOST_SCENE_BYTES)

    def state(self) -> SceneState:
        """Return the newest poses, with what is known about the episode; raises as `scene`."""
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
            return None  # the rest of the page needs no picture

    def progress(self) -> TrainerStatus | None:
        """Return the progress of the run; None if it is not known."""
        return None if self.run is None else self.run.newest()

    def signal(self, number: int) -> None:
        """Send a signal to the simulator's process, as a fault would; its trainer has it restarted.

        Raises:
            NotNow: it does not run, or is not of this machine.
        """
        try:
            pid = (
                SimulatorState.from_json(decoded(self.fetch("state", MOST_BYTES)[1])).pid
                if self.here
                else None
            )
            if pid is None:
                raise NotNow(f"{self.name}: no process of this machine runs")
            os.kill(pid, number)
        except (OSError, http.client.HTTPException, ProtocolError) as error:
            raise NotNow(f"{self.name}: has no process to signal ({error})") from error

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
            raise NotShown(f"{self.name}: its sidecar answered /{path} with {error}") from error


def at_address(host: str, port: int) -> Fetch:
    """Return a function that reads from a sidecar at an address of this machine."""

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
    """Return a function that reads the simulator of a sidecar that runs, where the sidecar has a standby too.

    It stays with one of the two until that one does not respond.
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
        return "its sidecar answered with something else than a scene; is it of an older release?"
