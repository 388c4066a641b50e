"""The file in which a simulator reports the parts of a world that it leaves out; any program may write it."""

import os

import pytest

from palaestra_sim.sidecar.left_out import read_left_out


@pytest.mark.parametrize(
    ("content", "lines"),
    [
        (b"", ()),
        (b"no Drone: 1 node left out (line 7)\nno Sea\n", ("no Drone: 1 node left out (line 7)", "no Sea")),
        (b"\n  \x1b[31mno\tSea \r\n\n", ("[31mno Sea",)),
        (b"no \xff", ("no \ufffd",)),
        (b"x" * 100_000, ("x" * 65_536,)),
    ],
)
def test_a_report_is_read_as_printable_lines(tmp_path, content, lines) -> None:
    """A terminal shows these lines, so control characters are removed."""
    file = tmp_path / "left-out"
    file.write_bytes(content)

    assert read_left_out(file) == lines


def test_without_a_file_nothing_was_left_out(tmp_path) -> None:
    """Most simulators write no such file. Opening a pipe of that name would block the sidecar for ever."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")

    for name in ("missing", ".", "pipe", "loop"):
        assert read_left_out(tmp_path / name) == ()
