"""Save three recorded episodes of the best policy in one file: the best, the median and a failed one.

A recording from above is part of each evaluation. The three episodes are recorded in three dimensions while
they are played a second time.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from palaestra_protocol.scene import VisibleScene
from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.episodes.evaluation import Episode, EvaluationResult
from palaestra_trainer.episodes.scene_film import (
    MOST_SCENE_CHARACTERS,
    NotFilmed,
    SceneFilm,
    characters,
)
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.read_replays import replays_of

RecordAgain = Callable[[tuple[int, Episode]], SceneFilm]


def keep_replays(
    directory: RunDirectory, evaluation: EvaluationResult, name: str, record_again: RecordAgain
) -> dict[str, Any]:
    """Choose episodes of an evaluation, write them to replays.json, and return its content.

    If the evaluation has no recordings, the file is not written, and the content is empty.

    Args:
        directory: the run directory.
        evaluation: the results and recordings of the evaluation's episodes.
        name: description of the evaluation for people.
        record_again: returns the recording in three dimensions of an episode with the given number in the
            evaluation, or raises NotFilmed.
    """
    scenes: list[VisibleScene] = []
    episodes = [
        episode.record()
        | {"title": title, "film": episode.film.to_json()}
        | _in_space(record_again, (_number(evaluation, episode), episode), scenes)
        for title, episode in chosen(evaluation.episodes)
        if episode.film is not None
    ]
    if not episodes:
        return {}
    content: dict[str, Any] = {"of": name, "episodes": episodes}
    content["scenes"] = [scene.to_json() for scene in scenes]

    def write(path: Path) -> None:
        path.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")

    replace_file(directory.replays, write)
    return content


def _in_space(
    record_again: RecordAgain, game: tuple[int, Episode], scenes: list[VisibleScene]
) -> dict[str, Any]:
    """Return the recording of an episode in three dimensions, or the reason for its absence.

    Episodes with equal scenes share one scene. A scene that is not in `scenes` is added.
    """
    try:
        film = record_again(game)
        if film.scene not in scenes:
            if sum(map(characters, [*scenes, film.scene])) > MOST_SCENE_CHARACTERS:
                return {"not_in_space": "the worlds of the episodes are too large together"}
            scenes.append(film.scene)
    except NotFilmed as error:
        return {"not_in_space": str(error)}
    return {"in_space": film.to_json(scenes.index(film.scene))}


def _number(evaluation: EvaluationResult, episode: Episode) -> int:
    """Return the number of an episode in its evaluation."""
    return next(number for number, one in enumerate(evaluation.episodes) if one is episode)


def films_of(content: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the episodes in the content of replays.json as animated GIFs by title."""
    from palaestra_trainer.reporting.film import animated  # noqa: PLC0415 - few programs draw films

    return {replay.title: animated(replay) for replay in replays_of(content)}


def chosen(episodes: Sequence[Episode]) -> list[tuple[str, Episode]]:
    """Return title and episode of the best, the median and the worst failed episode by return, each once.

    If the environment does not report success, or no episode failed, the third episode is the worst episode.
    """
    recorded = sorted(
        (episode for episode in episodes if episode.film is not None),
        key=lambda episode: (bool(episode.success), episode.total_reward),
    )
    if not recorded:
        return []
    failed = next((episode for episode in recorded if episode.success is False), None)
    found = [
        ("best", recorded[-1]),
        ("median", recorded[len(recorded) // 2]),
        ("failed", failed) if failed else ("worst", recorded[0]),
    ]
    kept: dict[int, tuple[str, Episode]] = {}
    for title, episode in found:
        kept.setdefault(id(episode), (title, episode))
    return list(kept.values())
