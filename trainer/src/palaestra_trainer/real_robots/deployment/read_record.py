"""Read the record of a deployment on a real robot, for its report."""

from __future__ import annotations

import json
import math
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from palaestra_trainer.bags.reader import Bag, BagMessage, read_bag
from palaestra_trainer.reporting.plain_values import number, record, text
from palaestra_trainer.reporting.run_data import Replay, RunData
from palaestra_trainer.robots.base import OUTLINE_M

MOST_FRAMES = 500
MOST_EPISODES = 20
MOST_LINES = 500
_FRAME_S = 0.1
_DECISIONS = "/palaestra/decisions"


class _Ended(NamedTuple):
    """The part of a record that is one episode, and its outcome."""

    begin_s: float
    end_s: float
    outcome: str
    success: bool | None


def read_record(path: Path) -> RunData:
    """Return the episodes, the decisions and the metadata of a record as the data of a report.

    Raises:
        ConfigurationError: the file is damaged, or not a bag.
        OSError: the file cannot be read.
    """
    bag = read_bag(path)
    ended = list(_episodes(bag))
    succeeded = [each.success for each in ended]
    causes = [text(each.get("cause")) for _, each in _decided(bag) if each.get("cause")]
    figures = {"episodes": f"{len(ended)}", "successes": f"{sum(each is True for each in succeeded)}"}
    if causes:
        figures["last cause to stand"] = causes[-1]
    replays = (_replay(bag, each, count) for count, each in enumerate(ended[:MOST_EPISODES], 1))
    return RunData(
        name=path.name,
        ended="good" if ended and all(each is not False for each in succeeded) else "failed",
        end="every episode ended as a success" if ended and all(succeeded) else "see the decisions",
        figures=figures,
        asked=bag.metadata,
        replays=tuple(each for each in replays if each.poses),
        replayed="the deployment, by odometry",
        decisions=tuple(_lines(bag))[-MOST_LINES:],
    )


def _decided(bag: Bag) -> Iterator[tuple[float, dict[str, Any]]]:
    """Yield time and content of each decision."""
    for message in bag.topics.get(_DECISIONS, ()):
        with suppress(ValueError):
            yield message.stamp_s, dict(record(json.loads(text(message.content.get("data")))))


def _episodes(bag: Bag) -> Iterator[_Ended]:
    """Yield the episodes of a record; if the last episode has no recorded end, its outcome is "stopped"."""
    begin_s = None
    for stamp_s, decision in _decided(bag):
        if decision.get("begin") == "episode":
            begin_s = stamp_s
        elif "episode" in decision and begin_s is not None:
            success = decision.get("success")
            known = success if isinstance(success, bool) else None
            yield _Ended(begin_s, stamp_s, text(decision["episode"]), known)
            begin_s = None
    if begin_s is not None:
        yield _Ended(begin_s, math.inf, "stopped", success=False)


def _replay(bag: Bag, episode: _Ended, count: int) -> Replay:
    odometry = [
        each for each in bag.topics.get("/odom", ()) if episode.begin_s <= each.stamp_s <= episode.end_s
    ]
    stamps = [each.stamp_s for each in odometry]
    lasts_s = stamps[-1] - stamps[0] if stamps else 0.0
    frame_s = max(_FRAME_S, lasts_s / MOST_FRAMES)
    frames = range(int(lasts_s / frame_s) + 1) if stamps else ()
    at = [bisect_right(stamps, stamps[0] + frame * frame_s) - 1 for frame in frames]
    target = _target(bag, episode)
    return Replay(
        title=f"episode {count}",
        facts=f"{episode.outcome.replace('_', ' ')} \u00b7 {lasts_s:.1f} s",
        poses=tuple(_pose(odometry[index]) for index in at),
        frame_s=frame_s,
        targets=() if target is None else ((0, *target),),
        radius_m=OUTLINE_M,
    )


def _target(bag: Bag, episode: _Ended) -> tuple[float, float] | None:
    """Return the newest target before the end of an episode."""
    before = [each for each in bag.topics.get("/target", ()) if each.stamp_s < episode.end_s]
    if not before:
        return None
    position = record(record(before[-1].content.get("pose")).get("position"))
    x_m, y_m = number(position.get("x")), number(position.get("y"))
    return None if x_m is None or y_m is None else (x_m, y_m)


def _pose(message: BagMessage) -> tuple[float, float, float]:
    pose = record(record(message.content.get("pose")).get("pose"))
    position, turned = record(pose.get("position")), record(pose.get("orientation"))
    heading = 2.0 * math.atan2(number(turned.get("z")) or 0.0, number(turned.get("w")) or 0.0)
    return number(position.get("x")) or 0.0, number(position.get("y")) or 0.0, heading


def _lines(bag: Bag) -> Iterator[tuple[str, str]]:
    """Yield time and text of each decision."""
    for stamp_s, decision in _decided(bag):
        at = datetime.fromtimestamp(stamp_s, UTC).isoformat(" ", "milliseconds")
        yield at, ", ".join(f"{name} {text(value)}" for name, value in decision.items() if value is not None)
