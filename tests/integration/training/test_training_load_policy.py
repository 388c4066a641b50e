"""A trained policy can be loaded and used outside of its run."""

import zipfile

import cloudpickle
import gymnasium
import numpy as np
import pytest

from palaestra_trainer import load_policy
from palaestra_trainer.algorithms import ModelPolicy, make_model, small_cnn
from palaestra_trainer.algorithms.saved_hyperparameters import begun_with
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.checkpoint import load_tensors
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.testing import fake_arena, fake_seeing

PPO = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 2}}


@pytest.mark.parametrize("normalize", [{}, None], ids=["normalized", "plain"])
def test_a_loaded_policy_acts_on_raw_observations_as_it_did_in_its_run(
    write_job, play, fakes, tmp_path, normalize
):
    """The loaded policy must normalize observations, which plain Stable-Baselines3 would not do."""
    algorithm = PPO if normalize is None else PPO | {"normalize": normalize}
    job = write_job(algorithm=algorithm, steps=128)
    assert play(job)[0] == 0
    configuration, directory = load(job), RunDirectory(tmp_path / "run")
    env = SimulatorsVecEnv([Restarter(fakes.make_members(configuration)[0])], 1)
    trained = make_model(begun_with(configuration, directory), env, 1)
    load_tensors(directory.model, trained)

    by_run, by_zip = load_policy(directory.path), load_policy(str(directory.model))

    made = gymnasium.make(by_run.environment_id, simulator=fake_arena, **by_run.environment_options)
    assert made.unwrapped.options.max_steps == 30
    assert bool(by_run.scales) is (normalize is not None)
    for seed in range(20):
        observation, _ = made.reset(seed=seed)
        expected, _ = ModelPolicy(trained).predict(observation, deterministic=True)
        assert np.array_equal(by_run.predict(observation)[0], expected)
        assert np.array_equal(by_zip.predict(observation)[0], expected)


def test_a_policy_that_sees_is_trained_and_loaded(write_job, play, tmp_path):
    """A user trains with images and the small network, loads the policy, and gets valid actions."""
    environment = {"id": "SeeTarget-v0", "options": {"frames": 3, "max_steps": 20}}
    job = write_job(environment=environment, algorithm=PPO | {"cnn": "small"}, steps=128)
    assert play(job)[0] == 0

    policy = load_policy(tmp_path / "run")

    made = gymnasium.make(policy.environment_id, simulator=fake_seeing, **policy.environment_options)
    observation, _ = made.reset(seed=1)
    assert observation.shape == (48, 64, 9)
    assert made.action_space.contains(policy.predict(observation)[0])
    assert type(policy.model.policy.features_extractor).__name__ == "SmallCnn"


@pytest.fixture
def stored_by_value(write_job, play, tmp_path):
    """Return a function that trains a model whose file contains a network's class as byte code.

    A class that no module defines is stored in this way. With `version`, the file names this version of
    Python as its writer.
    """
    cloudpickle.register_pickle_by_value(small_cnn)

    def run(version=None):
        environment = {"id": "SeeTarget-v0", "options": {"max_steps": 20}}
        job = write_job(environment=environment, algorithm=PPO | {"cnn": "small"}, steps=64)
        assert play(job)[0] == 0
        model = tmp_path / "run/model.zip"
        with zipfile.ZipFile(model) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        if version:
            parts["system_info.txt"] = f"- Python: {version}.1\n".encode()
        with zipfile.ZipFile(model, "w") as archive:
            for name, content in parts.items():
                archive.writestr(name, content)
        return model

    yield run
    cloudpickle.unregister_pickle_by_value(small_cnn)


def test_byte_code_is_read_by_the_python_that_wrote_it(stored_by_value):
    """The version of Python that trained can execute the byte code."""
    model = load_policy(stored_by_value()).model

    assert type(model.policy.features_extractor).__name__ == "SmallCnn"


def test_a_network_of_another_python_is_refused_with_the_remedy(stored_by_value):
    """No module defines the network's class, so the user needs that version of Python or an export."""
    fact = r"model\.zip: policy_kwargs has byte code of Python 3\.99, but this is .*; use Python 3\.99, or"

    with pytest.raises(ConfigurationError, match=fact):
        load_policy(stored_by_value("3.99"))


def test_a_policy_of_a_wrapped_environment_brings_the_wrappers(write_job, play, tmp_path):
    """Without the wrappers, the policy's observations would differ from those in training."""
    wrapper = {"name": "gymnasium.wrappers:ClipReward", "options": {"max_reward": 0.5}}
    environment = {"id": "MoveToTargetEnv-v0", "wrappers": [wrapper], "frameStack": 2}
    assert play(write_job(environment=environment, algorithm=PPO, steps=128))[0] == 0

    policy = load_policy(tmp_path / "run")

    made = policy.make_env(*fake_arena())
    observation, _ = made.reset(seed=1)
    assert observation.shape == (2 * made.unwrapped.observation_space.shape[0],)
    assert made.action_space.contains(policy.predict(observation)[0])


def test_a_folder_without_a_model_is_refused(tmp_path):
    """The user must learn that a training comes first."""
    with pytest.raises(ConfigurationError, match=r"model.zip: does not exist; train first"):
        load_policy(tmp_path)
