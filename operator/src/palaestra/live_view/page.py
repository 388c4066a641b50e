"""The page of a live view: one simulator with its newest poses and its episode, and the run's progress.

While no browser is connected, the page reads nothing from the simulator.
"""

from __future__ import annotations

import contextlib
import math
import signal
import time
from collections.abc import Callable, Sequence
from typing import Any, Final, Protocol

import numpy as np

from palaestra.live_view.guarded_server import LOOPBACK, guarded, stop
from palaestra.live_view.source import ViewError
from palaestra.live_view.stage import Stage
from palaestra_protocol.camera_picture import CameraPicture
from palaestra_protocol.pod.status import FaultKind, TrainerStatus
from palaestra_protocol.scene import SceneState, VisibleScene

_PERIOD_S: Final = 1.0 / 20.0  # each request costs the training about 1 ms of processor time
_TEXT_S: Final = 0.2
_PICTURE_S: Final = 0.2
_NO_PICTURE_S: Final = 2.0  # seconds until the next request to a simulator that had no picture
_IDLE_S: Final = 0.2
_AGAIN_S: Final = 0.1
_MOST_ROWS: Final = 24
_SKY: Final = 2.0


class SceneSource(Protocol):
    """The interface of a simulator that the page can show."""

    @property
    def name(self) -> str:
        """The name of the simulator, for people."""
        ...

    @property
    def here(self) -> bool:
        """Whether the simulator's processes run on this machine as this user, so that `signal` works."""
        ...

    def signal(self, number: int) -> None:
        """Send a signal to the simulator's process."""
        ...

    def scene(self) -> VisibleScene:
        """Return the visible shapes of the simulator's world."""
        ...

    def state(self) -> SceneState:
        """Return the newest poses."""
        ...

    def picture(self) -> CameraPicture | None:
        """Return the newest picture of a robot's camera; None if no camera has sent one."""
        ...

    def progress(self) -> TrainerStatus | None:
        """Return the progress of the simulator's run; None if it is unknown."""
        ...


class ViewPage:
    """A page for the simulators of one run.

    Args:
        title: the title of the page.
        sources: returns the simulators; the page calls this function again when a simulator does not respond.
        port: the port of the page; if it is in use, the next free port is taken.
        simulator: the name of the simulator that is shown first.

    Attributes:
        address: the URL of the page.
    """

    def __init__(
        self,
        title: str,
        sources: Callable[[], Sequence[SceneSource]],
        port: int,
        simulator: str | None = None,
    ) -> None:
        self._read = sources
        self._sources = {source.name: source for source in sources()}
        self._server, self._gate = guarded(port, title)
        self.address = f"http://{LOOPBACK}:{self._server.get_port()}"
        self._stage = Stage(self._server)
        self._shown = simulator or next(iter(self._sources))
        self._looked = False
        self._text_due = 0.0
        self._picture: Any = None
        self._picture_due = 0.0
        self._away_since: float | None = None
        self._note = ""
        self._light()
        self._text = self._panel()

    def run(self, ended: Callable[[], bool]) -> None:
        """Show the simulator until `ended` returns True."""
        while not ended():
            began = time.monotonic()
            if not self._server.get_clients():
                time.sleep(_IDLE_S)  # without a browser, the view must not slow the training
                continue
            try:
                self._show()
            except ViewError as error:
                self._wait(str(error))
            time.sleep(max(0.0, began + _PERIOD_S - time.monotonic()))

    def close(self) -> None:
        """Stop the server of the page."""
        stop(self._server)

    def _show(self) -> None:
        source = self._sources[self._shown]
        state = source.state()
        if self._away_since is not None and self._looked:  # the simulator was shown before its restart
            self._note = f"stepped again after {time.monotonic() - self._away_since:.1f} s"
        self._away_since = None
        if state.revision != self._stage.revision:
            scene = source.scene()
            self._stage.show(scene)
            self._look_at(scene)
        self._stage.move(state)
        if time.monotonic() >= self._text_due:
            self._text_due = time.monotonic() + _TEXT_S
            self._text.content = _paragraphs(summarized(source.progress()), described(state), self._note)

        self._show_picture(source)

    def _show_picture(self, source: SceneSource) -> None:
        """Show the newest picture of a camera, if the next picture is due."""
        if time.monotonic() < self._picture_due:
            return
        picture = source.picture()
        self._picture_due = time.monotonic() + (_NO_PICTURE_S if picture is None else _PICTURE_S)
        if picture is None:
            if self._picture is not None:
                self._picture.remove()
                self._picture = None
            return
        pixels = np.frombuffer(picture.pixels, np.uint8).reshape(picture.height, picture.width, 3)
        if self._picture is None:
            self._picture = self._server.gui.add_image(pixels)
        self._picture.label, self._picture.image = _cell(picture.name), pixels

    def _wait(self, reason: str) -> None:
        """Show the reason instead of the simulator's values, and read the simulators' addresses again."""
        self._stage.revision = None
        self._text.content = _paragraphs(summarized(self._sources[self._shown].progress()), reason)
        self._away_since = self._away_since or time.monotonic()
        time.sleep(_AGAIN_S)
        with contextlib.suppress(ViewError):  # a run that starts again may not have written its addresses yet
            self._sources = {source.name: source for source in self._read()}

    def _light(self) -> None:
        scene = self._server.scene
        scene.set_up_direction("+z")
        scene.configure_environment_map(None)  # an environment map would be loaded from another host
        scene.configure_default_lights()
        scene.add_light_hemisphere("/sky", intensity=_SKY, ground_color=(150, 150, 150))

    def _panel(self) -> Any:
        gui = self._server.gui
        gui.configure_theme(show_share_button=False, show_logo=False)
        if len(self._sources) > 1:
            choice = gui.add_dropdown("simulator", tuple(self._sources), initial_value=self._shown)
            self._gate.allow(choice)
            choice.on_update(lambda _: self._choose(choice.value))
        if all(source.here for source in self._sources.values()):
            self._add_fault("kill it", "The simulator ends at once, as after a crash.", signal.SIGKILL)
            self._add_fault("hang it", "The simulator stops, and does not respond any more.", signal.SIGSTOP)
        return gui.add_markdown("waits for the first pose")

    def _add_fault(self, label: str, hint: str, number: int) -> None:
        """Add a button that sends a signal to the simulator; only a local run's page has such buttons."""
        button = self._server.gui.add_button(label, hint=hint)
        self._gate.allow(button)

        def clicked(_event: Any) -> None:
            try:
                self._sources[self._shown].signal(number)
                self._note = f"{label}: done"
            except ViewError as error:
                self._note = str(error)

        button.on_click(clicked)

    def _choose(self, name: str) -> None:
        if name in self._sources:
            self._shown = name
            self._stage.revision = None
            self._picture_due = 0.0

    def _look_at(self, scene: VisibleScene) -> None:
        """Set the camera of all clients so that it sees the whole scene, from above and from the side."""
        if self._looked:
            return
        self._looked = True
        places = [node.pose[:3] for node in scene.nodes if node.shapes] or [(0.0, 0.0, 0.0)]
        low = [min(place[axis] for place in places) for axis in range(3)]
        high = [max(place[axis] for place in places) for axis in range(3)]
        x, y, z = ((a + b) / 2.0 for a, b in zip(low, high, strict=True))
        away = max(0.5, 0.55 * math.dist(low, high))
        eye = (x - 0.3 * away, y - away, z + 0.9 * away)
        self._server.initial_camera.position, self._server.initial_camera.look_at = eye, (x, y, z)
        for client in self._server.get_clients().values():
            client.camera.position, client.camera.look_at = eye, (x, y, z)


def summarized(run: TrainerStatus | None) -> str:
    """Return the progress of a run as Markdown: steps, success rate with its interval, faults."""
    if run is None:
        return ""
    faults = sum(run.faults.values()) - run.faults.get(FaultKind.SLOW, 0)
    lines = [f"step {run.step:,} of {run.target:,} · {faults} fault{'' if faults == 1 else 's'}"]
    if run.success_rate is not None:
        lines.append(f"**success {100 * run.success_rate:.0f} %**")
        if (interval := run.success_interval) is not None:
            bounds = f"{100 * interval.low:.0f} to {100 * interval.high:.0f} %"
            lines[-1] += f" ({bounds}, {interval.episodes} episodes)"
    return "\n\n".join(lines)


def described(state: SceneState) -> str:
    """Return the known values of a state as Markdown: time, episode, step, rewards and joints."""
    lines = [f"**{state.time_s:.1f} s**"]
    if state.episode is not None:
        lines[0] += f" · episode {state.episode}"
    if state.step is not None:
        lines[0] += f" · step {state.step}"
    for title, values in (("reward", state.rewards), ("joint", state.joints)):
        if values:
            rows = [f"| {_cell(name)} | {value:.3f} |" for name, value in list(values.items())[:_MOST_ROWS]]
            lines += ["", f"| {title} | |", "|---|--:|", *rows]
    return "\n".join(lines)


def _paragraphs(*texts: str) -> str:
    return "\n\n".join(filter(None, texts))


def _cell(name: str) -> str:
    """Return a name without special characters, for the cell of a table: names come from pods."""
    return "".join(letter if letter.isalnum() or letter in " _-./#" else " " for letter in name)[:40]
