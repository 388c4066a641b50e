"""Compute the seed of every episode, as a pure function of the episode's stream and number.

A run that was killed and resumed plays the same episodes as an uninterrupted run, because seeds do not depend
on the process. Each stream has its own sequence of seeds: collecting, evaluating, confirming, and any name of
`palaestra-eval --seeds`. So a policy is not confirmed or finally evaluated on the episodes that selected it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np

COLLECT = "collect"
EVALUATE = "A"
CONFIRM = "C"  # not B, because B is the default of `palaestra-eval`
_FRESH = 2**31  # all seeds of a run are below this number


def episode_seed(run_seed: int, stream: str, simulator: int, episode: int) -> int:
    """Return the seed of one episode, in [0, 2**31).

    Args:
        run_seed: the replica's seed, not negative.
        stream: name of the stream of seeds; each purpose of episodes has its own stream.
        simulator: index of the simulator among the simulators of its role; 0 if several simulators share a
            stream, as in evaluations.
        episode: number of the episode in the whole run, counted from 0.
    """
    name = int.from_bytes(hashlib.sha256(stream.encode()).digest()[:8])
    sequence = np.random.SeedSequence((run_seed, name, simulator, episode))
    return int(sequence.generate_state(1)[0]) >> 1


def episode_seeds(run_seed: int, stream: str, episodes: int, first: int = 0) -> Iterator[int]:
    """Yield seeds for `episodes` episodes of a shared stream, from episode number `first` on."""
    return (episode_seed(run_seed, stream, 0, first + episode) for episode in range(episodes))


def fresh_seeds(stream: str, episodes: int, first: int = 0) -> Iterator[int]:
    """Yield seeds for `episodes` episodes that no run uses, from episode number `first` on.

    These seeds are in [2**31, 2**32), and the seeds of runs are below 2**31. So two policies are compared on
    episodes that neither of them learned from, and that were not used to select either of them.
    """
    return (_FRESH + seed for seed in episode_seeds(0, stream, episodes, first))
