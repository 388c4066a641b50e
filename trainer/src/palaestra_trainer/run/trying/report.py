"""Format the results of `palaestra-try`, as text for a person and as JSON data for programs."""

from __future__ import annotations

from statistics import fmean
from typing import Any

from palaestra_trainer.episodes.evaluation import Episode
from palaestra_trainer.run.trying.episodes import Tried


def line_of(number: int, episode: Episode) -> str:
    """Return the result of an episode as a line of text."""
    ends = {True: "success", False: "no success", None: ""}[episode.success]
    words = ", ".join(word for word in (ends, episode.outcome) if word)
    steps = "1 step" if episode.length == 1 else f"{episode.length} steps"
    return f"episode {number:>2}: return {episode.total_reward:.2f}, {steps}{', ' + words if words else ''}"


def summary(tried: Tried) -> list[str]:
    """Return lines of text: first the statistics of all episodes, then the problems."""
    return [*_figures(tried), *_times(tried), *_problems(tried)]


def _figures(tried: Tried) -> list[str]:
    if not tried.episodes:
        return ["no episode came to its end"]
    returns = [episode.total_reward for episode in tried.episodes]
    lengths = [episode.length for episode in tried.episodes]
    successes = [episode.success for episode in tried.episodes if episode.success is not None]
    rate = f"; {sum(successes)} of {len(successes)} succeeded" if successes else ""
    told = f"return {min(returns):.2f} to {max(returns):.2f}, mean {fmean(returns):.2f}"
    steps = f"steps {min(lengths)} to {max(lengths)}, mean {fmean(lengths):.1f}"
    count = "1 episode" if len(returns) == 1 else f"{len(returns)} episodes"
    return [f"{count}: {told}; {steps}{rate}"]


def _times(tried: Tried) -> list[str]:
    times = tried.times
    if not times.count:
        return []
    parts = {
        "simulator": times.simulator_s,
        "transport": times.transport_s,
        "environment": times.environment_s,
    }
    told = ", ".join(f"{name} {1000 * spent / times.count:.2f} ms" for name, spent in parts.items())
    resets = f"; a reset takes {1000 * fmean(tried.reset_s):.0f} ms"
    return [f"a step takes {1000 * times.seconds / times.count:.2f} ms: {told}{resets}"]


def _problems(tried: Tried) -> list[str]:
    lines = tried.problems.lines()
    if not lines:
        return ["no problem found"]
    head = "1 problem:" if len(lines) == 1 else f"{len(lines)} problems:"
    return [head, *(f"- {line}" for line in lines)]


def as_json(tried: Tried) -> dict[str, Any]:
    """Return the results as JSON data; times are means in milliseconds."""
    times, count = tried.times, max(tried.times.count, 1)
    return {
        "episodes": [episode.record() for episode in tried.episodes],
        "steps": tried.times.count,
        "step_ms": {
            "simulator": round(1000 * times.simulator_s / count, 4),
            "transport": round(1000 * times.transport_s / count, 4),
            "environment": round(1000 * times.environment_s / count, 4),
        },
        "reset_ms": round(1000 * fmean(tried.reset_s), 4) if tried.reset_s else None,
        "problems": tried.problems.lines(),
    }
