"""Write the file of a movie: H.264 in MP4, encoded by PyAV.

The file has a hidden name in the same folder until it is complete; then it is renamed. While a simulator
writes a file, it holds a lock on the file. So a hidden file without a lock belongs to a simulator that was
killed. The simulator that records the next movie of this name removes such a file.
"""

from __future__ import annotations

import fcntl
import glob
import os
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.movies import Movie

_CODEC: Final = "libx264"
_WORST, _STEPS = 51, 41  # constant rate factor: 51 for quality 0, 10 for quality 100
_PUBLIC: Final = 0o644
_UNFINISHED: Final = ".unfinished"


class MujocoVideo:
    """The writer of one movie; see `VideoWriter`.

    Raises:
        OSError: the file cannot be written.
        UnsimulatedError: PyAV is not installed.
    """

    def __init__(self, movie: Movie) -> None:
        self._av = _library()
        self._movie = movie
        _remove_stale(Path(movie.path))
        lock, self._name = _new_file(Path(movie.path))
        self._abandoned = weakref.finalize(self, _abandon, lock, self._name)
        self._container: Any = self._av.open(self._name, "w", format="mp4")
        self._stream: Any = self._container.add_stream(_CODEC, rate=movie.frames_s)
        self._stream.width, self._stream.height = movie.size
        self._stream.pix_fmt = "yuv420p"
        rate = _WORST - _STEPS * movie.quality // 100
        self._stream.options = {"crf": str(rate), "preset": "veryfast"}
        # The encoder uses one thread, because several simulators share the processor.
        self._stream.thread_count = 1

    def add(self, pixels: bytes | memoryview) -> None:
        """Add a frame."""
        width, height = self._movie.size
        picture = np.frombuffer(pixels, np.uint8).reshape(height, width, 4)
        with self._failures():
            self._encode(self._av.VideoFrame.from_ndarray(picture, format="bgra"))

    def finish(self) -> None:
        """Rename the complete file to its final name."""
        with self._failures():
            self._encode(None)
            self._container.close()
        Path(self._name).chmod(_PUBLIC)
        Path(self._name).replace(self._movie.path)
        self._abandoned()

    def _encode(self, frame: Any) -> None:
        self._container.mux(self._stream.encode(frame))

    @contextmanager
    def _failures(self) -> Iterator[None]:
        """Turn errors of the library into OSError."""
        try:
            yield
        except self._av.FFmpegError as error:
            raise OSError(error.errno, error.strerror) from error


def _new_file(path: Path) -> tuple[int, str]:
    """Return the descriptor that holds the lock of a new hidden file, and the file's name."""
    while True:
        lock, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-", suffix=_UNFINISHED)
        with suppress(OSError):  # on a file system without locks, `_remove_stale` removes no file
            fcntl.flock(lock, fcntl.LOCK_EX)
        if os.fstat(lock).st_nlink:
            return lock, name
        os.close(lock)  # another simulator removed the file before this simulator locked it


def _abandon(lock: int, name: str) -> None:
    """Remove a hidden file, unless it was renamed, and release its lock."""
    Path(name).unlink(missing_ok=True)
    os.close(lock)


def _remove_stale(path: Path) -> None:
    """Remove the hidden files of a movie whose simulators were killed."""
    for stale in path.parent.glob(f".{glob.escape(path.name)}-*{_UNFINISHED}"):
        with suppress(OSError), stale.open("rb+") as file:  # the file may be locked, or already removed
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            stale.unlink()


def _library() -> Any:
    """Return PyAV.

    Raises:
        UnsimulatedError: PyAV is not installed.
    """
    try:
        return import_module("av")
    except ImportError as error:
        raise UnsimulatedError(f"movies need PyAV: {error}; install palaestra-sim[mujoco]") from error
