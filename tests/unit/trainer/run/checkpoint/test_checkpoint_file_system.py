"""A full disk, a kill or a limited file system damages no checkpoint."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from pathlib import Path

import numpy as np
import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run import checkpoint
from tests.unit.trainer.run.checkpoint.trained_model import equal


def fail(number):
    """Return a function that raises an error of the operating system, with this number."""

    def write(*_args, **_options):
        raise OSError(number, os.strerror(number))

    return write


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
    """A trainer may be killed after it has written all files and before it renames the folder."""
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
