"""The seed of an episode is a function of run, stream, simulator and episode number."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.episodes.seeds import COLLECT, EVALUATE, episode_seed, episode_seeds, fresh_seeds

NUMBERS = st.integers(0, 2**31)


@given(NUMBERS, st.text(), st.integers(0, 1000), NUMBERS)
def test_a_seed_is_always_the_same_and_fits_in_31_bits(run, stream, simulator, episode):
    """A seed is sent through ROS and stored in a text field of the simulator, so it must be small."""
    seed = episode_seed(run, stream, simulator, episode)

    assert seed == episode_seed(run, stream, simulator, episode)
    assert 0 <= seed < 2**31


def test_a_known_seed_stays_what_it_is():
    """A run may resume with another release, and must then get the same seeds."""
    assert episode_seed(1, COLLECT, 0, 0) == 2036268347


def test_streams_share_no_seed():
    """A policy must not be measured on the episodes by which it was chosen."""
    many = {
        stream: {episode_seed(1, stream, 0, episode) for episode in range(2000)}
        for stream in (COLLECT, EVALUATE, "B")
    }

    assert not many[COLLECT] & many[EVALUATE]
    assert not many[EVALUATE] & many["B"]


@given(st.text(), NUMBERS)
def test_no_run_of_any_job_uses_a_fresh_seed(stream, first):
    """Seeds of runs have 31 bits, so seeds with 32 bits never occur in a run."""
    (seed,) = fresh_seeds(stream, 1, first)

    assert 2**31 <= seed < 2**32


def test_simulators_and_runs_play_different_episodes():
    """If two simulators collected the same episodes, a run would learn half as much."""
    seeds = {episode_seed(run, COLLECT, simulator, 0) for run in range(50) for simulator in range(8)}

    assert len(seeds) == 400


def test_a_shared_stream_counts_its_episodes():
    """An evaluation has the same episodes with any number of simulators."""
    assert list(episode_seeds(3, "B", 2)) == [episode_seed(3, "B", 0, 0), episode_seed(3, "B", 0, 1)]
