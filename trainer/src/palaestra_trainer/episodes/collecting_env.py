"""Choose the VecEnv of a run.

A step of `SimulatorsVecEnv` waits for all simulators, and a step of `AsynchronousVecEnv` does not.
`BatchVecEnv` steps the copies inside one simulator.
"""

from __future__ import annotations

from collections.abc import Sequence

from palaestra_trainer.episodes.asynchronous_vec_env import AsynchronousVecEnv
from palaestra_trainer.episodes.batch_vec_env import BatchVecEnv
from palaestra_trainer.episodes.collecting import CollectingVecEnv
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.batch_simulator import BatchSimulator
from palaestra_trainer.simulators.interface import Environment
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.check import Check, go_on


def collecting_env(
    restarters: Sequence[Restarter],
    seed: int,
    check: Check = go_on,
    judge: Environment | None = None,
    *,
    asynchronous: bool = False,
) -> CollectingVecEnv:
    """Return the VecEnv of a run's collecting members; see `SimulatorsVecEnv` and `AsynchronousVecEnv`."""
    if isinstance(restarters[0].member, BatchSimulator):
        return BatchVecEnv(restarters[0], seed, check=check)
    made = AsynchronousVecEnv if asynchronous else SimulatorsVecEnv
    return made(restarters, seed, check=check, judge=judge)
