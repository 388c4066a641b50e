"""Read the recorded episodes of a run from the content of replays.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

from palaestra_protocol.fields import ProtocolError
from palaestra_protocol.scene import PoseNumbers, VisibleScene
from palaestra_trainer.reporting.plain_values import number, numbers, record, records, text
from palaestra_trainer.reporting.run_data import Replay, SpaceReplay

MOST_POSES = 2_000
MOST_OUTLINES = 400
_POSE = 7


def replays_of(content: Mapping[str, Any]) -> Iterator[Replay]:
    """Yield the episodes that have poses."""
    scenes = [_scene(scene) for scene in records(content.get("scenes"))]
    for episode in records(content.get("episodes")):
        film = record(episode.get("film"))
        frame_s = number(film.get("frame_s"))
        poses = _rows(film.get("poses"), 3, MOST_POSES)
        if not poses or not frame_s or frame_s <= 0:
            continue
        floor = [_rows([film.get(side)], 2, 1) for side in ("low", "high")]
        low, high = ((x, y) for [(x, y)] in floor) if all(floor) else (None, None)
        yield Replay(
            title=text(episode.get("title")),
            facts=_facts(episode),
            poses=tuple((x, y, heading) for x, y, heading in poses),
            frame_s=frame_s,
            targets=tuple((int(frame), x, y) for frame, x, y in _rows(film.get("targets"), 3, MOST_POSES)),
            low=low,
            high=high,
            outlines=tuple(
                (x, y, half_length, half_width, radius, heading)
                for x, y, half_length, half_width, radius, heading in _rows(
                    film.get("obstacles"), 6, MOST_OUTLINES
                )
            ),
            radius_m=_number_or(film.get("radius_m"), 0.1),
            space=_space(record(episode.get("in_space")), scenes),
            not_in_space=text(episode.get("not_in_space")),
        )


def _scene(content: Mapping[str, Any]) -> VisibleScene | None:
    """Return a scene; None if the content is not a scene."""
    try:
        return VisibleScene.from_json(content)
    except ProtocolError:
        return None


def _space(content: Mapping[str, Any], scenes: Sequence[VisibleScene | None]) -> SpaceReplay | None:
    """Return a recording in three dimensions; None if a part of it is missing or wrong."""
    index, names, frames = content.get("scene"), content.get("nodes"), content.get("frames")
    if not isinstance(index, int) or not 0 <= index < len(scenes) or not isinstance(names, list):
        return None
    scene = scenes[index]
    places = {} if scene is None else {node.name: place for place, node in enumerate(scene.nodes)}
    rows = _rows(frames, _POSE * len(names), MOST_POSES)
    known = all(isinstance(name, str) and name in places for name in names)
    if scene is None or not rows or len(rows) != len(cast("list[object]", frames)) or not known:
        return None
    return SpaceReplay(
        scene=scene,
        nodes=tuple(places[name] for name in names),
        frames=tuple(tuple(_poses(row)) for row in rows),
    )


def _poses(row: Sequence[float]) -> Iterator[PoseNumbers]:
    for start in range(0, len(row), _POSE):
        yield cast("PoseNumbers", tuple(row[start : start + _POSE]))


def _rows(value: object, length: int, most: int) -> list[tuple[float, ...]]:
    """Return the lists of `length` numbers among the first `most` members of a list."""
    lists = value[:most] if isinstance(value, list) else []
    return [row for one in lists if len(row := numbers(one)) == length]


def _facts(episode: Mapping[str, Any]) -> str:
    outcome = text(episode.get("outcome")).replace("_", " ")
    succeeded = episode.get("success")
    success = ("success" if succeeded else "no success") if isinstance(succeeded, bool) else ""
    parts = (
        outcome or success,
        f"return {_number_or(episode.get('return'), 0.0):.2f}",
        f"{_number_or(episode.get('length'), 0.0):,.0f} steps",
        f"seed {text(episode.get('seed'))}",
    )
    return " \u00b7 ".join(part for part in parts if part)


def _number_or(value: object, otherwise: float) -> float:
    """Return a value if it is a number, or else `otherwise`."""
    known = number(value)
    return otherwise if known is None else known
