"""Buffers of a job's author: prioritized replay, other returns, and their state in a checkpoint."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from palaestra_trainer.algorithms import check, make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.run import checkpoint
from palaestra_trainer.simulators.restarter import Restarter
from tests.tables import for_each

LAB = '''
import collections

import numpy as np
import stable_baselines3 as sb3
import torch
from sb3_contrib.common.maskable.buffers import MaskableRolloutBuffer
from stable_baselines3.common.buffers import (
    DictReplayBuffer, NStepReplayBuffer, ReplayBuffer, RolloutBuffer,
)


class Prioritized(ReplayBuffer):
    """New rows have the greatest priority so far; each sample halves that of its rows."""

    def __init__(self, *args, alpha=0.6, **kwargs):
        super().__init__(*args, **kwargs)
        self.alpha = alpha
        self.priorities = np.zeros(self.buffer_size)
        self.weights = torch.zeros(self.buffer_size)
        self.greatest = 1.0
        self.added = []

    def add(self, obs, next_obs, action, reward, done, infos):
        self.priorities[self.pos] = self.greatest
        self.added.append(len(infos))
        super().add(obs, next_obs, action, reward, done, infos)

    def sample(self, batch_size, env=None):
        chances = self.priorities[: self.size()] ** self.alpha
        rows = np.random.choice(self.size(), batch_size, p=chances / chances.sum())
        self.priorities[rows] /= 2
        self.weights[rows] += 1
        return self._get_samples(rows, env)


class Tree:
    def __init__(self):
        self.sums = np.zeros(4)


class Treed(ReplayBuffer):
    """A buffer with an object that a checkpoint cannot store, and without `state_dict`."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.tree = Tree()


class Stated(Treed):
    """The same buffer with methods that save and load the object."""

    def state_dict(self):
        return {"sums": self.tree.sums + self.pos}

    def load_state_dict(self, state):
        self.tree.sums = state["sums"]


class Broken(Treed):
    """The same buffer with a `state_dict` that raises an error."""

    def state_dict(self):
        return {"sums": self.trees}

    def load_state_dict(self, state):
        pass


class Tail(ReplayBuffer):
    """A buffer with a deque, which JSON cannot represent."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.tail = collections.deque()


class Steps(NStepReplayBuffer):
    """A buffer with returns of n steps."""


class ForDict(DictReplayBuffer):
    """A buffer for observations of a Dict."""


class Greedy(RolloutBuffer):
    """A buffer whose advantages are the returns."""

    def __init__(self, *args, scale=1.0, **kwargs):
        super().__init__(*args, **kwargs)
        self.scale, self.rollouts = scale, 0

    def compute_returns_and_advantage(self, last_values, dones):
        super().compute_returns_and_advantage(last_values, dones)
        self.rollouts += 1
        self.advantages = self.scale * self.returns


class Ordered(RolloutBuffer):
    """A buffer that yields its own batches."""

    def get(self, batch_size=None):
        yield from super().get(batch_size)


class Masks(MaskableRolloutBuffer):
    """A buffer for MaskablePPO."""


class PrioritizedDQN(sb3.DQN):
    """DQN that sets the class of its buffer itself."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, replay_buffer_class=Prioritized, **kwargs)
'''
OFF_POLICY = {"buffer_size": 64, "learning_starts": 8, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}}
ON_POLICY = {"n_steps": 8, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}}


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """Write a user's module into a folder on the import path, and return the module."""
    (tmp_path / "buffer_lab.py").write_text(LAB)
    monkeypatch.syspath_prepend(tmp_path)
    yield pytest.importorskip("buffer_lab")
    sys.modules.pop("buffer_lab", None)


@pytest.fixture
def make(make_member):
    """Return a function that makes a model in the corridor.

    The first of two simulators dies at the steps `faults`.
    """

    def made(algorithm, faults=()):
        env = SimulatorsVecEnv(
            [Restarter(make_member("collect-0", steps=faults)), Restarter(make_member("collect-1"))], 1
        )
        return make_model(algorithm, env, seed=1), env

    return made


def replaying(name="DQN", buffer="buffer_lab:Prioritized", **options):
    """Return an algorithm with a user's replay buffer."""
    chosen = {"replay_buffer_class": buffer} | ({"replay_buffer_kwargs": options} if options else {})
    return Algorithm(name=name, hyperparameters=OFF_POLICY | chosen)


def test_a_replay_buffer_of_ones_own_stores_valid_rows_one_by_one(lab, make):
    """The author's `add` need not handle faults or several simulators: it gets one valid row at a time."""
    algorithm = replaying(alpha=0.5)
    check(algorithm)
    model, _ = make(algorithm, faults=(3, 9))

    model.learn(40)

    buffer = model.replay_buffer
    assert isinstance(buffer, lab.Prioritized)
    assert buffer.alpha == 0.5
    assert len(buffer.added) == model.num_timesteps == buffer.size()
    assert set(buffer.added) == {1}
    assert buffer.weights.sum() > 0  # the user's own `sample` is called


def test_an_algorithm_of_ones_own_may_bring_its_buffer(lab, make):
    """The buffer of a user's algorithm stores only valid rows too."""
    model, _ = make(Algorithm(name="buffer_lab:PrioritizedDQN", hyperparameters=OFF_POLICY), faults=(3,))

    model.learn(30)

    assert isinstance(model.replay_buffer, lab.Prioritized)
    assert len(model.replay_buffer.added) == model.num_timesteps


def test_a_rollout_buffer_of_ones_own_returns_what_it_computes(lab, make):
    """The losses must use the advantages of the author's class, but no row of a fault."""
    chosen = {"rollout_buffer_class": "buffer_lab:Greedy", "rollout_buffer_kwargs": {"scale": 2.0}}
    algorithm = Algorithm(name="PPO", hyperparameters=ON_POLICY | chosen)
    check(algorithm)
    model, _ = make(algorithm, faults=(3, 9))

    model.learn(32)

    buffer = model.rollout_buffer
    assert isinstance(buffer, lab.Greedy)
    assert (~buffer.valid).any() or buffer.rollouts > 1
    assert np.array_equal(buffer.advantages, 2 * buffer.returns)


@pytest.mark.parametrize("buffer", ["buffer_lab:Prioritized", "buffer_lab:Stated"])
def test_a_checkpoint_keeps_what_the_buffer_adds(lab, make, make_configuration, tmp_path, buffer):
    """A resumed run must sample with the same priorities as before.

    The checkpoint has the arrays, tensors and numbers among the buffer's attributes. If the buffer has the
    method `state_dict`, the checkpoint has its result instead.
    """
    del lab
    algorithm = replaying(buffer=buffer)
    configuration = make_configuration(algorithm=algorithm.model_dump())
    before, env = make(algorithm)
    before.learn(30)
    state = checkpoint.TrainingState.of(before, env.snapshot(), {})
    saver = checkpoint.Saver(tmp_path / "checkpoints", keep=1)
    saver.save(before, state, checkpoint.describe(configuration, 30, {}))
    after, _ = make(algorithm)

    checkpoint.restore(checkpoint.newest(tmp_path / "checkpoints"), after)

    if buffer.endswith("Stated"):
        assert np.array_equal(after.replay_buffer.tree.sums, np.full(4, before.replay_buffer.pos))
        return
    for name in ("priorities", "weights", "greatest", "added"):
        one, other = getattr(before.replay_buffer, name), getattr(after.replay_buffer, name)
        assert type(one) is type(other)
        assert np.array_equal(one, other), name


def test_a_run_with_a_buffer_of_ones_own_is_saved_and_resumed(lab, play, job):
    """A person may raise `steps` later, and the run then continues with the same buffer."""
    del lab
    algorithm = replaying().model_dump(exclude_unset=True)

    first, _ = play(job(algorithm=algorithm, steps=60), {"collect-0": {"steps": [9]}})
    longer, _ = play(job(algorithm=algorithm, steps=90))

    assert (first, longer) == (0, 0)


def _refusal(act):
    with pytest.raises(ConfigurationError) as caught:
        act()
    return str(caught.value)


REFUSED = [
    ("DQN", {"replay_buffer_class": "buffer_lab:Steps"}, "Steps takes the following row as the next step"),
    ("DQN", {"replay_buffer_class": "stable_baselines3:HerReplayBuffer"}, "use HerReplayBuffer by its name"),
    ("DQN", {"replay_buffer_class": "buffer_lab:Greedy"}, "is not a subclass of ReplayBuffer"),
    ("DQN", {"replay_buffer_class": "buffer_lab:Missing"}, "cannot be imported"),
    ("DQN", {"replay_buffer_class": "Prioritized"}, "write HerReplayBuffer or module:Class"),
    (
        "DQN",
        {"replay_buffer_class": "buffer_lab:Prioritized", "replay_buffer_kwargs": {"alfa": 1}},
        "replay_buffer_kwargs.alfa: is not an option of this buffer; did you mean alpha?",
    ),
    (
        "DQN",
        {"replay_buffer_class": "buffer_lab:ForDict", "replay_buffer_kwargs": {"depth": 1}},
        "the class of the buffer has no options of its own",
    ),
    ("PPO", {"rollout_buffer_class": "buffer_lab:Ordered"}, "Ordered overrides get, so"),
    ("PPO", {"rollout_buffer_class": "Greedy"}, "write module:Class"),
    ("PPO", {"rollout_buffer_kwargs": {}}, "has no effect without rollout_buffer_class"),
]


@for_each("name, given, fact", REFUSED)
def test_buffers_that_cannot_be_used_are_refused_before_a_simulator_starts(lab, name, given, fact):
    """A person waits only seconds for the error, and not for the start of the simulators."""
    del lab
    with pytest.raises(ConfigurationError) as caught:
        check(Algorithm(name=name, hyperparameters=given))

    assert fact in str(caught.value)


UNFIT = [
    ("DQN", {"replay_buffer_class": "buffer_lab:ForDict"}, "takes observations that are a Dict, unlike"),
    ("DQN", {"replay_buffer_class": "buffer_lab:Treed"}, "has tree, a Tree, which a checkpoint cannot store"),
    ("DQN", {"replay_buffer_class": "buffer_lab:Tail"}, "has tail, a deque"),
    ("DQN", {"replay_buffer_class": "buffer_lab:Broken"}, "Broken.state_dict failed (AttributeError"),
    (
        "PPO",
        {"rollout_buffer_class": "buffer_lab:Masks"},
        "Masks does not fit PPO, which has no action masks",
    ),
    ("MaskablePPO", {"rollout_buffer_class": "buffer_lab:Greedy"}, "which needs action masks"),
]


@for_each("name, given, fact", UNFIT)
def test_buffers_that_do_not_fit_are_refused_when_the_model_is_made(lab, make, name, given, fact):
    """Whether a buffer fits depends on the environment, or on attributes of the class."""
    del lab
    usual = OFF_POLICY if name == "DQN" else ON_POLICY
    with pytest.raises(ConfigurationError) as caught:
        make(Algorithm(name=name, hyperparameters=usual | given))

    assert fact in str(caught.value)


def test_a_checkpoint_that_lost_rows_is_refused_for_a_buffer_of_ones_own(lab, make):
    """Only the user's class knows which of its own numbers belong to lost rows."""
    del lab
    model, _ = make(replaying())

    with pytest.raises(ConfigurationError, match="restore the run directory from a copy"):
        model.replay_buffer.keep(np.zeros(64, dtype=bool))
