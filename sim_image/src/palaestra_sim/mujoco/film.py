"""The file of a movie: H.264 in MP4, encoded by PyAV, which is loaded for the first movie.

It is written under another name beside its own, and gets its name when it is whole.
"""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from palaestra_sim.scene.movies import Movie
from palaestra_sim.seam import UnsimulatedError

_CODEC: Final = "libx264"
_WORST, _STEPS = 51, 41  # of the constant rate factor: the quality 100 has 10
_PUBLIC: Final = 0o644


class MujocoFilm:
    """The film of one movie; see `Film`.

    Raises:
        OSError: the file cannot be written.
        UnsimulatedError: PyAV is not installed.
    """

    def __init__(self, movie: Movie) -> None:
        self._av = _library()
        self._movie = movie
        path = Path(movie.path)
        number, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=".mp4")
        os.close(number)
        self._name = name
        self._abandoned = weakref.finalize(self, Path(name).unlink, missing_ok=True)
        self._container: Any = self._av.open(name, "w")
        self._stream: Any = self._container.add_stream(_CODEC, rate=movie.frames_s)
        self._stream.width, self._stream.height = movie.size
        self._stream.pix_fmt = "yuv420p"
        rate = _WORST - _STEPS * movie.quality // 100
        self._stream.options = {"crf": str(rate), "preset": "veryfast"}
        self._stream.thread_count = 1  # the simulator's own: several share the processor

    def add(self, pixels: bytes | memoryview) -> None:
        """Add a frame."""
        width, height = self._movie.size
        picture = np.frombuffer(pixels, np.uint8).reshape(height, width, 4)
        with self._failures():
            self._encode(self._av.VideoFrame.from_ndarray(picture, format="bgra"))

    def finish(self) -> None:
        """Put the file where it belongs."""
        with self._failures():
            self._encode(None)
            self._container.close()
        Path(self._name).chmod(_PUBLIC)
        Path(self._name).replace(self._movie.path)
        self._abandoned.detach()

    def _encode(self, frame: Any) -> None:
        self._container.mux(self._stream.encode(frame))

    @contextmanager
    def _failures(self) -> Iterator[None]:
        """Turn errors of the library into OSError."""
        try:
            yield
        except self._av.FFmpegError as error:
            raise OSError(error.errno, error.strerror) from error


def _library() -> Any:
    """Return PyAV.

    Raises:
        UnsimulatedError: it is not installed.
    """
    try:
        return import_module("av")
    except ImportError as error:
        raise UnsimulatedError(f"movies need PyAV: {error}; install palaestra-sim[mujoco]") from error
