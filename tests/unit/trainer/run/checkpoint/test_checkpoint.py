"""Checkpoints: saving the state of a run, finding the newest one, and resuming from it."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import pickle
import shutil
import stat
import zipfile
from pathlib import Path

import numpy as np
import pytest
import structlog
import torch

from palaestra_trainer.algorithms import buffers, make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.run import checkpoint
from palaestra_trainer.simulators.restarter import Restarter

HYPERPARAMETERS = {
    "DQN": {
        "learning_starts": 10,
        "batch_size": 8,
        "gradient_steps": 1,
        "buffer_size": 200,
        "policy_kwargs": {"net_arch": [8]},
    },
    "PPO": {"n_steps": 16, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}},
}
CHUNK_ROWS = 16


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch):
    """Make chunks of a few dozen rows, so that a small buffer has several.

    A row of the corridor has 36 bytes.
    """
    monkeypatch.setattr(buffers, "CHUNK_BYTES", 36 * CHUNK_ROWS)


class Trained:
    """A model that was trained for some steps, with its checkpoints."""

    def __init__(self, model, env, configuration, folder):
        self.model = model
        self.configuration = configuration
        self.folder = folder
        self._env = env
        self.saver = checkpoint.Saver(folder, keep=3)

    def learn(self, steps):
        """Continue the training for some steps."""
        self.model.learn(steps, reset_num_timesteps=False)
        return self

    def save(self, step=None):
        """Save a checkpoint, and return whether it was written."""
        state = checkpoint.TrainingState.of(self.model, self._env.snapshot(), {"returns": [1.5]})
        step = self.model.num_timesteps if step is None else step
        return self.saver.save(
            self.model, state, checkpoint.describe(self.configuration, step, {"episodes": 4})
        )

    def resume(self):
        """Restore the model from the newest checkpoint, and return the restored state."""
        found = checkpoint.newest(self.folder)
        state = checkpoint.restore(found, self.model)
        self._env.resume(state.members)
        state.put_back(self.model)
        self.saver = checkpoint.Saver(self.folder, keep=3, resumed=found)
        return state

    def path(self, step):
        """Return the folder of a checkpoint."""
        return self.folder / str(step)

    def experience(self, step):
        """Return the experience files of a checkpoint, by name."""
        return {file.name: file for file in sorted((self.path(step) / "experience").iterdir())}


@pytest.fixture
def trained(make_member, make_configuration, tmp_path):
    """Return a function that trains a model for some steps."""

    def make(name="DQN", steps=40):
        configuration = make_configuration(algorithm={"name": name, "hyperparameters": HYPERPARAMETERS[name]})
        env = SimulatorsVecEnv([Restarter(make_member())], run_seed=1)
        model = make_model(configuration.algorithm, env, seed=1)
        made = Trained(model, env, configuration, tmp_path / "checkpoints")
        return made.learn(steps) if steps else made

    return make


def rows(model):
    """Return the experience of a model by column."""
    return {name: column[: model.replay_buffer.size()] for name, column in model.replay_buffer.rows().items()}


def equal(one, other):
    """Return whether two buffers hold the same rows at the same positions."""
    return all(np.array_equal(column, rows(other)[name]) for name, column in rows(one).items())


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_what_is_saved_is_restored(trained, name):
    """Networks, optimizer, counts, statistics and the state of the episode are compared."""
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
    """The size is a value for a dashboard, which must not end a run."""
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
    """After a resume, the saver also links the files from which it has read."""
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


def test_chunks_are_copied_where_the_volume_has_no_links(trained, monkeypatch):
    """Some network volumes have no hard links."""
    model = trained(steps=100)
    model.save()

    def refuse(*_paths):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    model.learn(20).save()

    resumed = trained(steps=0)
    resumed.resume()
    assert not model.experience(120)["00000.npy"].samefile(model.experience(100)["00000.npy"])
    assert equal(model.model, resumed.model)


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

    They must not displace good ones.
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


def flip(path):
    """Flip one bit in the middle of a file, as a faulty disk does."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    replace(path, bytes(content))


def truncate(path):
    """Cut off the end of a file, as a crash of the machine does."""
    replace(path, path.read_bytes()[:-10])


def replace(path, content):
    """Replace this file without changing other files that are hard links to the same content."""
    path.unlink()
    path.write_bytes(content)


FILES = [
    "manifest.json",
    "model.zip",
    "state.json",
    "state.npz",
    "experience/00000.npy",
    "experience/00002.npy",
]


@pytest.mark.parametrize("damage", [truncate, flip, os.remove])
@pytest.mark.parametrize("file", FILES)
def test_a_checkpoint_with_a_damaged_file_is_skipped(trained, file, damage):
    """The log has a warning, and the run resumes from the previous checkpoint."""
    model = trained()
    for step in (10, 20):
        model.save(step)
    damage(model.path(20) / file)

    with structlog.testing.capture_logs() as logs:
        found = checkpoint.newest(model.folder)

    assert found.manifest.step == 10
    assert [(line["event"], line["log_level"]) for line in logs] == [
        ("damaged checkpoint skipped", "warning")
    ]
    checkpoint.restore(found, model.model)


@pytest.mark.parametrize("content", ["[]", "{}", '{"format": 1}', "null", '{"format": 99}'])
def test_a_manifest_that_is_none_is_damage(trained, content):
    """Without a digest in the manifest, no content is accepted."""
    model = trained()
    for step in (10, 20):
        model.save(step)
    (model.path(20) / "manifest.json").write_text(content)

    assert checkpoint.newest(model.folder).manifest.step == 10


def test_every_bit_of_a_manifest_counts(trained):
    """The manifest has the step from which a run resumes, and contains its own digest."""
    model = trained()
    model.save()
    path = model.path(40) / "manifest.json"
    whole = path.read_bytes()
    compact = json.dumps(json.loads(whole))

    for place in range(len(compact)):
        damaged = bytearray(compact.encode())
        damaged[place] ^= 1
        path.write_bytes(damaged)
        with pytest.raises(ConfigurationError, match="no checkpoint in it can be read"):
            checkpoint.newest(model.folder)


def test_damage_to_shared_experience_does_not_end_a_run(trained):
    """Several checkpoints may share the damaged file, but the rows of their other chunks are intact."""
    model = trained(steps=100)
    model.save()
    model.learn(20).save()
    content = bytearray(model.experience(120)["00001.npy"].read_bytes())
    content[-1] ^= 1
    model.experience(120)["00001.npy"].write_bytes(content)

    resumed = trained(steps=0)
    resumed.resume()
    left = resumed.model.replay_buffer

    assert resumed.model.num_timesteps == 120
    assert left.size() == 120 - CHUNK_ROWS
    expected = np.delete(rows(model.model)["observations"], slice(CHUNK_ROWS, 2 * CHUNK_ROWS), axis=0)
    assert np.array_equal(rows(resumed.model)["observations"], expected)
    resumed.learn(10).save()
    assert not checkpoint.newest(resumed.folder).lost


def test_what_is_left_of_a_buffer_that_has_gone_round_is_in_order(trained):
    """The buffer overwrites its oldest row first, so the remaining rows must be in order."""
    model = trained(steps=230)
    model.save()
    (model.path(230) / "experience/00000.npy").unlink()

    resumed = trained(steps=0)
    resumed.resume()

    order = [*range(30, 200), *range(CHUNK_ROWS, 30)]
    assert np.array_equal(rows(resumed.model)["observations"], rows(model.model)["observations"][order])


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


def fail(number):
    """Return a function that raises an error of the operating system, with this number."""

    def write(*_args, **_options):
        raise OSError(number, os.strerror(number))

    return write


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
@pytest.mark.parametrize("where", ["model.save", "np.savez", "np.save"])
def test_a_full_disk_leaves_what_was_there(trained, monkeypatch, where, number):
    """The training continues without a new checkpoint, and the next checkpoint must be complete again."""
    model = trained(steps=100)
    model.save()
    model.learn(20)
    with monkeypatch.context() as full:
        place, name = where.split(".")
        full.setattr({"model": model.model, "np": np}[place], name, fail(number))
        written = model.save()
    left = [path.name for path in model.folder.iterdir()]

    model.learn(20).save()

    resumed = trained(steps=0)
    resumed.resume()
    assert (written, left) == (False, ["100"])
    assert resumed.model.num_timesteps == 140
    assert equal(model.model, resumed.model)


def test_another_failure_to_write_is_not_hidden(trained, monkeypatch):
    """A read-only volume will not become writable, so the run must end."""
    model = trained()
    monkeypatch.setattr(model.model, "save", fail(errno.EROFS))

    with pytest.raises(OSError, match="Read-only"):
        model.save()


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOTSUP])
def test_a_file_system_without_fsync_of_folders_keeps_checkpoints(trained, monkeypatch, number):
    """gcsfuse, s3fs, SMB and some NFS servers cannot sync folders; files are still synced."""
    sync, synced = os.fsync, []

    def fsync(descriptor):
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))
        synced.append(descriptor)
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    model = trained()

    model.save()

    assert checkpoint.newest(model.folder).manifest.step == 40
    assert synced


@pytest.mark.parametrize("number", [errno.EPERM, errno.ENOTSUP])
def test_a_file_system_that_renames_no_folders_is_refused_in_a_sentence(trained, monkeypatch, number):
    """Some object stores cannot rename a folder.

    The error must forbid a retry, because each attempt would fail at its first checkpoint.
    """
    rename = Path.rename

    def refuse(path, target):
        if path.is_dir():
            raise OSError(number, os.strerror(number))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", refuse)
    model = trained()

    with pytest.raises(ConfigurationError, match=r"its file system cannot rename folders .* use another"):
        model.save()
    assert list(model.folder.iterdir()) == []


def test_a_draft_is_never_taken_for_a_checkpoint(trained):
    """The trainer was killed after it had written all files, but before it renamed the folder."""
    model = trained()
    model.save(10)
    model.save(20)
    model.path(20).rename(model.folder / ".20.draft")

    checkpoint.tidy(model.folder)

    assert checkpoint.newest(model.folder).manifest.step == 10
    assert [path.name for path in model.folder.iterdir()] == ["10"]


@pytest.mark.parametrize("there", [False, True])
def test_a_kill_while_a_step_is_saved_again_loses_nothing(trained, there):
    """The kill comes between the renames of the old and the new folder, or after both."""
    model = trained()
    model.save()
    shutil.copytree(model.path(40), model.folder / ".40.replaced")
    if not there:
        shutil.rmtree(model.path(40))

    checkpoint.tidy(model.folder)

    assert checkpoint.newest(model.folder).manifest.step == 40
    assert [path.name for path in model.folder.iterdir()] == ["40"]


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


class Bomb:
    """An object that runs code when it is unpickled."""

    def __reduce__(self):
        """Return a call that fails the test as the way to rebuild the object."""
        return (pytest.fail, ("unpickled",))


def test_nothing_in_a_model_is_unpickled(trained, tmp_path):
    """A person who can write to a volume must not be able to run code in the trainer."""
    model = trained(steps=0).model
    model.save(tmp_path / "model.zip")
    with zipfile.ZipFile(tmp_path / "model.zip", "a") as archive:
        content = {"x": {":type:": "Bomb", ":serialized:": pickle.dumps(Bomb()).hex()}}
        with pytest.warns(UserWarning, match="Duplicate name"):
            archive.writestr("data", json.dumps(content))

    checkpoint.load_tensors(tmp_path / "model.zip", model)


@pytest.mark.parametrize("file", ["state.npz", "experience/00000.npy"])
def test_arrays_of_objects_are_refused(trained, file):
    """NumPy stores arrays of objects as pickles, which can contain code."""
    model = trained()
    model.save()
    found = checkpoint.newest(model.folder)
    objects = np.array([Bomb()], dtype=object)
    if file.endswith("npz"):
        np.savez(found.path / file, observation=objects)
    else:
        np.save(found.path / file, objects)

    with pytest.raises(ValueError, match="allow_pickle=False"):
        checkpoint.restore(found, model.model)
