"""The seed of every episode: a pure function of the episode's stream and number.

A run that was killed and resumed plays the same episodes as one that was not,
because no seed depends on the process. Each stream (collecting, evaluating,
confirming, and any name given to `palaestra-eval --seeds`) has its own sequence
of seeds, so that a policy is never evaluated on the episodes that selected it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np

COLLECT = "collect"
EVALUATE = "A"
CONFIRM = "C"  # `palaestra-eval` uses B by default
_FRESH = 2**31  # the seeds of a run are all below this number


def episode_seed(run_seed: int, stream: str, simulator: int, episode: int) -> int:
    """Return the seed of one episode, in [0, 2**31).

    Args:
        run_seed: the replica's seed, not negative.
        stream: the purpose of the episode.
        simulator: index of the simulator among those of its role; 0 if
            several share one stream, as evaluators do.
        episode: its number, counted from 0 over the whole run.
    """
    name = int.from_bytes(hashlib.sha256(stream.encode()).digest()[:8])
    sequence = np.random.SeedSequence((run_seed, name, simulator, episode))
    return int(sequence.generate_state(1)[0]) >> 1


def episode_seeds(run_seed: int, stream: str, episodes: int, first: int = 0) -> Iterator[int]:
    """Yield the seeds of `episodes` episodes of a stream that simulators share, from number `first` on."""
    return (episode_seed(run_seed, stream, 0, first + episode) for episode in range(episodes))


def fresh_seeds(stream: str, episodes: int, first: int = 0) -> Iterator[int]:
    """Yield the seeds of `episodes` episodes that no run of any job uses, from number `first` on.

    They are in [2**31, 2**32), and those of runs are below, so the policies of two runs are compared on
    episodes that neither has learned from, nor been chosen by.
    """
    return (_FRESH + seed for seed in episode_seeds(0, stream, episodes, first))
