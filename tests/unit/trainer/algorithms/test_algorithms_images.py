"""Runs with images as observations."""

from __future__ import annotations

import io
import os
import signal
import zipfile

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import FlattenExtractor, NatureCNN

from palaestra_trainer.algorithms import make_model
from palaestra_trainer.algorithms.small_cnn import SmallCnn
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, Normalize
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run import attempt, checkpoint
from palaestra_trainer.simulators.restarter import Restarter

ROWS, COLUMNS = 36, 48
OFF_POLICY = {"learning_starts": 10, "batch_size": 8, "buffer_size": 60, "target_update_interval": 10}
HYPERPARAMETERS = {
    "DQN": OFF_POLICY,
    "PPO": {"n_steps": 16, "batch_size": 8, "n_epochs": 1},
    "A2C": {},
    "REINFORCE": {"episodes_per_update": 2},
}
NORMALIZE = {"observations": False}


@pytest.fixture
def make_seeing(make_member):
    """Return a function that makes a simulator of the corridor.

    Its observation is a channels-last image of its position.
    """

    def make(name, shape=(ROWS, COLUMNS, 3)):
        member = make_member(name)
        corridor = member.env

        class Gallery(type(corridor)):
            observation_space = spaces.Box(0, 255, shape, np.uint8)

            def _observe(self):
                picture = np.zeros(shape, np.uint8)
                picture[:, 20 + self._position] = 255
                picture[self._digit] = 100
                return picture

        member.env = Gallery(member)
        return member

    return make


@pytest.fixture
def play(make_seeing, job, tmp_path):
    """Return a function that trains into a folder; a signal comes at step `signal_at` of the attempt."""

    def run(folder, name, collectors=1, signal_at=0, normalize=None, cnn=None):
        algorithm = {"name": name, "hyperparameters": HYPERPARAMETERS[name], "cnn": cnn}
        steps = iter(range(1, 10_000))

        def make_members(given):
            members = [make_seeing(entry.name) for entry in given.simulators]
            take = members[0].take_step
            members[0].take_step = lambda: (
                take(),
                next(steps) == signal_at and os.kill(os.getpid(), signal.SIGTERM),
            )
            return members

        if normalize is not None:
            algorithm["normalize"] = normalize
        configuration = job(name, algorithm=algorithm, steps=90, collectors=collectors)
        directory = RunDirectory(tmp_path / folder)
        return attempt.run(configuration, directory, make_members), directory

    return run


def outcome(directory):
    """Return the tensors and the evaluations of a run."""
    path = checkpoint.newest(directory.checkpoints).path / "model.zip"
    with zipfile.ZipFile(path) as archive:
        tensors = torch.load(io.BytesIO(archive.read("policy.pth")), weights_only=True)
    lines = [{**line, "seconds": 0} for line in read_lines(directory.evaluations)]
    return {name: tensor.tolist() for name, tensor in tensors.items()}, lines


@pytest.mark.parametrize(
    ("name", "normalize"),
    [*((name, None) for name in sorted(HYPERPARAMETERS)), ("DQN", NORMALIZE), ("PPO", NORMALIZE)],
    ids=lambda it: "rewards-normalized" if it == NORMALIZE else it,
)
def test_a_run_on_images_that_is_interrupted_ends_as_one_that_was_not(play, name, normalize):
    """An interruption must not change the result, although Stable-Baselines3 changes the images' layout."""
    whole, reference = play("whole", name, collectors=2, normalize=normalize)
    interrupted, directory = play("cut", name, collectors=2, signal_at=28, normalize=normalize)

    resumed, _ = play("cut", name, collectors=2, normalize=normalize)

    assert (whole, interrupted, resumed) == (0, 75, 0)
    assert [line["reason"][:7] for line in read_lines(directory.attempts)] == ["new run", "resumed"]
    assert outcome(directory) == outcome(reference)


def test_a_checkpoint_keeps_images_as_the_environment_returned_them(play):
    """At a resume, the images are compared with those that the environments return."""
    _, directory = play("run", "PPO")

    with np.load(checkpoint.newest(directory.checkpoints).path / "state.npz") as arrays:
        assert arrays["observation"].shape == (1, ROWS, COLUMNS, 3)


@pytest.mark.parametrize("name", sorted(HYPERPARAMETERS))
@pytest.mark.parametrize("shape", [(ROWS, COLUMNS, 3), (3, ROWS, COLUMNS)], ids=["last", "first"])
def test_images_get_the_policy_for_images(make_seeing, name, shape):
    """A policy for vectors would accept flattened pixels, but learn badly."""
    env = SimulatorsVecEnv([Restarter(make_seeing("collect-0", shape))], run_seed=1)
    model = make_model(Algorithm(name=name, hyperparameters=HYPERPARAMETERS[name]), env, seed=1)

    extractors = [part for part in model.policy.modules() if isinstance(part, NatureCNN | FlattenExtractor)]

    assert {type(extractor) for extractor in extractors} == {NatureCNN}


@pytest.mark.parametrize("name", sorted({*HYPERPARAMETERS, "SAC"}))
@pytest.mark.parametrize(
    ("shape", "layers"), [((ROWS, COLUMNS, 3), 3), ((20, 48, 9), 9)], ids=["1", "3 frames"]
)
def test_the_small_network_takes_the_place_of_the_large_one(make_seeing, name, shape, layers):
    """Each algorithm can use the small network, with one image or with three.

    The images may be too small for the large network.
    """
    env = SimulatorsVecEnv([Restarter(make_seeing("collect-0", shape))], run_seed=1)
    if name == "SAC":
        env.action_space = spaces.Box(-1.0, 1.0, (3,))
    chosen = Algorithm(name=name, hyperparameters=HYPERPARAMETERS.get(name, {"buffer_size": 10}), cnn="small")

    model = make_model(chosen, env, seed=1)

    extractors = [part for part in model.policy.modules() if isinstance(part, NatureCNN | SmallCnn)]
    assert {type(extractor) for extractor in extractors} == {SmallCnn}
    assert [
        tuple(layer.weight.shape[:2]) for layer in extractors[0].modules() if hasattr(layer, "weight")
    ] == [
        (16, layers),
        (32, 16),
        (128, extractors[0].layers[5].in_features),
    ]


def test_hyperparameters_change_the_small_network(make_seeing):
    """As everywhere, `policy_kwargs` are the arguments of the policy."""
    env = SimulatorsVecEnv([Restarter(make_seeing("collect-0"))], run_seed=1)
    policy_kwargs = {"net_arch": [32], "features_extractor_kwargs": {"features_dim": 64}}
    hyperparameters = {**HYPERPARAMETERS["PPO"], "policy_kwargs": policy_kwargs}

    model = make_model(Algorithm(name="PPO", hyperparameters=hyperparameters, cnn="small"), env, seed=1)

    assert model.policy.features_dim == 64
    assert model.policy.net_arch == [32]


def test_a_run_with_the_small_network_resumes_as_others_do(play):
    """An interruption must not change the result, although nothing is unpickled from a checkpoint."""
    _, reference = play("whole", "PPO", cnn="small")
    play("cut", "PPO", signal_at=28, cnn="small")

    code, directory = play("cut", "PPO", cnn="small")

    assert code == 0
    assert outcome(directory) == outcome(reference)


def test_a_network_for_images_is_refused_where_there_are_none(make_member):
    """The job sets the field, but it would have no effect."""
    env = SimulatorsVecEnv([Restarter(make_member("collect-0"))], run_seed=1)

    with pytest.raises(
        ConfigurationError, match=r"algorithm\.cnn: has no effect, since the environment's obs"
    ):
        make_model(Algorithm(name="PPO", cnn="small"), env, seed=1)


@pytest.mark.parametrize(
    ("shape", "normalize", "fact"),
    [
        ((20, 48, 3), None, "its images have 20 x 48 pixels, and CnnPolicy needs 36 x 36"),
        ((36, 48, 3), Normalize(), "algorithm.normalize.observations: CnnPolicy scales images itself"),
    ],
)
def test_images_that_the_policy_cannot_take_are_refused(make_seeing, shape, normalize, fact):
    """The error names the image, and comes before a simulator starts."""
    env = SimulatorsVecEnv([Restarter(make_seeing("collect-0", shape))], run_seed=1)

    with pytest.raises(ConfigurationError, match=fact):
        make_model(Algorithm(name="PPO", normalize=normalize), env, seed=1)
