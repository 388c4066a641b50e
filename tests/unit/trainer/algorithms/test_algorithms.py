"""The algorithms as the training loop uses them: making models, invalid rows, saving and loading."""

from __future__ import annotations

import numpy as np
import pytest
import stable_baselines3 as sb3
from gymnasium import spaces
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import explained_variance
from torch import nn, optim

from palaestra_trainer.algorithms import ALGORITHMS, REINFORCE, check, make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.simulators.restarter import Restarter

TINY = {"policy_kwargs": {"net_arch": [8]}}
HYPERPARAMETERS = {
    "DQN": TINY | {"learning_starts": 10, "batch_size": 8, "buffer_size": 200},
    "SAC": TINY | {"learning_starts": 10, "batch_size": 8, "buffer_size": 200},
    "PPO": TINY | {"n_steps": 16, "batch_size": 8, "n_epochs": 2},
    "A2C": TINY,
    "REINFORCE": TINY | {"episodes_per_update": 2},
}
DISCRETE = ["DQN", "PPO", "A2C", "REINFORCE"]


@pytest.fixture
def make_env(make_member):
    """Yield a function that makes a VecEnv of corridors; the first simulator dies at the steps `faults`."""
    made = []

    def make(members=1, faults=()):
        first = make_member("collect-0", steps=faults)
        rest = [make_member(f"collect-{index}") for index in range(1, members)]
        env = SimulatorsVecEnv([Restarter(member) for member in (first, *rest)], run_seed=1)
        made.append(env)
        return env

    yield make
    for env in made:
        env.close()


def model_of(name, env, **hyperparameters):
    """Return a small model of an algorithm."""
    merged = HYPERPARAMETERS[name] | hyperparameters
    return make_model(Algorithm(name=name, hyperparameters=merged), env, seed=1)


class Boundaries(BaseCallback):
    """A callback that records the steps at which rollouts begin."""

    def __init__(self):
        super().__init__()
        self.steps = []

    def _on_rollout_start(self):
        self.steps.append(self.model.num_timesteps)

    def _on_step(self):
        return True


def test_all_thirteen_are_there():
    """The schema of a TrainingJob accepts exactly these names."""
    stable_baselines3 = {"DQN", "PPO", "A2C", "SAC", "TD3", "DDPG"}
    contrib = {"QRDQN", "TQC", "TRPO", "CrossQ", "RecurrentPPO", "MaskablePPO"}

    assert set(ALGORITHMS) == stable_baselines3 | contrib | {"REINFORCE"}


def test_what_yaml_cannot_say_has_words(make_env):
    """YAML has no schedules, tuples or classes of PyTorch, so a job writes them as texts and lists."""
    policy = {"net_arch": [8], "activation_fn": "elu", "optimizer_class": "AdamW"}
    words = {"learning_rate": "lin_0.25", "train_freq": [1, "episode"], "policy_kwargs": policy}
    check(Algorithm(name="DQN", hyperparameters=words))

    model = model_of("DQN", make_env(), **words)

    assert (model.lr_schedule(1.0), model.lr_schedule(0.0)) == (0.25, 0.0)
    assert model.train_freq.frequency == 1
    assert any(isinstance(part, nn.ELU) for part in model.policy.modules())
    assert isinstance(model.policy.optimizer, optim.AdamW)


@pytest.mark.parametrize("place", ["", "nn.", "th.nn.", "torch.nn."])
def test_a_class_of_pytorch_may_have_its_module(make_env, place):
    """Files of RL-Zoo contain the module name under which they import PyTorch."""
    policy = {
        "net_arch": [8],
        "activation_fn": f"{place}Tanh",
        "optimizer_class": f"{place.replace('nn', 'optim')}AdamW",
    }
    check(Algorithm(name="DQN", hyperparameters={"policy_kwargs": policy}))

    model = model_of("DQN", make_env(), policy_kwargs=policy)

    assert any(isinstance(part, nn.Tanh) for part in model.policy.modules())
    assert isinstance(model.policy.optimizer, optim.AdamW)


@pytest.mark.parametrize(
    ("name", "hyperparameters"),
    [
        ("PPO", {"batch_size": 1}),
        ("REINFORCE", {"baseline": "mean"}),
        ("DQN", {"train_freq": "x"}),
    ],
)
def test_wrong_values_are_configuration_errors(make_env, name, hyperparameters):
    """Stable-Baselines3 raises an AssertionError, which would look like a bug of Palaestra."""
    with pytest.raises(ConfigurationError, match=f"algorithm: {name} refuses"):
        model_of(name, make_env(), **hyperparameters)


@pytest.mark.parametrize("name", ["A2C", "PPO"])
def test_an_update_of_one_row_whose_advantage_is_to_be_normalized_is_refused(make_env, name):
    """One number has no standard deviation, so each update would be skipped and nothing would be learned."""
    with pytest.raises(ConfigurationError) as refusal:
        model_of(name, make_env(), n_steps=1, normalize_advantage=True)

    line = "algorithm.hyperparameters.n_steps: 1 step in 1 collecting simulator gives 1 row"
    assert str(refusal.value).startswith(line)
    assert str(refusal.value).endswith("raise n_steps, add a simulator, or set normalize_advantage: false")


@pytest.mark.parametrize(
    ("members", "hyperparameters"),
    [
        (1, {"n_steps": 1, "normalize_advantage": False}),
        (1, {"n_steps": 2, "normalize_advantage": True}),
        (2, {"n_steps": 1, "normalize_advantage": True}),
    ],
)
def test_an_update_of_one_row_is_accepted_without_normalization_and_of_two_with_it(
    make_env, members, hyperparameters
):
    """The error in the test above names these two remedies."""
    model = model_of("A2C", make_env(members), **hyperparameters)

    assert model.n_steps * model.n_envs >= 1 + model.normalize_advantage


@pytest.mark.parametrize("steps", [100, 101, 103])
@pytest.mark.parametrize("faults", [(), (5, 42, 90)])
def test_dqn_ends_at_exactly_its_steps(make_env, steps, faults):
    """The steps need not be a multiple of train_freq, and simulators may die meanwhile."""
    model = model_of("DQN", make_env(faults=faults)).learn(steps)

    assert model.num_timesteps == steps
    assert model.replay_buffer.size() == steps


def test_ppo_ends_at_its_rollout_boundary(make_env):
    """PPO learns only from complete rollouts, so it continues to the end of one."""
    model = model_of("PPO", make_env(members=2)).learn(40)

    assert model.num_timesteps == 64


@pytest.mark.parametrize("name", DISCRETE)
def test_invalid_rows_are_not_counted_as_steps(make_env, name):
    """A run with faults must learn from as many rows as a run without faults."""
    counted = []

    def count(locals_, _):
        counted.extend(info["palaestra"]["valid"] for info in locals_["infos"])
        return True

    model = model_of(name, make_env(members=2, faults=(3, 4, 20))).learn(60, count)

    # A fault makes its own row invalid. If the next episode cannot begin, the following rows are invalid too.
    assert model.num_timesteps == sum(counted) <= len(counted) - 5


def test_a_masked_row_is_missing_from_the_count_of_a_rollout(make_env):
    """A rollout of PPO has a fixed number of rows, but its invalid rows do not count as steps."""
    model = model_of("PPO", make_env(faults=(3, 7)))
    boundaries = Boundaries()

    model.learn(30, boundaries)

    assert boundaries.steps == [0, 12, 28][: len(boundaries.steps)]


def test_a_rollout_without_a_valid_row_is_not_learned_from(make_env):
    """The mean of no rows is NaN, which would spread to all weights."""
    model = model_of("A2C", make_env(faults=range(1, 6)), n_steps=5)

    model.learn(10)

    assert model.num_timesteps == 10
    assert all(bool(it.isfinite().all()) for it in model.policy.parameters())


@pytest.mark.parametrize("name", ["A2C", "PPO"])
@pytest.mark.parametrize("faults", [range(2, 8), range(1, 8)], ids=["one row", "no row"])
def test_an_update_of_fewer_than_two_valid_rows_is_no_divergence(make_env, name, faults):
    """The standard deviation of one advantage is NaN.

    The cause is a fault of a simulator, so the run must not end as diverged.
    """
    short = {"n_steps": 5, "normalize_advantage": True} | ({"batch_size": 5} if name == "PPO" else {})
    model = model_of(name, make_env(faults=faults), **short)

    model.learn(10)

    assert all(bool(it.isfinite().all()) for it in model.policy.parameters())


def test_explained_variance_is_that_of_valid_rows(make_env):
    """The return of an invalid row equals its value, so the row would count as perfectly explained."""
    model = model_of("PPO", make_env(faults=(3, 7)))
    model.set_logger(Logger(folder=None, output_formats=[]))
    recorded = {}
    model.logger.record = lambda name, value, **_: recorded.update({name: value})

    model.learn(12)

    rollout = model.rollout_buffer
    valid = rollout.swap_and_flatten(rollout.valid).flatten()
    values, returns = rollout.values.flatten()[valid], rollout.returns.flatten()[valid]
    assert not valid.all()
    assert recorded["train/explained_variance"] == explained_variance(values, returns)


def test_dqn_with_nothing_but_faults_waits_for_a_row(make_env):
    """Sampling from an empty buffer raises an error, so DQN must not learn before the first valid row."""
    model = model_of("DQN", make_env(faults=range(1, 10)), learning_starts=0)

    model.learn(8)

    assert model.num_timesteps == 8


@pytest.mark.parametrize("name", DISCRETE)
def test_a_saved_model_chooses_the_same_actions(make_env, tmp_path, name):
    """A person must get from the saved file the policy that was trained."""
    env = make_env()
    model = model_of(name, env).learn(40)
    seen = env.observation_space.sample()

    model.save(tmp_path / "model.zip")
    loaded = type(model).load(tmp_path / "model.zip")

    assert loaded.predict(seen, deterministic=True)[0] == model.predict(seen, deterministic=True)[0]


@pytest.mark.parametrize(("name", "theirs"), [("DQN", sb3.DQN), ("PPO", sb3.PPO)])
def test_plain_stable_baselines_loads_what_ours_saved(make_env, tmp_path, name, theirs):
    """A person may use the policy on a machine without this package."""
    model = model_of(name, make_env()).learn(40)
    model.save(tmp_path / "model.zip")

    loaded = theirs.load(tmp_path / "model.zip")

    assert loaded.num_timesteps == model.num_timesteps


def test_several_environments_are_no_reason_to_warn(make_env):
    """Stable-Baselines3 warns of an interval below the number of environments, so the trainer raises it."""
    model = model_of("DQN", make_env(members=3), target_update_interval=1)

    assert model.target_update_interval == 3


def test_a_frequency_in_episodes_may_be_a_list(make_env):
    """YAML has no tuples, so a list stands for one."""
    model = model_of("DQN", make_env(), train_freq=[1, "episode"]).learn(20)

    assert model.num_timesteps >= 20


@pytest.mark.parametrize("text", ["lin_0.002", "lin_2e-3"])
def test_a_learning_rate_may_fall_to_zero(make_env, tmp_path, text):
    """YAML has no functions, so the schedule is a text. Plain Stable-Baselines3 still loads the model."""
    model = model_of("DQN", make_env(), learning_rate=text)

    rates = [model.lr_schedule(remaining) for remaining in (1.0, 0.5, 0.0)]
    model.save(tmp_path / "model.zip")

    assert rates == pytest.approx([0.002, 0.001, 0.0])
    assert sb3.DQN.load(tmp_path / "model.zip").lr_schedule(1.0) == pytest.approx(0.002)


def test_sac_learns_a_continuous_action(make_member):
    """SAC needs a continuous action space, which the other examples do not have."""
    member = make_member()
    member.env.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
    env = SimulatorsVecEnv([Restarter(member)], run_seed=1)

    model = model_of("SAC", env).learn(30)

    assert model.num_timesteps == 30


def test_reinforce_learns_the_corridor(make_env):
    """If the gradient had the wrong sign, the policy would not walk right."""
    model = model_of("REINFORCE", make_env(), learning_rate=0.05, episodes_per_update=4)

    model.learn(500)

    actions = [model.predict(np.array([position / 10, 0.5]), deterministic=True)[0] for position in range(3)]
    assert actions == [1, 1, 1]


def test_reinforce_is_a_stable_baselines_algorithm():
    """Callbacks, wrappers and tools of other projects expect this base class."""
    assert issubclass(REINFORCE, sb3.common.base_class.BaseAlgorithm)
