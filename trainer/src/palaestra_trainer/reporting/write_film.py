"""Write the best recorded episode of a run as a film from above, an animated GIF or an MP4."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.film import animated, pictures
from palaestra_trainer.reporting.read_replays import replays_of
from palaestra_trainer.reporting.run_data import Replay
from palaestra_trainer.reporting.tolerant_files import json_file

VIDEO_PX: Final = 720
NO_EPISODE: Final = (
    "has no recorded episode; set evaluation.everySteps in the job, and use a robot that drives on a floor"
)
_LEAST_HZ, _MOST_HZ = 1, 60


def write_film(run: RunDirectory, to: Path) -> None:
    """Write the best recorded episode of a run; after an error, an old file is unchanged.

    Args:
        run: the run directory.
        to: the file; its name ends in .gif or .mp4.

    Raises:
        OSError: the file could not be written.
        ValueError: the name of the file has another ending, the run has no recorded episode, or PyAV, which
            writes MP4, is not installed.
    """
    if (write := WRITERS.get(to.suffix.lower())) is None:
        raise ValueError(f"{to}: a film is a GIF or an MP4; give a name that ends in .gif or .mp4")
    replays = list(replays_of(json_file(run.replays)))
    if not replays:
        raise ValueError(f"{run.path}: {NO_EPISODE}")
    best = next((replay for replay in replays if replay.title == "best"), replays[0])
    replace_file(to, lambda name: write(best, name))


def _write_gif(replay: Replay, path: Path) -> None:
    path.write_bytes(animated(replay))


def _write_mp4(replay: Replay, path: Path) -> None:
    """Write an H.264 video in real time, with a picture for each pose."""
    av = _library()
    rate = min(max(Fraction(1 / replay.frame_s).limit_denominator(1000), _LEAST_HZ), _MOST_HZ)
    with path.open("wb") as file, av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.pix_fmt = "yuv420p"  # not every browser plays other formats
        for number, picture in enumerate(pictures(replay, VIDEO_PX)):
            if number == 0:
                stream.width, stream.height = picture.size
            container.mux(stream.encode(av.VideoFrame.from_image(picture)))
        container.mux(stream.encode(None))


def _library() -> Any:
    try:
        return import_module("av")
    except ImportError as error:
        raise ValueError(
            f"an MP4 needs PyAV: {error}; install palaestra-trainer[film], or give a name that ends in .gif"
        ) from error


WRITERS: Mapping[str, Callable[[Replay, Path], None]] = MappingProxyType(
    {".gif": _write_gif, ".mp4": _write_mp4}
)
