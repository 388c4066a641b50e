"""Bring simulators back to the state of a checkpoint.

The state of a simulator cannot be saved. Instead, its episode is played again: a reset with the same seed,
then the same actions. The last observation is compared with the saved observation. If they differ, the
difference is logged, and training continues from the new observation.
"""

from __future__ import annotations

import dataclasses
from typing import cast

import numpy as np
import structlog

from palaestra_trainer.algorithms.observations import Observations, equal_rows
from palaestra_trainer.episodes.collecting import CollectingVecEnv
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.run.checkpoint import TrainingState

log = structlog.get_logger(__name__)


def rejoin(env: CollectingVecEnv, saved: TrainingState, *, masked: bool = False) -> TrainingState:
    """Bring each simulator back to the saved state if possible; return the resulting state.

    A simulator begins its next episode if it was down at the save, fails now, or is new in the run. If
    `masked` is set, it also begins its next episode if its mask now forbids a saved action.
    """
    before = [*saved.members, *[EpisodeState(0, None)] * env.num_envs][: env.num_envs]
    observation = cast("Observations", env.resume(before, masked=masked))
    after = env.snapshot()
    begun = np.array(
        [was.actions is None or now.episode != was.episode for was, now in zip(before, after, strict=True)]
    )
    same = equal_rows(observation, saved.observation)
    if not begun.any() and same.all() and len(same) == len(saved.members):
        return saved
    _tell(begun, same)
    return dataclasses.replace(
        saved,
        observation=observation,
        episode_starts=begun | _resized(saved.episode_starts, env.num_envs),
        positions=saved.positions and saved.positions._replace(newest=(None,) * env.num_envs),
        members=after,
        rollout={**saved.rollout, "terms": _terms_left(saved, begun)},
        running_returns=_returns_left(saved, begun),
    )


def _tell(begun: np.ndarray, same: np.ndarray) -> None:
    """Log a warning if simulators replayed their episode but reached another observation."""
    different = sum(not new and not equal for new, equal in zip(begun, same, strict=False))
    if different:
        log.warning(
            "simulators do not repeat their episodes: the run continues from other observations",
            simulators=different,
        )
    if begun.any():
        log.info("simulators begin a new episode", simulators=int(begun.sum()))


def _resized(values: np.ndarray, length: int) -> np.ndarray:
    """Return the first `length` values; add zeros if there are fewer."""
    return np.concatenate([values, np.zeros(length, dtype=values.dtype)])[:length]


def _returns_left(saved: TrainingState, begun: np.ndarray) -> np.ndarray | None:
    """Return the discounted rewards of continued episodes, 0 for new episodes; None without normalization."""
    known = saved.running_returns
    return None if known is None else np.where(begun, 0.0, _resized(known, len(begun)))


def _terms_left(saved: TrainingState, begun: np.ndarray) -> list[dict[str, float]]:
    """Return the sums of reward terms of continued episodes, empty for new episodes."""
    known = [*saved.rollout["terms"], *[{}] * len(begun)]
    return [{} if new else terms for new, terms in zip(begun, known, strict=False)]
