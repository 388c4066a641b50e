"""A log file has a size limit and keeps the beginning and the end of a program's output."""

import os

import pytest

from palaestra.local.bounded_log import LimitedFile

FIRST, LAST = 1000, 500


@pytest.fixture
def log(tmp_path):
    """Yield a log file that is open for reading and appending."""
    with (tmp_path / "x.log").open("a+b", buffering=0) as file:
        yield file


def limited(file):
    """Return the writer of a log with small limits."""
    return LimitedFile(file.fileno(), FIRST, LAST)


def content(file):
    """Return the lines of a log."""
    return os.pread(file.fileno(), 1_000_000, 0).decode().splitlines()


def write_lines(file, numbers):
    """Write a line of ten bytes for each number, and return the largest size that the file reached."""
    writer, most = limited(file), 0
    for number in numbers:
        writer.write(b"%09d\n" % number)
        most = max(most, os.fstat(file.fileno()).st_size)
    return most


def test_a_short_log_has_every_line(log):
    """A log below the limit must not lose a line."""
    write_lines(log, range(200))

    assert content(log) == [f"{number:09}" for number in range(200)]


def test_a_long_log_keeps_its_two_ends_and_counts_what_was_left_out(log):
    """The beginning of a log identifies the program, and the end has its error."""
    most = write_lines(log, range(1000))

    lines = content(log)
    [at] = [place for place, line in enumerate(lines) if line.startswith("---")]
    kept = [int(line) for line in lines[:at] + lines[at + 1 :]]
    assert most <= FIRST + 2 * LAST
    assert kept[:at] == list(range(FIRST // 10))
    assert kept[at:] == list(range(1000 - len(kept[at:]), 1000))
    assert len(kept[at:]) * 10 >= LAST - 10
    assert lines[at].startswith(f"--- {10_000 - 10 * len(kept)} bytes were left out here; ")


def test_what_was_left_out_is_counted_over_all_writers(log):
    """A resumed run appends to the logs of its earlier attempts."""
    for start in range(0, 3000, 300):
        write_lines(log, range(start, start + 300))

    notes = [line for line in content(log) if line.startswith("---")]
    kept = 10 * (len(content(log)) - 1)
    assert notes == [f"--- {30_000 - kept} bytes were left out here; a log keeps its two ends"]


def test_a_log_of_one_endless_line_is_limited_too(log):
    """A progress bar may never write a newline."""
    writer = limited(log)

    for _ in range(100):
        writer.write(b"x" * 100)

    assert os.fstat(log.fileno()).st_size <= FIRST + 2 * LAST


def test_a_log_that_cannot_be_written_raises_nothing(tmp_path):
    """The disk may be full or removed, but the run must continue."""
    (tmp_path / "x.log").write_bytes(b"x" * 5000)
    with (tmp_path / "x.log").open("rb") as log:
        assert limited(log).write(b"lost\n") == 5
