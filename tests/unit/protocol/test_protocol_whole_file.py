"""Files are written atomically: after a failure, a file is the old or the new file as a whole."""

import errno
import os

import pytest

from palaestra_protocol.whole_file import replace_file, write_whole


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path):
    """A full disk must not destroy the best model."""
    path = tmp_path / "model.zip"
    replace_file(path, lambda name: name.write_text("old"))

    def fail(name):
        name.write_text("ne")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        replace_file(path, fail)
    assert path.read_text() == "old"
    assert [it.name for it in tmp_path.iterdir()] == ["model.zip"]


def test_a_simulator_s_file_is_replaced_as_a_whole_or_not_at_all(tmp_path, monkeypatch):
    """A simulator reads the world while the sidecar may be killed."""
    path = tmp_path / "arena.wbt"
    write_whole(path, b"old")
    monkeypatch.setattr(os, "replace", _full)

    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert [it.name for it in tmp_path.iterdir()] == ["arena.wbt"]


def _full(*_):
    raise OSError(errno.ENOSPC, "No space left on device")
