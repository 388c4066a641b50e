"""Checkpoints: saving the state of a run, finding the newest one, and resuming from it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from palaestra_trainer.algorithms import make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.run import checkpoint
from palaestra_trainer.simulators.restarter import Restarter
from tests.unit.trainer.run.checkpoint.trained_model import HYPERPARAMETERS, equal


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_what_is_saved_is_restored(trained, name):
    """A value that the checkpoint lacked would change the rest of the run."""
    before, after = trained(name), trained(name, steps=0)
    before.save()

    state = after.resume()

    assert checkpoint.newest(before.folder).manifest.counters == {"episodes": 4}
    assert state.rollout == {"returns": [1.5]}
    assert state.members[0].episode == before.model.get_env().snapshot()[0].episode
    assert after.model.num_timesteps == before.model.num_timesteps >= 40
    assert after.model._n_updates == before.model._n_updates
    assert after.model.ep_info_buffer == before.model.ep_info_buffer
    assert np.array_equal(after.model._last_obs, before.model._last_obs)
    for one, other in zip(before.model.policy.parameters(), after.model.policy.parameters(), strict=True):
        assert torch.equal(one, other)
    optimizer = after.model.policy.optimizer.state_dict()["state"]
    assert len(optimizer) == len(before.model.policy.optimizer.state_dict()["state"]) > 0


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_random_numbers_go_on_where_they_were(trained, name):
    """With other generators, exploration after a resume would differ from that of an uninterrupted run."""
    before = trained(name)
    before.save()

    def draw(model):
        return (np.random.rand(), torch.rand(1).item(), [model.action_space.sample() for _ in range(9)])  # noqa: NPY002 - the one that training draws from

    expected = draw(before.model)
    after = trained(name, steps=0)
    after.resume()

    assert draw(after.model) == expected


@pytest.mark.parametrize("steps", [40, 230], ids=["half full", "gone round"])
def test_the_replay_buffer_is_restored(trained, steps):
    """Samples are drawn by position, so each row must have the same position."""
    before, after = trained(steps=steps), trained(steps=0)
    before.save()

    after.resume()

    assert after.model.replay_buffer.positions == before.model.replay_buffer.positions
    assert equal(before.model, after.model)


def test_a_checkpoint_whose_size_cannot_be_looked_at_is_one_all_the_same(trained):
    """The size is only a value on a dashboard, so an error must not end the run."""
    it = trained()
    it.save()
    before = it.saver.size_bytes()
    (it.path(it.model.num_timesteps) / "model.zip").unlink()

    assert before > 1000
    assert it.saver.size_bytes() == 0


def test_only_chunks_that_changed_are_written_again(trained):
    """Files of unchanged chunks are hard links to those of the last checkpoint.

    Writing a million rows each time would take too long.
    """
    model = trained(steps=100)
    model.save()
    model.learn(20).save()

    first, second = model.experience(100), model.experience(120)
    shared = [name for name in second if name in first and second[name].samefile(first[name])]
    assert list(second) == [f"{chunk:05}.npy" for chunk in range(8)]
    assert shared == [f"{chunk:05}.npy" for chunk in range(6)]


def test_a_resumed_run_shares_chunks_too(trained):
    """Without links, the first checkpoint after each resume would write the whole buffer again."""
    trained(steps=100).save()
    model = trained(steps=0)
    model.resume()
    model.learn(20).save()

    shared = model.experience(120)["00000.npy"].samefile(model.experience(100)["00000.npy"])
    resumed = trained(steps=0)
    resumed.resume()
    assert shared
    assert equal(model.model, resumed.model)


def test_a_row_that_ends_as_truncated_afterwards_is_written_again(trained):
    """A fault marks the row before it as truncated, and that row may be in a saved chunk."""
    model = trained(steps=32)
    model.save()
    buffer = model.model.replay_buffer
    buffer.positions = buffer.positions._replace(newest=(3,))
    buffer.dones[3] = 0.0
    empty = np.zeros((1, 2), np.float32)
    buffer.add(empty, empty, np.zeros(1), np.zeros(1), np.ones(1), [{"palaestra": {"valid": False}}])

    assert buffer.changed == {0}


def test_a_chunk_whose_file_is_gone_is_written_again(trained):
    """A user may have deleted the file of the last checkpoint."""
    model = trained(steps=100)
    model.save()
    model.experience(100)["00000.npy"].unlink()

    model.learn(20).save()

    assert checkpoint.newest(model.folder).manifest.step == 120


def test_the_newest_checkpoints_are_kept(trained):
    """The newest checkpoint is the one with the most steps: by name, 100 would come before 20."""
    model = trained(steps=0).learn(1)
    for step in (3, 20, 30, 100):
        model.save(step)

    assert sorted(path.name for path in model.folder.iterdir()) == ["100", "20", "30"]
    assert checkpoint.newest(model.folder).manifest.step == 100


def test_checkpoints_beyond_the_step_are_removed(trained):
    """The run did not resume from these checkpoints, so they are damaged.

    A damaged checkpoint must not displace a good one.
    """
    model = trained()
    for step in (10, 20, 30):
        model.save(step)
    (model.path(30) / "model.zip").unlink()
    model.resume()

    model.save(25)

    assert sorted(path.name for path in model.folder.iterdir()) == ["10", "20", "25"]


def test_a_step_is_saved_again(trained):
    """A run that is interrupted right after a checkpoint saves the same step twice."""
    model = trained()

    assert model.save()
    assert model.save()

    assert [path.name for path in model.folder.iterdir()] == ["40"]
    assert checkpoint.newest(model.folder).manifest.step == 40


def test_a_checkpoint_of_another_format_is_refused(trained):
    """A new run would throw away the steps of this one.

    The release that wrote the checkpoint can still read it.
    """
    model = trained()
    model.save(10)
    model.save(20)
    path = model.path(20)
    checkpoint.Manifest(step=20, seed=1, algorithm={}, environment={}, format=2).write(path)

    with pytest.raises(ConfigurationError, match=r"20: is of format 2.* which reads 1; continue with the"):
        checkpoint.newest(model.folder)


def test_without_a_checkpoint_there_is_none(tmp_path):
    """The run directory of a new run has no checkpoints."""
    assert checkpoint.newest(tmp_path / "none") is None


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"algorithm": {"name": "PPO"}}, "algorithm.name"),
        ({"algorithm": {"name": "DQN", "hyperparameters": {"gamma": 0.5}}}, "algorithm.hyperparameters"),
        ({"environment": {"id": "Other-v0"}}, "environment.id"),
    ],
)
def test_another_run_is_not_continued(trained, make_configuration, changes, field):
    """The networks of another run may have the same shape, but were trained for another task."""
    model = trained()
    model.save()
    other = make_configuration(**({"algorithm": model.configuration.algorithm.model_dump()} | changes))

    with pytest.raises(ConfigurationError, match=f"{field}: the run in .* use another run directory"):
        checkpoint.refuse_another_run(checkpoint.newest(model.folder), other)


def test_a_checkpoint_is_of_the_same_run_where_only_a_default_is_new(trained, make_configuration):
    """An upgrade between two attempts may add a field, which the saved configuration lacks."""
    model = trained()
    model.save()
    newest = checkpoint.newest(model.folder)
    algorithm = {"normalize": {}} | model.configuration.algorithm.model_dump(exclude={"normalize"})
    wanted = make_configuration(algorithm=algorithm)
    saved = wanted.algorithm.model_dump(mode="json")
    del saved["normalize"]["clip_rewards"]
    environment = {"id": newest.manifest.environment["id"]}

    manifest = dataclasses.replace(newest.manifest, algorithm=saved, environment=environment)
    older = dataclasses.replace(newest, manifest=manifest)

    checkpoint.refuse_another_run(older, wanted)


def test_tensors_of_another_shape_are_a_configuration_error(trained, make_member, tmp_path):
    """The file is intact, but it belongs to another configuration."""
    trained(steps=0).model.save(tmp_path / "model.zip")
    wide = Algorithm(
        name="DQN", hyperparameters=HYPERPARAMETERS["DQN"] | {"policy_kwargs": {"net_arch": [9]}}
    )
    other = make_model(wide, SimulatorsVecEnv([Restarter(make_member())], 1), seed=1)

    with pytest.raises(ConfigurationError, match="does not fit DQN as configured"):
        checkpoint.load_tensors(tmp_path / "model.zip", other)
