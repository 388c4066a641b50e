"""Recorded episodes of the best policy, a best, a median and a failed one, in one file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palaestra_trainer.episodes.evaluation import Episode, EvaluationResult
from palaestra_trainer.job.run_directory import RunDirectory, replace_file
from palaestra_trainer.reporting.read_replays import replays_of


def keep_replays(directory: RunDirectory, evaluation: EvaluationResult, name: str) -> dict[str, Any]:
    """Write replays.json with the chosen episodes of an evaluation, and return its content.

    Without recordings nothing is written, and the content is empty.

    Args:
        directory: the run directory.
        evaluation: the evaluation.
        name: what the evaluation is, for people.
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
    """Return the episodes of replays.json from above, as animated GIFs by their titles."""
    from palaestra_trainer.reporting.film import animated  # noqa: PLC0415 - a run without recordings draws none

    return {replay.title: animated(replay) for replay in replays_of(content)}


def chosen(episodes: Sequence[Episode]) -> list[tuple[str, Episode]]:
    """Return the best, the median and the worst failed episode by return, with their titles; none twice.

    If the environment reports no success, or no episode failed, the third is the worst one.
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
