"""Settings by which a run learns nothing, or too little, are reported at its start and at its end."""

from __future__ import annotations

import json

import gymnasium
import pytest
import structlog
from gymnasium.wrappers import NormalizeObservation, NormalizeReward

from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt

STEPS = 40
SMALL = {"policy_kwargs": {"net_arch": [4]}}


@pytest.fixture
def play(make_member, make_configuration, tmp_path, monkeypatch):
    """Return a function that trains; it returns the exit code, the reason and the warnings in the log."""
    word = tmp_path / "word"
    monkeypatch.setenv("PALAESTRA_TERMINATION_LOG", str(word))

    def run(name, wrapper=lambda env: env, **hyperparameters):
        def make_members(given):
            members = [make_member(entry.name) for entry in given.simulators]
            for member in members:
                member.env = wrapper(member.env)
            return members

        configuration = make_configuration(
            algorithm={"name": name, "hyperparameters": SMALL | hyperparameters},
            steps=STEPS,
            evaluation={"everySteps": 0},
        )
        with structlog.testing.capture_logs() as logged:
            code = attempt.run(configuration, RunDirectory(tmp_path / "run"), make_members)
        warned = [line["event"] for line in logged if line["log_level"] == "warning"]
        return code, json.loads(word.read_text())["reason"], "\n".join(warned)

    return run


def test_learning_that_starts_after_the_end_is_told(play):
    """The model would be the random one with which the run began."""
    code, word, warned = play("DQN", learning_starts=STEPS, buffer_size=100)

    assert code == 0
    assert f"learning_starts: {STEPS} is not less than steps ({STEPS}), so nothing is learned" in warned
    assert "nothing was learned" in word


def test_a_rollout_of_more_steps_than_the_run_is_told(play):
    """Stable-Baselines3 completes its rollout, so the run takes more steps than the job asks for."""
    code, word, warned = play("PPO", n_steps=64, batch_size=8)

    assert code == 0
    assert f"a rollout is 64 steps (64 of each simulator), so the run takes 64 steps, not {STEPS}" in warned
    assert "nothing was learned" not in word


@pytest.mark.parametrize(
    ("name", "given", "line"),
    [
        ("DQN", {"train_freq": 1000}, "1000 steps come before each update"),
        ("REINFORCE", {"episodes_per_update": 1000}, "1000 episodes are more than the run has"),
        ("DQN", {"train_freq": [100, "episode"]}, "an update waited for whole episodes"),
    ],
)
def test_updates_that_are_rarer_than_the_steps_are_told(play, name, given, line):
    """A policy was once updated a single time in a run of two minutes, and no line reported it."""
    off_policy = {"learning_starts": 4, "buffer_size": 100, "batch_size": 4} if name == "DQN" else {}

    code, _, warned = play(name, **off_policy, **given)

    assert code == 0
    assert line in warned


def test_a_run_that_learns_says_nothing_of_it(play):
    """If every run logged these warnings, the tests above would pass and users would ignore the warnings."""
    assert play("DQN", learning_starts=10, buffer_size=100, batch_size=4) == (
        0,
        "Completed: the training is complete",
        "",
    )


@pytest.mark.parametrize("wrapper", [NormalizeObservation, NormalizeReward])
def test_a_wrapper_with_statistics_of_its_own_is_refused(play, wrapper):
    """A resume would lose the statistics, and the evaluating simulator would have other ones."""
    code, word, _ = play("PPO", lambda env: gymnasium.wrappers.TimeLimit(wrapper(env), 9), n_steps=16)

    assert code == 2
    assert f"{wrapper.__name__} has statistics that the policy's file lacks" in word
    assert "set algorithm.normalize" in word
