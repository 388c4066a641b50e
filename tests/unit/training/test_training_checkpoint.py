"""Saving and finding the state from which a run can go on."""

from __future__ import annotations

import errno
import json
import pickle
import zipfile

import numpy as np
import pytest
import torch

from palaestra_trainer import checkpoint
from palaestra_trainer.algorithms import make_model
from palaestra_trainer.configuration import Algorithm
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.simulators.member import Keeper
from palaestra_trainer.simulators.vec_env import SimulatorsVecEnv

HYPERPARAMETERS = {
    "DQN": {"learning_starts": 10, "batch_size": 8, "buffer_size": 200, "policy_kwargs": {"net_arch": [8]}},
    "PPO": {"n_steps": 16, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}},
}


@pytest.fixture
def model_of(make_member, make_configuration):
    """Make a model with its configuration, trained for some steps."""

    def make(name="DQN", steps=40):
        configuration = make_configuration(algorithm={"name": name, "hyperparameters": HYPERPARAMETERS[name]})
        env = SimulatorsVecEnv([Keeper(make_member())], run_seed=1)
        model = make_model(configuration.algorithm, env, seed=1)
        return (model.learn(steps) if steps else model), configuration

    return make


def manifest_of(configuration, step=40):
    """Return a manifest for a step."""
    return checkpoint.describe(configuration, step, [5], {"episodes": 4})


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_what_is_saved_is_restored(model_of, tmp_path, name):
    """Networks, optimiser, counters and experience."""
    before, configuration = model_of(name)
    after, _ = model_of(name, steps=0)
    checkpoint.save(tmp_path, before, manifest_of(configuration), keep=3)

    found = checkpoint.newest(tmp_path)
    checkpoint.restore(found, after, configuration)

    assert found.manifest.episodes == [5]
    assert found.manifest.counters == {"episodes": 4}
    assert after.num_timesteps == 40
    assert after._n_updates == before._n_updates
    for one, other in zip(before.policy.parameters(), after.policy.parameters(), strict=True):
        assert torch.equal(one, other)
    state = after.policy.optimizer.state_dict()["state"]
    assert len(state) == len(before.policy.optimizer.state_dict()["state"]) > 0


def test_the_replay_buffer_is_restored(model_of, tmp_path):
    """Else a resumed run would begin to learn from nothing."""
    before, configuration = model_of()
    after, _ = model_of(steps=0)
    checkpoint.save(tmp_path, before, manifest_of(configuration), keep=3)

    checkpoint.restore(checkpoint.newest(tmp_path), after, configuration)

    for name, array in before.replay_buffer.arrays().items():
        assert np.array_equal(array, after.replay_buffer.arrays()[name])


def test_the_newest_checkpoints_are_kept(model_of, tmp_path):
    """Newest by step, not by name: 100 is after 20."""
    model, configuration = model_of(steps=0)
    for step in (20, 100, 3):
        checkpoint.save(tmp_path, model, manifest_of(configuration, step), keep=2)

    assert sorted(path.name for path in tmp_path.iterdir()) == ["100", "20"]
    assert checkpoint.newest(tmp_path).manifest.step == 100


def test_a_step_is_saved_again(model_of, tmp_path):
    """A run that is interrupted right after a checkpoint does so."""
    model, configuration = model_of(steps=0)
    for _ in range(2):
        assert checkpoint.save(tmp_path, model, manifest_of(configuration), keep=2)

    assert checkpoint.newest(tmp_path).manifest.step == 40


def truncate(path):
    """Lose the end, as a crash of the machine does."""
    path.write_bytes(path.read_bytes()[:-10])


DAMAGES = {
    "model truncated": lambda folder: truncate(folder / "model.zip"),
    "experience truncated": lambda folder: truncate(folder / "replay.npz"),
    "manifest truncated": lambda folder: truncate(folder / "manifest.json"),
    "manifest missing": lambda folder: (folder / "manifest.json").unlink(),
    "model missing": lambda folder: (folder / "model.zip").unlink(),
    "manifest is a list": lambda folder: (folder / "manifest.json").write_text("[]"),
    "manifest is empty": lambda folder: (folder / "manifest.json").write_text('{"format": 1}'),
    "another format": lambda folder: (folder / "manifest.json").write_text('{"format": 99}'),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_checkpoint_is_skipped(model_of, tmp_path, damage):
    """The one before it is older and whole."""
    model, configuration = model_of(steps=0)
    for step in (10, 20):
        checkpoint.save(tmp_path, model, manifest_of(configuration, step), keep=3)

    damage(tmp_path / "20")

    assert checkpoint.newest(tmp_path).manifest.step == 10


def test_without_a_checkpoint_there_is_none(tmp_path):
    """A new run."""
    assert checkpoint.newest(tmp_path / "none") is None


def test_a_full_disk_leaves_what_was_there(model_of, tmp_path, monkeypatch):
    """Training goes on; the next checkpoint may fit again."""
    model, configuration = model_of(steps=0)
    checkpoint.save(tmp_path, model, manifest_of(configuration, 10), keep=1)

    def full(*_args, **_options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(model, "save", full)

    assert checkpoint.save(tmp_path, model, manifest_of(configuration, 20), keep=1) is False
    assert [path.name for path in tmp_path.iterdir()] == ["10"]


def test_another_failure_to_write_is_not_hidden(model_of, tmp_path, monkeypatch):
    """A volume that is read-only will stay so."""
    model, configuration = model_of(steps=0)

    def refuse(*_args, **_options):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(model, "save", refuse)

    with pytest.raises(OSError, match="Read-only"):
        checkpoint.save(tmp_path, model, manifest_of(configuration), keep=1)


def test_a_draft_that_a_crash_left_is_removed(model_of, tmp_path):
    """It would fill the volume in the end."""
    model, configuration = model_of(steps=0)
    (tmp_path / ".7.draft").mkdir()

    checkpoint.save(tmp_path, model, manifest_of(configuration), keep=1)

    assert [path.name for path in tmp_path.iterdir()] == ["40"]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"algorithm": {"name": "PPO"}}, "algorithm.name"),
        ({"algorithm": {"name": "DQN", "hyperparameters": {"gamma": 0.5}}}, "algorithm.hyperparameters"),
        ({"environment": {"id": "Other-v0"}}, "environment.id"),
    ],
)
def test_another_run_is_not_continued(model_of, make_configuration, tmp_path, changes, field):
    """Its networks would fit, and mean something else."""
    model, configuration = model_of(steps=0)
    checkpoint.save(tmp_path, model, manifest_of(configuration), keep=1)
    other = make_configuration(**({"algorithm": configuration.algorithm.model_dump()} | changes))

    with pytest.raises(ConfigurationError, match=f"{field}: the run in .* use another run directory"):
        checkpoint.restore(checkpoint.newest(tmp_path), model, other)


def test_tensors_of_another_shape_are_a_configuration_error(model_of, make_member, tmp_path):
    """The file is whole, but not what was configured."""
    model, _ = model_of(steps=0)
    model.save(tmp_path / "model.zip")
    wide = Algorithm(
        name="DQN", hyperparameters=HYPERPARAMETERS["DQN"] | {"policy_kwargs": {"net_arch": [9]}}
    )
    other = make_model(wide, SimulatorsVecEnv([Keeper(make_member())], 1), seed=1)

    with pytest.raises(ConfigurationError, match="does not fit DQN as configured"):
        checkpoint.load_tensors(tmp_path / "model.zip", other)


class Bomb:
    """Would run a command if it were unpickled."""

    def __reduce__(self):
        """Say how to rebuild it."""
        return (pytest.fail, ("unpickled",))


def test_nothing_in_a_model_is_unpickled(model_of, tmp_path):
    """Whoever may write to a volume may not run code in the trainer."""
    model, _ = model_of(steps=0)
    model.save(tmp_path / "model.zip")
    with zipfile.ZipFile(tmp_path / "model.zip", "a") as archive:
        content = {"x": {":type:": "Bomb", ":serialized:": pickle.dumps(Bomb()).hex()}}
        with pytest.warns(UserWarning, match="Duplicate name"):
            archive.writestr("data", json.dumps(content))

    checkpoint.load_tensors(tmp_path / "model.zip", model)


def test_a_replay_buffer_of_objects_is_refused(model_of, tmp_path):
    """Arrays of objects are pickles."""
    model, configuration = model_of(steps=0)
    checkpoint.save(tmp_path, model, manifest_of(configuration), keep=1)
    found = checkpoint.newest(tmp_path)
    np.savez(found.path / "replay.npz", rewards=np.array([Bomb()], dtype=object))

    with pytest.raises(ValueError, match="allow_pickle=False"):
        checkpoint.restore(found, model, configuration)


def test_a_model_with_nan_is_not_finite(model_of):
    """It is asked before it is saved."""
    model, _ = model_of(steps=0)
    assert checkpoint.finite(model)

    with torch.no_grad():
        next(iter(model.policy.parameters())).fill_(float("nan"))

    assert not checkpoint.finite(model)
