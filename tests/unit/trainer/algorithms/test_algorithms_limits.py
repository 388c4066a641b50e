"""Numbers with which an algorithm would fail only while it learns are rejected before a simulator starts.

With each number that is accepted, the algorithm learns a few rows.
"""

from __future__ import annotations

import gymnasium
import pytest
from gymnasium import spaces
from stable_baselines3.common.vec_env import DummyVecEnv

from palaestra_trainer.algorithms import ALGORITHMS, check, make_model
from palaestra_trainer.algorithms.constructor_params import types
from palaestra_trainer.algorithms.divergence import Learner
from palaestra_trainer.algorithms.hyperparameters import policy_class
from palaestra_trainer.algorithms.registry import entry_of
from palaestra_trainer.environments.infos import OURS
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.run.attempt import use_threads
from palaestra_trainer.testing import FakeTask, MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS
from tests.tables import for_each

TINY = {"net_arch": [8]}
SMALL = {
    "n_steps": 16,
    "batch_size": 8,
    "learning_starts": 10,
    "buffer_size": 200,
    "n_epochs": 2,
    "episodes_per_update": 1,
    "policy_kwargs": TINY,
}
# The signature rejects numbers of another type; each parameter gets the numbers of this list.
NUMBERS = (0, -1, 1, 0.0, -0.5)


class Valid(gymnasium.Wrapper):
    """A task whose rows are marked as valid, as a collector marks them."""

    def step(self, action):
        """Take a step, and mark its row as valid."""
        *results, info = self.env.step(action)
        return *results, info | {OURS: {"valid": True}}


def refusal_of(algorithm, members=2):
    """Return the message with which the algorithm is rejected.

    If it is accepted, let it learn and return "".
    """
    actions = entry_of(algorithm.name).actions
    kind = "Box" if spaces.Box in actions else "Discrete"
    task = MaskedTask if algorithm.name == "MaskablePPO" else FakeTask
    env = DummyVecEnv([lambda: Valid(task(OBSERVATIONS["Box"], ACTIONS[kind]))] * members)
    try:
        check(algorithm)
        model = make_model(algorithm, env, seed=1)
    except ConfigurationError as error:
        return str(error)
    model.learn(32)
    Learner(model).check(model.num_timesteps)
    assert model._n_updates > 0
    return ""


def small(name, **given):
    """Return an algorithm with small hyperparameters, some of which `given` replaces."""
    entry = entry_of(name)
    usual = {key: value for key, value in SMALL.items() if key in entry.known}
    if entry.replays:
        del usual["n_steps"]
    if name == "RecurrentPPO":
        usual["policy_kwargs"] = TINY | {"lstm_hidden_size": 8}
    return Algorithm(name=name, hyperparameters=usual | given)


def every_number():
    """Yield each algorithm with each number for each of its hyperparameters and its policy's parameters."""
    for name in ALGORITHMS:
        entry = entry_of(name)
        usual = small(name).hyperparameters["policy_kwargs"]
        yield from (small(name, **{key: value}) for key in entry.known for value in NUMBERS)
        for key in types(policy_class(entry.original, None)):
            yield from (small(name, policy_kwargs=usual | {key: value}) for value in (*NUMBERS, [0], [-1]))


@pytest.mark.filterwarnings("ignore")  # such as a mean of no rows, or a batch size that is no divisor
@for_each("algorithm", every_number)
def test_what_is_not_refused_learns(algorithm):
    """An accepted number could otherwise cause a division by zero after the simulators have started."""
    use_threads()
    refusal_of(algorithm)


@pytest.mark.parametrize(
    ("name", "given", "line"),
    [
        ("PPO", {"n_epochs": 0}, "n_epochs: 0 is refused; give a number of at least 1"),
        ("TD3", {"policy_delay": 0}, "policy_delay: 0 is refused; give a number of at least 1"),
        ("SAC", {"gamma": 99.0}, "gamma: 99.0 is refused; give 0 to 1"),
        ("SAC", {"gradient_steps": 0}, "gradient_steps: with 0 nothing is learned; give a number above 0"),
        ("DQN", {"train_freq": [0, "episode"]}, "train_freq: [0, 'episode'] is refused"),
        ("DQN", {"train_freq": [1, "episode"]}, "train_freq: counts in episodes, which only one collecting"),
        ("PPO", {"policy_kwargs": {"net_arch": [0]}}, "policy_kwargs.net_arch: a layer of 0 is refused"),
        ("PPO", {"learning_rate": 0}, "learning_rate: 0 is refused; give a number above 0"),
        ("RecurrentPPO", {"batch_size": 1}, "batch_size: 1 is refused; give a number of at least 2"),
        ("MaskablePPO", {"batch_size": 1}, "batch_size: 1 is refused; give a number of at least 2"),
        ("TQC", {"top_quantiles_to_drop_per_net": 25}, "25 of 25 quantiles of each critic leaves none"),
        ("DQN", {"replay_buffer_class": ["HerReplayBuffer"]}, "write HerReplayBuffer or module:Class"),
    ],
)
def test_a_number_out_of_its_range_is_refused_with_the_range(name, given, line):
    """A person then knows which value to write, without the documentation of the algorithm."""
    assert line in refusal_of(small(name, **given))


def test_a_frequency_in_episodes_fits_one_simulator():
    """Stable-Baselines3 counts train_freq in episodes only with a single environment."""
    assert not refusal_of(small("DQN", train_freq=[1, "episode"]), members=1)


@pytest.mark.parametrize("name", ["sb3_contrib:MaskablePPO", "sb3_contrib:RecurrentPPO"])
def test_a_class_by_its_name_has_the_ranges_of_the_algorithm_that_it_is(name):
    """The class decides which numbers fail, whatever name the job uses for the class."""
    with pytest.raises(ConfigurationError, match="batch_size: 1 is refused; give a number of at least 2"):
        check(Algorithm(name=name, hyperparameters={"batch_size": 1}))
