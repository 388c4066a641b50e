"""A VecEnv that does not wait for slow simulators: its step returns as soon as one member has a new row.

The rows of the other members are invalid and pending: they repeat the member's last observation and have
reward 0. Their simulators keep computing, also while the algorithm learns. A step of the VecEnv returns a
valid row for each member whose own step has ended since the VecEnv's previous step. The
algorithm's new action for a pending member is ignored, because the member's row belongs to the action with
which its step began.

The order of the rows depends on the speed of the simulators, so a resumed run differs from an uninterrupted
run. A resume does not repeat the steps that were pending at the checkpoint.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs

from palaestra_trainer.environments.infos import OURS, TRUNCATED, is_valid
from palaestra_trainer.episodes.collector import CollectedRow
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.interface import Environment
from palaestra_trainer.waiting.greenlets import OpenWorks


class AsynchronousVecEnv(SimulatorsVecEnv):
    """The collecting simulators of a run; their rows come in the order in which their steps end."""

    asynchronous = True

    def __init__(self, *args: Any, **options: Any) -> None:
        self._works = OpenWorks()
        self._shown: list[Any] = []  # for each member, the observation of its last row
        super().__init__(*args, **options)

    def pause(self) -> None:
        """Wait for the pending steps, and pause all members until `unpause`."""
        self._end_steps()
        super().pause()

    def reset(self) -> VecEnvObs:
        """Begin new episodes in all members; drop the rows of pending steps."""
        self._forget_steps()
        return self._showing(super().reset())

    def resume(self, states: Sequence[EpisodeState], *, masked: bool = False) -> VecEnvObs:
        """Bring all members back to their states; return their observations."""
        self._forget_steps()
        return self._showing(super().resume(states, masked=masked))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Wait for the pending steps, and set an attribute of the chosen environments."""
        self._end_steps()
        super().set_attr(attr_name, value, indices)

    def close(self) -> None:
        """Abort the pending steps, and close the environments."""
        self._works.abort()
        super().close()

    def _rows(self) -> list[CollectedRow]:
        for index, (collector, action) in enumerate(zip(self._collectors, self._actions, strict=True)):
            self._works.begin(index, partial(collector.step, action))
        self._works.run(_is_news)
        ended = self._works.take()
        rows = [ended[index] if index in ended else pending(shown) for index, shown in enumerate(self._shown)]
        self._shown = [row.observation for row in rows]
        return rows

    def _targets(self, indices: VecEnvIndices) -> list[Environment]:
        self._end_steps()
        return super()._targets(indices)

    def _end_steps(self) -> None:
        """Wait until no step is pending; the next vector step returns the rows."""
        self._works.run(_never)

    def _forget_steps(self) -> None:
        self._end_steps()
        self._works.take()

    def _showing(self, observations: VecEnvObs) -> VecEnvObs:
        self._shown = [collector.observation for collector in self._collectors]
        return observations


def pending(shown: Any) -> CollectedRow:
    """Return the row of a member whose step has not ended; `shown` is the observation of its last row."""
    return CollectedRow(shown, 0.0, False, {OURS: {"valid": False, "pending": True}, TRUNCATED: False})


def _is_news(row: CollectedRow) -> bool:
    """Return whether a row is valid or ends an episode; neither may be true for a recovering row."""
    return is_valid(row.info) or row.done


def _never(_row: CollectedRow) -> bool:
    return False
