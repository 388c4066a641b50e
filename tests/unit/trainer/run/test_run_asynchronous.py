"""A run with asynchronous collection trains, evaluates, saves and resumes like any other."""

import itertools
import math
import os
import signal

import pytest

from palaestra_trainer.run import checkpoint, training_callback
from palaestra_trainer.waiting.greenlets import let_others


@pytest.fixture
def asked(job):
    """Return a job with three simulators that DQN collects from asynchronously."""
    return job(collection="Asynchronous", collectors=3)


def test_it_trains_the_steps_of_the_job_through_a_fault(play, asked, directory, last_word):
    """If a pending row counted as a step, the policy would learn less than the job asks for."""
    code, _ = play(asked, {"collect-1": {"steps": [5]}}, let_others)

    assert code == 0
    assert 100 <= last_word().step < 100 + 3, "one step has a row of each simulator at most"
    assert [fault.simulator for fault in last_word().faults] == ["collect-1"]
    assert checkpoint.newest(directory.checkpoints).manifest.step == last_word().step


def test_an_interrupted_run_continues_from_its_checkpoint(play, asked, last_word):
    """The steps that were pending are lost, but the run must still have all its steps."""
    steps = itertools.count()

    def interrupt():
        let_others()
        if next(steps) == 15:
            os.kill(os.getpid(), signal.SIGTERM)

    interrupted, _ = play(asked, on_step=interrupt)
    assert interrupted == 75
    before = last_word().step
    resumed, _ = play(asked, on_step=let_others)

    assert 0 < before < 100
    assert resumed == 0
    assert 100 <= last_word().step < 100 + 3, "one step has a row of each simulator at most"


def test_simulators_pause_for_a_long_update_and_not_at_every_step(play, job, monkeypatch):
    """A pause ends all pending steps, so after each pause all simulators have waited for the slowest."""
    monkeypatch.setattr(training_callback, "LONG_LEARNING_S", 0.0)
    wanted = job(collection="Asynchronous", collectors=3, evaluation={"everySteps": 0})

    _, members = play(wanted, on_step=let_others)

    rollouts = math.ceil(100 / (4 * 3))  # DQN learns after 4 steps of each simulator
    assert 1 < members["collect-0"].log.count("pause") <= rollouts


def test_an_algorithm_that_learns_from_rollouts_is_refused_before_a_simulator_starts(play, job, last_word):
    """A class of a user is not in the operator's table, so the trainer must refuse it."""
    code, members = play(job("PPO", collection="Asynchronous", collectors=2))

    assert code == 2
    assert "collection: Asynchronous needs an off-policy algorithm" in last_word().reason
    assert not any("start" in member.log for member in members.values())
