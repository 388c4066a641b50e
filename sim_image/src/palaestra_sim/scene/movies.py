"""Movies of the Viewpoint's view, in simulated time.

A movie has 25 frames per second, rounded so that a frame is rendered after a whole number of basic steps. A
movie that fails leaves no file, and the reason is logged.
Source: WbVideoRecorder.cpp of Webots.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Final, Protocol

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.camera_interface import MOST_PIXELS, CameraInterface

log = logging.getLogger(__name__)
_FRAME_MS: Final = 40
_BEST: Final = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Movie:
    """A movie that a client requests.

    Attributes:
        path: the path of the movie's file, absolute or relative to the working directory of the simulator.
        size: width and height in pixels.
        quality: the quality of the video, from 1 to 100.
        acceleration: simulated seconds per second of the movie.
        frames_s: frames in a second of the movie; set when the recording starts.
    """

    path: str
    size: tuple[int, int]
    quality: int
    acceleration: int
    frames_s: Fraction = Fraction(1000, _FRAME_MS)


class VideoWriter(Protocol):
    """The file of a movie; without a call of `finish`, no file is left."""

    def add(self, pixels: bytes | memoryview) -> None:
        """Add a frame: blue, green, red and alpha of each pixel.

        Raises:
            OSError: the file cannot be written.
        """
        ...

    def finish(self) -> None:
        """Complete the file and move it to its path.

        Raises:
            OSError: the file cannot be written.
        """
        ...


class Movies:
    """Records the movies of one world, one at a time.

    Args:
        view: returns a camera of the movie's size at the current Viewpoint; None if the simulator does not
            render.
        film: returns a writer for a movie; None if the simulator does not render.
        basic_step_ms: the basic step of the simulation.

    Attributes:
        failed: whether the last movie failed.
    """

    def __init__(
        self,
        view: Callable[[tuple[int, int]], CameraInterface | None],
        film: Callable[[Movie], VideoWriter | None],
        basic_step_ms: int,
    ) -> None:
        self.failed = False
        self._view = view
        self._new_film = film
        self._basic_step_ms = basic_step_ms
        self._film: VideoWriter | None = None
        self._size = (0, 0)
        self._every_ms = 0
        self._elapsed_ms = 0

    @property
    def ready(self) -> bool:
        """Whether a new recording can start."""
        return self._film is None

    def start(self, movie: Movie) -> bool:
        """Start to record; return whether that is possible.

        Raises:
            UnsimulatedError: the movie cannot be recorded, or this machine cannot render.
        """
        if self._film is not None:
            raise UnsimulatedError("a movie is being recorded; stop it first")
        self.failed = True
        camera = self._view(movie.size)
        if camera is None:
            return False
        _require_possible(movie)
        self._every_ms = frame_step_ms(movie.acceleration, self._basic_step_ms)
        frames_s = Fraction(1000 * movie.acceleration, self._every_ms)
        camera.open()
        self._size = movie.size
        try:
            self._film = self._new_film(replace(movie, frames_s=frames_s))
        except OSError as error:
            log.warning("movie %s: %s", movie.path, error.strerror or error)
        self._elapsed_ms = 0
        self.failed = self._film is None
        return not self.failed

    def stepped(self) -> None:
        """Record a frame after a basic step, if a frame is due."""
        film = self._film
        if film is None:
            return
        self._elapsed_ms += self._basic_step_ms
        if self._elapsed_ms % self._every_ms:
            return
        camera = self._view(self._size)  # a new camera, because a client may have moved the Viewpoint
        if camera is not None:
            pixels = camera.colors()
            self._try(lambda: film.add(pixels))

    def stop(self) -> None:
        """End the recording; without a recording, do nothing."""
        film = self._film
        if film is None:
            return
        if self._elapsed_ms < self._every_ms:
            log.warning("movie: nothing was recorded, because the simulation did not run; request steps")
            self.failed = True
        else:
            self._try(film.finish)
        self._film = None

    def _try(self, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError as error:
            log.warning("movie: %s", error.strerror or error)
            self.failed = True
            self._film = None


def frame_step_ms(acceleration: int, basic_step_ms: int) -> int:
    """Return the simulated time from one frame to the next, in whole basic steps."""
    steps = Fraction(acceleration * _FRAME_MS, basic_step_ms)
    shorter, longer = math.floor(steps) * basic_step_ms, math.ceil(steps) * basic_step_ms
    if shorter == 0 or abs(shorter - _FRAME_MS) > abs(longer - _FRAME_MS):
        return longer
    return shorter


def _require_possible(movie: Movie) -> None:
    """Check the parameters of a requested movie.

    Raises:
        UnsimulatedError: a movie with these parameters cannot be recorded.
    """
    if not movie.path.lower().endswith(".mp4"):
        raise UnsimulatedError(
            f"movie {movie.path!r}: only MP4 files are written; use a name that ends in .mp4"
        )
    if any(not 0 < length <= MOST_PIXELS or length % 2 for length in movie.size):
        width, height = movie.size
        raise UnsimulatedError(
            f"a movie cannot have {width} by {height} pixels; use even numbers from 2 to {MOST_PIXELS}"
        )
    if not 1 <= movie.quality <= _BEST or movie.acceleration < 1:
        raise UnsimulatedError(
            f"a movie cannot have quality {movie.quality} and acceleration {movie.acceleration};"
            f" use a quality from 1 to {_BEST} and an acceleration of at least 1"
        )
