"""A damaged checkpoint is skipped or refused, and no code in a file is run."""

from __future__ import annotations

import json
import os
import pickle
import zipfile

import numpy as np
import pytest
import structlog

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run import checkpoint
from tests.unit.trainer.run.checkpoint.trained_model import CHUNK_ROWS, rows


def flip(path):
    """Flip one bit in the middle of a file, as a faulty disk does."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    replace(path, bytes(content))


def truncate(path):
    """Cut off the end of a file, as a crash of the machine does."""
    replace(path, path.read_bytes()[:-10])


def replace(path, content):
    """Replace a file without changing other files that are hard links to the same content."""
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
    """The previous checkpoint is only a little older, so one damaged file must not end the run."""
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
