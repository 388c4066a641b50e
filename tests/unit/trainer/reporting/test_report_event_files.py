"""Reading TensorBoard's event files without TensorBoard."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from torch.utils.tensorboard.writer import SummaryWriter

from palaestra_trainer.reporting.event_files import add_scalars
from palaestra_trainer.run.logger import hide_points


def read(folder):
    """Return the scalars in all event files of a folder."""
    found = {}
    for path in sorted(folder.iterdir(), key=lambda path: (path.stat().st_mtime_ns, path.name)):
        add_scalars(path.read_bytes(), found)
    return found


def write(folder, *points):
    """Write scalars to an event file, as a run does."""
    with SummaryWriter(str(folder)) as writer:
        for name, value, step in points:
            writer.add_scalar(name, value, step)


def test_scalars_are_read_as_tensorboard_wrote_them(tmp_path):
    """A person must see the same curves in the report as in TensorBoard."""
    write(tmp_path, ("train/loss", 0.5, 100), ("train/loss", 0.25, 200), ("rollout/ep_rew_mean", -1.0, 100))

    assert read(tmp_path) == {"train/loss": {100: 0.5, 200: 0.25}, "rollout/ep_rew_mean": {100: -1.0}}


def test_points_that_a_resume_hides_are_left_out(tmp_path):
    """A run that resumed at step 100 repeats the later steps and writes their points again."""
    write(tmp_path, ("train/loss", 0.5, 100), ("train/loss", 0.25, 200))
    hide_points(tmp_path, after=100)

    assert read(tmp_path) == {"train/loss": {100: 0.5}}


@pytest.mark.parametrize("cut", [1, 5, 17])
def test_a_record_that_a_kill_cut_short_is_left_out(tmp_path, cut):
    """A person needs the report of a killed run most."""
    write(tmp_path, ("train/loss", 0.5, 100), ("train/loss", 0.25, 200))
    [path] = tmp_path.iterdir()
    found = {}

    add_scalars(path.read_bytes()[:-cut], found)

    assert found == {"train/loss": {100: 0.5}}


@given(st.binary(max_size=200))
def test_any_bytes_are_read_without_an_error(content):
    """The other parts of a report must be written even if an event file is damaged."""
    add_scalars(content, {})
    add_scalars(len(content).to_bytes(8, "little") + bytes(4) + content + bytes(4), {})


def test_an_integer_without_end_ends_the_record(tmp_path):
    """In a damaged file, any number of bytes may have the bit that announces another byte of the integer."""
    write(tmp_path, ("train/loss", 0.5, 100))
    [path] = tmp_path.iterdir()
    endless = b"\xff" * 30
    record = len(endless).to_bytes(8, "little") + bytes(4) + endless + bytes(4)
    found = {}

    add_scalars(path.read_bytes() + record, found)

    assert found == {"train/loss": {100: 0.5}}
