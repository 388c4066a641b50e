"""The terms of a reward, and the reward as their weighted sum."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.environments import rewards
from palaestra_trainer.environments.rewards import TERMS, WEIGHTS, EpisodeOutcome, Transition, reward_terms

SINGLE = tuple(
    it for it in EpisodeOutcome if it is not EpisodeOutcome.DELIVERED
)  # the possible ends of an episode with one target


def transition(
    before_m: float = 1.0,
    after_m: float = 1.0,
    outcome: EpisodeOutcome = EpisodeOutcome.RUNNING,
    nearest_m: float = 0.4,
) -> Transition:
    """Return a step with these values, in which nothing else happened."""
    return Transition(before_m=before_m, after_m=after_m, outcome=outcome, nearest_m=nearest_m)


def test_progress_is_what_was_gained_toward_the_target():
    """Progress is in meters, so all steps together earn the initial distance to the target."""
    assert rewards.progress(transition(1.0, 0.9)) == pytest.approx(0.1)
    assert rewards.progress(transition(0.9, 1.0)) == pytest.approx(-0.1)


def test_standing_still_earns_no_progress():
    """If the value were not exactly 0, a policy could collect rounding errors."""
    assert rewards.progress(transition(0.7, 0.7)) == 0.0


@given(st.lists(st.floats(0.0, 5.0), min_size=2, max_size=20))
def test_no_detour_earns_more_progress_than_the_straight_way(distances):
    """The progress of all steps adds up to the difference of two distances, so a circle earns nothing."""
    total = sum(
        rewards.progress(transition(before, after)) for before, after in itertools.pairwise(distances)
    )

    assert total == pytest.approx(distances[0] - distances[-1], abs=1e-9)


@pytest.mark.parametrize(("nearest_m", "worth"), [(0.4, 0.0), (0.18, 0.0), (0.105, 0.5), (0.03, 1.0)])
def test_proximity_grows_as_things_come_nearer(nearest_m, worth):
    """The agent gets a cost before it collides; far from obstacles the cost is 0."""
    assert rewards.proximity(transition(nearest_m=nearest_m)) == pytest.approx(worth)


@pytest.mark.parametrize(
    ("term", "outcome"),
    [
        (rewards.success, EpisodeOutcome.REACHED),
        (rewards.collision, EpisodeOutcome.COLLIDED),
        (rewards.time_up, EpisodeOutcome.TIME_UP),
    ],
)
def test_a_term_about_the_end_is_one_for_its_own_outcome_only(term, outcome):
    """If a term were paid for another outcome too, a policy would be rewarded for a wrong end."""
    paid = {it: term(transition(outcome=it)) for it in SINGLE}

    assert paid == {it: float(it is outcome) for it in SINGLE}


def test_every_step_has_the_same_duration():
    """The weight of this term is a cost per step, so the term must be the same in every step."""
    assert {rewards.duration(transition(outcome=it)) for it in EpisodeOutcome} == {1.0}


@pytest.mark.parametrize("reward", WEIGHTS)
def test_a_reward_is_made_of_known_terms(reward):
    """With a misspelled name, the weight would be ignored for the whole training."""
    assert set(WEIGHTS[reward]) <= set(TERMS)


def test_terms_are_reported_weighted():
    """The plotted terms add up to the reward from which the policy learns."""
    step = transition(1.0, 0.9, EpisodeOutcome.REACHED)

    terms = reward_terms("Dense", step)

    assert terms == {name: weight * TERMS[name](step) for name, weight in WEIGHTS["Dense"].items()}


def test_sparse_pays_at_the_end_only():
    """Before the end, a step earns nothing, however near to the target it leads."""
    assert sum(reward_terms("Sparse", transition(2.0, 1.9)).values()) == 0.0
    assert sum(reward_terms("Sparse", transition(outcome=EpisodeOutcome.REACHED)).values()) > 0.0
    assert sum(reward_terms("Sparse", transition(outcome=EpisodeOutcome.COLLIDED)).values()) < 0.0
    assert sum(reward_terms("Sparse", transition(outcome=EpisodeOutcome.TIME_UP)).values()) < 0.0


@pytest.mark.parametrize("reward", WEIGHTS)
def test_each_of_several_targets_is_worth_as_much_as_a_single_one(reward):
    """With other weights, a policy might prefer some targets. Only the last target ends the episode."""
    delivered, reached = (
        reward_terms(reward, transition(outcome=it))
        for it in (EpisodeOutcome.DELIVERED, EpisodeOutcome.REACHED)
    )

    assert delivered == reached
    assert not EpisodeOutcome.DELIVERED.terminal


@pytest.mark.parametrize("reward", WEIGHTS)
def test_reaching_the_target_is_the_best_end(reward):
    """If an early collision or waiting had a higher return, the policy would learn to collide or to wait."""
    worth = {it: sum(reward_terms(reward, transition(outcome=it)).values()) for it in SINGLE}

    assert max(worth, key=worth.__getitem__) is EpisodeOutcome.REACHED
    assert min(worth, key=worth.__getitem__) is EpisodeOutcome.COLLIDED


def test_the_end_of_the_time_is_no_end_of_the_task():
    """The learner then estimates the value of the steps that the time limit cut off."""
    assert [it for it in EpisodeOutcome if it.terminal] == [EpisodeOutcome.REACHED, EpisodeOutcome.COLLIDED]
