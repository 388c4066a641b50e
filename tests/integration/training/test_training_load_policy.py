"""A trained policy, loaded for use outside of its run."""

import gymnasium
import numpy as np
import pytest

from palaestra_trainer import load_policy
from palaestra_trainer.algorithms import make_model, policy_of
from palaestra_trainer.algorithms.kept import begun_with
from palaestra_trainer.checkpoint import load_tensors
from palaestra_trainer.configuration import load
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run_directory import RunDirectory
from palaestra_trainer.simulators.keeper import Keeper
from palaestra_trainer.testing import fake_arena, fake_seeing

PPO = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 2}}


@pytest.mark.parametrize("normalize", [{}, None], ids=["normalized", "plain"])
def test_a_loaded_policy_acts_on_raw_observations_as_it_did_in_its_run(
    write_job, play, fakes, tmp_path, normalize
):
    """With the options of its environment; plain Stable-Baselines3 would see them unnormalized."""
    algorithm = PPO if normalize is None else PPO | {"normalize": normalize}
    job = write_job(algorithm=algorithm, steps=128)
    assert play(job)[0] == 0
    configuration, directory = load(job), RunDirectory(tmp_path / "run")
    env = SimulatorsVecEnv([Keeper(fakes.make_members(configuration)[0])], 1)
    trained = make_model(begun_with(configuration, directory), env, 1)
    load_tensors(directory.model, trained)

    by_run, by_zip = load_policy(directory.path), load_policy(str(directory.model))

    made = gymnasium.make(by_run.environment_id, simulator=fake_arena, **by_run.environment_options)
    assert made.unwrapped.options.max_steps == 30
    assert bool(by_run.scales) is (normalize is not None)
    for seed in range(20):
        observation, _ = made.reset(seed=seed)
        expected, _ = policy_of(trained).predict(observation, deterministic=True)
        assert np.array_equal(by_run.predict(observation)[0], expected)
        assert np.array_equal(by_zip.predict(observation)[0], expected)


def test_a_policy_that_sees_is_trained_and_loaded(write_job, play, tmp_path):
    """From a job with images to actions, with the small network."""
    environment = {"id": "SeeTarget-v0", "options": {"frames": 3, "max_steps": 20}}
    job = write_job(environment=environment, algorithm=PPO | {"cnn": "small"}, steps=128)
    assert play(job)[0] == 0

    policy = load_policy(tmp_path / "run")

    made = gymnasium.make(policy.environment_id, simulator=fake_seeing, **policy.environment_options)
    observation, _ = made.reset(seed=1)
    assert observation.shape == (48, 64, 9)
    assert made.action_space.contains(policy.predict(observation)[0])
    assert type(policy.model.policy.features_extractor).__name__ == "SmallCnn"


def test_a_folder_without_a_model_is_refused(tmp_path):
    """With the remedy."""
    with pytest.raises(ConfigurationError, match=r"model.zip: does not exist; train first"):
        load_policy(tmp_path)
