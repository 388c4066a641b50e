"""Complete runs in which simulators break and come back late or never."""

from __future__ import annotations

import json

import pytest

from palaestra_trainer.episodes.seeds import EVALUATE, episode_seeds

DISCRETE = ["DQN", "PPO", "A2C", "REINFORCE"]


@pytest.fixture
def pool(job, make_configuration):
    """Return a function that makes a configuration with several collectors, of which `least` are needed."""

    def make(name, *, least, collectors=2, evaluators=1, **changes):
        content = job(name, collectors=collectors, evaluators=evaluators, **changes).model_dump(by_alias=True)
        for simulator in content["simulators"]:
            simulator["minSimulators"] = least
            simulator["restart"] = {"limit": 2}
        return make_configuration(**content)

    return make


def summary(directory):
    """Return the content of the run's summary."""
    return json.loads(directory.summary.read_text())


@pytest.mark.parametrize("name", DISCRETE)
def test_a_run_goes_on_without_a_simulator_that_was_given_up(play, pool, directory, name):
    """The run takes longer, but learns from as many steps."""
    code, members = play(pool(name, least=1), {"collect-0": {"steps": range(10, 1000)}})

    assert code == 0
    assert summary(directory)["steps"] >= 100
    assert members["collect-0"].log.count("restart") == 2


@pytest.mark.parametrize("name", DISCRETE)
def test_training_begins_without_a_simulator_that_does_not_come_up(play, pool, directory, name):
    """The rows of this simulator have no observation, and nothing is learned from them."""
    code, members = play(pool(name, least=1), {"collect-0": {"starts": range(1, 1000)}})

    assert code == 0
    assert summary(directory)["steps"] >= 100
    assert members["collect-0"].env.seeds == []


def test_an_evaluation_has_all_its_episodes_whichever_simulator_is_left(play, pool, directory):
    """Either evaluating simulator may break, and the other one plays all episodes."""
    faults = {"evaluate-0": {"steps": range(3, 1000)}}

    code, members = play(pool("DQN", least=1, collectors=1, evaluators=2), faults)

    assert code == 0
    assert summary(directory)["success_rate"] is not None
    assert {*episode_seeds(1, EVALUATE, 4)} <= {*members["evaluate-1"].env.seeds}


def test_too_few_simulators_end_the_run(play, pool, last_word):
    """With fewer simulators a run takes longer, so a job sets the least number.

    The message has the simulator, its last fault and the remedy.
    """
    code, _ = play(pool("DQN", least=2), {"collect-1": {"steps": range(10, 1000)}})

    assert code == 80
    assert (
        "collect-1: 2 restarts within 600 s did not repair the simulator (dead 2; last: "
        in last_word().reason
    )


@pytest.mark.parametrize("name", DISCRETE)
def test_a_simulator_that_is_mended_for_long_holds_up_nobody(play, pool, directory, name):
    """The run ends before the simulator is back, and then ends the restart too."""
    code, members = play(pool(name, least=2), {"collect-0": {"steps": [10], "held": True}})

    assert code == 0
    assert summary(directory)["steps"] >= 100
    assert members["collect-0"].log[-2:] == ["restart", "stop"]
