"""The difference between two policies, which is valid at any number of episodes."""

from __future__ import annotations

from math import exp, lgamma, log, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.episodes.paired_difference import (
    ALPHA,
    Pairs,
    Verdict,
    interval,
    log_capital,
    verdict,
)

COUNTS = st.integers(0, 60)
PAIRS = st.builds(Pairs, both=COUNTS, only_a=COUNTS, only_b=COUNTS, neither=COUNTS)


def and_one(pairs, result):
    """Return the counts after one more episode with this result."""
    counts = {name: getattr(pairs, name) for name in ("both", "only_a", "only_b", "neither")}
    return Pairs(**(counts | {result: counts[result] + 1}))


def swapped(pairs):
    """Return the counts with policies A and B exchanged."""
    return Pairs(both=pairs.both, only_a=pairs.only_b, only_b=pairs.only_a, neither=pairs.neither)


def test_results_are_counted_by_what_both_policies_did():
    """The order of the episodes has no more information than these four counts."""
    pairs = Pairs.of([(True, True), (True, False), (True, False), (False, True), (False, False)])

    assert pairs == Pairs(both=1, only_a=2, only_b=1, neither=1)
    assert pairs.successes == (3, 2)
    assert pairs.difference == pytest.approx(0.2)


@given(PAIRS, st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_a_bet_against_the_true_difference_wins_nothing_on_average(pairs, discordant, for_a):
    """The capital is a martingale, so by Ville's inequality it reaches 20 in at most 5 % of all comparisons.

    The test draws random probabilities for the next episode, and bets against the difference that they imply.
    """
    chances = {
        "only_a": discordant * for_a,
        "only_b": discordant * (1 - for_a),
        "neither": 1 - discordant,
    }
    difference = chances["only_a"] - chances["only_b"]

    expected = sum(
        chance * exp(log_capital(and_one(pairs, result), difference) - log_capital(pairs, difference))
        for result, chance in chances.items()
    )

    assert expected == pytest.approx(1.0, rel=1e-8)


def test_with_optional_stopping_equal_policies_are_told_apart_in_at_most_one_of_twenty_comparisons():
    """The probability is computed exactly, over each path of 400 episodes with unequal results.

    The interval is looked at after each episode. Episodes with equal results change nothing, so any number of
    them may come between.
    """
    alive, rejected = {(0, 0): 1.0}, 0.0
    for _ in range(400):
        following: dict[tuple[int, int], float] = {}
        for (a, b), chance in alive.items():
            for state in ((a + 1, b), (a, b + 1)):
                following[state] = following.get(state, 0.0) + chance / 2
        out = {state for state in following if _log_bet(*state) >= -log(ALPHA)}
        rejected += sum(following[state] for state in out)
        alive = {state: chance for state, chance in following.items() if state not in out}

    assert 0.01 < rejected <= ALPHA


def _log_bet(a, b):
    """Return the logarithm of the capital against a difference of 0, by its closed form."""
    return (a + b) * log(2) + lgamma(a + 0.5) + lgamma(b + 0.5) - lgamma(a + b + 1) - log(pi)


@given(PAIRS)
def test_episodes_with_equal_results_are_no_evidence_of_a_difference(pairs):
    """Like McNemar's test, the comparison uses only episodes with unequal results."""
    assert log_capital(pairs, 0.0) == pytest.approx(_log_bet(pairs.only_a, pairs.only_b), abs=1e-8)


@pytest.mark.parametrize("chances", [(0.9, 0.08, 0.0, 0.02), (0.5, 0.2, 0.1, 0.2), (0.05, 0.5, 0.4, 0.05)])
def test_whoever_looks_after_each_batch_sees_the_true_difference_inside(chances):
    """A person may look at the interval after each batch.

    In at most 5 % of the comparisons, the true difference is outside the interval at any of these looks.
    """
    random = np.random.default_rng(1)
    missed = 0
    for _ in range(100):
        counts = np.cumsum(random.multinomial(10, chances, size=30), axis=0)
        looks = [
            log_capital(Pairs(both=w, only_a=x, only_b=y, neither=z), chances[1] - chances[2])
            for w, x, y, z in counts
        ]
        missed += max(looks) >= -log(ALPHA)

    assert missed <= 100 * ALPHA


@given(PAIRS)
def test_the_observed_difference_is_within_the_interval(pairs):
    """The estimate that is printed next to the interval must be inside it."""
    low, high = interval(pairs)

    assert -1.0 <= low <= pairs.difference <= high <= 1.0


@given(PAIRS)
def test_naming_the_policies_the_other_way_round_mirrors_the_interval(pairs):
    """`compare A B` and `compare B A` must give the same answer."""
    low, high = interval(pairs)

    assert interval(swapped(pairs)) == pytest.approx((-high, -low), abs=1e-9)


@given(PAIRS)
def test_the_interval_excludes_no_difference_exactly_if_the_bets_against_it_have_won(pairs):
    """The interval and the verdict come from the same test, so they cannot contradict each other."""
    low, high = interval(pairs)

    assert (low > 0 or high < 0) == (log_capital(pairs, 0.0) >= -log(ALPHA))


def test_without_episodes_nothing_is_known():
    """Before the first episode, a person must not see a difference."""
    assert interval(Pairs()) == (-1.0, 1.0)
    assert verdict(Pairs(), 0.5) is Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("pairs", "margin", "expected"),
    [
        (Pairs(both=50, only_a=7, neither=10), 0.05, Verdict.A_BETTER),
        (Pairs(both=50, only_a=6, neither=10), 0.05, Verdict.UNDECIDED),
        (Pairs(both=50, only_b=7, neither=10), 0.05, Verdict.B_BETTER),
        (Pairs(both=80), 0.05, Verdict.UNDECIDED),
        (Pairs(both=100), 0.05, Verdict.ALIKE),
        (Pairs(both=100), 0.02, Verdict.UNDECIDED),
        (Pairs(both=9900, only_a=90, neither=10), 0.05, Verdict.A_BETTER),
    ],
)
def test_a_difference_comes_before_a_bound_and_a_bound_before_no_answer(pairs, margin, expected):
    """A difference of 1 % is reported, even if the person would have accepted 5 %."""
    assert verdict(pairs, margin) is expected
