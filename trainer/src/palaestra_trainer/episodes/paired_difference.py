"""Estimate how much more often one policy succeeds than another, from episodes that both played.

The functions are pure: they use no clock and no random numbers, so the same counts give the same interval.

Each episode is a fair bet against a candidate difference. A portfolio of all constant bets, weighted by the
arcsine law, begins with a capital of 1. If the candidate is the true difference, the capital is a martingale.
Then the probability that the capital ever reaches 1/alpha is at most alpha, however often the interval is
computed (Ville 1939). The interval contains the candidates whose capital is below 1/alpha. For the candidate
0, episodes with equal results do not change the capital, so the test is a sequential form of McNemar's test.

Source of the portfolio: Cover (1991), Mathematical Finance 1. Source of intervals from bets: Ryu and Bhatt
(2024), IEEE Transactions on Information Theory 70. Further sources and the reasons are in
docs/decisions/0026-comparing-two-policies.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from math import inf, log, pi
from typing import NamedTuple

import numpy as np

from palaestra_trainer.episodes.wilson import CONFIDENCE

ALPHA = 1.0 - CONFIDENCE
_HALVINGS = 40  # the search for a bound halves its interval this many times, to 1e-12 of its first length


class Difference(NamedTuple):
    """The bounds of the difference between two success rates, each from -1 to 1."""

    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairs:
    """Counts of the episodes that both policies, A and B, have played.

    Attributes:
        both: episodes in which both policies succeeded.
        only_a: episodes in which A succeeded and B did not.
        only_b: episodes in which B succeeded and A did not.
        neither: episodes in which both policies failed.
    """

    both: int = 0
    only_a: int = 0
    only_b: int = 0
    neither: int = 0

    @classmethod
    def of(cls, results: Iterable[tuple[bool, bool]]) -> Pairs:
        """Count the pairs of results of A and B in each episode."""
        seen = list(results)
        return cls(
            both=seen.count((True, True)),
            only_a=seen.count((True, False)),
            only_b=seen.count((False, True)),
            neither=seen.count((False, False)),
        )

    @property
    def episodes(self) -> int:
        """The number of episodes."""
        return self.both + self.only_a + self.only_b + self.neither

    @property
    def equal(self) -> int:
        """The number of episodes in which both policies had the same result."""
        return self.both + self.neither

    @property
    def successes(self) -> tuple[int, int]:
        """The number of episodes in which A succeeded, and the number in which B succeeded."""
        return self.both + self.only_a, self.both + self.only_b

    @property
    def difference(self) -> float:
        """The success rate of A minus the success rate of B, -1 to 1; 0 without episodes."""
        return (self.only_a - self.only_b) / self.episodes if self.episodes else 0.0


class Verdict(StrEnum):
    """The result of a comparison of two policies."""

    A_BETTER = "a"
    B_BETTER = "b"
    ALIKE = "alike"
    UNDECIDED = "undecided"


def verdict(pairs: Pairs, margin: float) -> Verdict:
    """Return the verdict of the episodes so far.

    If this function is called after every episode, the probability that any verdict is wrong is at most 5 %.

    Args:
        pairs: the episodes so far.
        margin: the verdict is ALIKE if the success rates differ by at most this number.
    """
    low, high = interval(pairs)
    if low > 0.0:
        return Verdict.A_BETTER
    if high < 0.0:
        return Verdict.B_BETTER
    return Verdict.ALIKE if max(-low, high) <= margin else Verdict.UNDECIDED


def interval(pairs: Pairs, alpha: float = ALPHA) -> Difference:
    """Return bounds of the difference between the success rates of A and B.

    The bounds are valid after any number of episodes: if they are computed after every episode, the
    probability that the true difference is ever outside the bounds is at most `alpha`.
    """
    gained = partial(log_capital, pairs, weights=_weights(pairs))
    most, middle = -log(alpha), pairs.difference
    return Difference(_last_within(gained, middle, -1.0, most), _last_within(gained, middle, 1.0, most))


def log_capital(pairs: Pairs, difference: float, weights: np.ndarray | None = None) -> float:
    """Return the logarithm of the capital that bets against a candidate difference have won.

    Args:
        pairs: the episodes so far.
        difference: the candidate for the true difference, between -1 and 1.
        weights: the result of `_weights(pairs)`, if the caller has computed it.
    """
    ahead = (1.0 + difference) / 2.0  # the mean of (1 + A's result - B's result) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        for_a = pairs.only_a + np.arange(pairs.equal + 1.0)
        for_b = pairs.only_b + pairs.equal - np.arange(pairs.equal + 1.0)
        paid = _times_log(for_a, ahead) + _times_log(for_b, 1.0 - ahead)
        return float(np.logaddexp.reduce((_weights(pairs) if weights is None else weights) - paid))


def _times_log(count: np.ndarray, share: float) -> np.ndarray:
    """Return count * log(share), 0 where the count is 0."""
    return np.where(count > 0, count * (log(share) if share > 0.0 else -inf), 0.0)


def _weights(pairs: Pairs) -> np.ndarray:
    """Return, for each k, the logarithm of the factor that does not depend on the candidate.

    An episode with equal results is replaced by the toss of a fair coin, which counts for A or for B. k is
    the number of tosses that count for A.
    """
    equal, k = pairs.equal, np.arange(pairs.equal + 1)
    factorial, gamma = _log_factorials(equal), _log_gammas(pairs.episodes)
    coins = factorial[equal] - factorial[k] - factorial[equal - k] - equal * log(2.0)
    bets = gamma[pairs.only_a + k] + gamma[pairs.only_b + equal - k] - _log_factorials(pairs.episodes)[-1]
    return np.asarray(coins + bets - log(pi))


def _log_factorials(most: int) -> np.ndarray:
    """Return log(n!) for n = 0 ... most."""
    return np.concatenate(([0.0], np.cumsum(np.log(np.arange(1.0, most + 1.0)))))


def _log_gammas(most: int) -> np.ndarray:
    """Return log(Gamma(n + 1/2)) for n = 0 ... most."""
    return log(pi) / 2.0 + np.concatenate(([0.0], np.cumsum(np.log(np.arange(most) + 0.5))))


def _last_within(gained: Callable[[float], float], inside: float, outside: float, most: float) -> float:
    """Return the candidate nearest to `outside` whose log capital is below `most`.

    The capital is a log-convex function of the candidate, so the capital does not fall again on the way from
    `inside` to `outside`.
    """
    if gained(outside) < most:
        return outside
    for _ in range(_HALVINGS):
        middle = (inside + outside) / 2.0
        if gained(middle) < most:
            inside = middle
        else:
            outside = middle
    return outside
