"""Save three recorded episodes of the best policy in one file: the best, the median and a failed one."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palaestra_trainer.episodes.evaluation import Episode, EvaluationResult
from palaestra_trainer.job.run_directory import RunDirectory, replace_file
from palaestra_trainer.reporting.read_replays import replays_of


def keep_replays(directory: RunDirectory, evaluation: EvaluationResult, name: str) -> dict[str, Any]:
    """Choose episodes of an evaluation, write them to replays.json, and return its content.

    If the evaluation has no recordings, the file is not written, and the content is empty.

    Args:
        directory: the run directory.
        evaluation: the results and recordings of the evaluation's episodes.
        name: description of the evaluation for people.
    """
    episodes = [
        episode.record() | {"title": title, "film": episode.film.to_json()}
        for title, episode in chosen(evaluation.episodes)
        if episode.film is not None
    ]
    if not episodes:
        return {}
    content: dict[str, Any] = {"of": name, "episodes": episodes}

    def write(path: Path) -> None:
        path.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")

    replace_file(directory.replays, write)
    return content


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
