"""Write the recorded episodes of a run as one MCAP file with messages of ROS 2.

The bag has only what the recordings have: poses, targets and results. The time is simulated time, and the
poses are those of the world's frame, which is `map` here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.bags import definitions, messages
from palaestra_trainer.bags.writer import PART, BagWriter
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.plain_values import number, records, text
from palaestra_trainer.reporting.read_replays import replays_of
from palaestra_trainer.reporting.run_data import Replay
from palaestra_trainer.reporting.tolerant_files import json_file
from palaestra_trainer.reporting.write_film import NO_EPISODE

# The pause before each episode. It avoids the time 0, which tf2 takes for "the newest transform".
PAUSE_S = 1.0
_RESULTS = ("title", "seed", "outcome", "success", "return", "length")

Row = tuple[float, str, str, messages.Content]  # time in s, topic, type, content


def write_bag(run: RunDirectory, path: Path) -> tuple[int, int]:
    """Write the episodes one after the other; return the number of episodes and of messages.

    An older file at `path` is replaced.

    Raises:
        ConfigurationError: the run has no recorded episode, or a time in the recording is not one of ROS 2.
        OSError: the file could not be written.
    """
    content = json_file(run.replays)
    episodes = list(_episodes(content))
    if not episodes:
        raise ConfigurationError(f"{run.path}: {NO_EPISODE}")
    rows = list(_rows(episodes))
    metadata = {
        "content": "recorded episodes",
        "of": text(content.get("of")),
        "palaestra": version("palaestra-trainer"),
    }

    def write(name: Path) -> None:
        part = name.with_name(name.name + PART)
        for left in (name, part):  # a killed export may have left these files
            left.unlink(missing_ok=True)
        try:
            with BagWriter(name, metadata) as bag:
                for stamp_s, topic, type_name, message in rows:
                    bag.write(topic, type_name, message, stamp_s)
        finally:
            part.unlink(missing_ok=True)

    replace_file(path, write)
    return len(episodes), len(rows)


def _episodes(content: Mapping[str, Any]) -> Iterator[tuple[Mapping[str, Any], Replay]]:
    """Yield each episode that has poses: its results, and its recording."""
    for episode in records(content.get("episodes")):
        for replay in replays_of({"episodes": [episode]}):
            yield {name: episode[name] for name in _RESULTS if _is_plain(episode.get(name))}, replay


def _is_plain(value: object) -> bool:
    return isinstance(value, str | bool) or number(value) is not None


def _rows(episodes: list[tuple[Mapping[str, Any], Replay]]) -> Iterator[Row]:
    """Yield all messages in the order of their times."""
    start_s = PAUSE_S
    for results, replay in episodes:
        fields = {**results, "start_s": round(start_s, 6)}
        yield start_s, "/palaestra/episode", definitions.STRING, messages.record(fields)
        yield from _frames(replay, start_s)
        start_s += (len(replay.poses) - 1) * replay.frame_s + PAUSE_S


def _frames(replay: Replay, start_s: float) -> Iterator[Row]:
    targets = {frame: (x_m, y_m) for frame, x_m, y_m in replay.targets}
    for frame, pose in enumerate(replay.poses):
        at = start_s + frame * replay.frame_s
        if frame in targets:
            yield at, "/target", definitions.POSE, messages.target(at, *targets[frame], messages.MAP)
        yield at, "/tf", definitions.TRANSFORMS, messages.transform(at, pose, messages.MAP)
        yield at, "/odom", definitions.ODOMETRY, messages.odometry(at, pose, None, messages.MAP)
