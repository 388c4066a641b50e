"""A sidecar copies its simulator's output line by line, whatever bytes the output contains."""

import logging
import os
import threading

import pytest

from palaestra_sim.sidecar.output import MOST_LINE, LineHandler, Passage


@pytest.fixture
def passed_on(capfdbinary):
    """Return a function that sends pieces through a `Passage`; it returns the output and the last line."""

    def through(*pieces, mark=""):
        source, sink = os.pipe()
        passage = Passage(source, mark)
        reader = threading.Thread(target=passage.run)
        reader.start()
        for piece in pieces:
            os.write(sink, piece)
        os.close(sink)
        reader.join(10)
        return capfdbinary.readouterr().out, passage.last_line

    return through


def test_lines_come_out_as_they_went_in(passed_on) -> None:
    """A pipe may deliver a line in two pieces, which a reader of the log must not notice."""
    out, last = passed_on(b"one\ntw", b"o\n\nthree\n")

    assert out == b"one\ntwo\n\nthree\n"
    assert last == "three"


def test_the_last_line_needs_no_newline(passed_on) -> None:
    """A simulator may crash in the middle of its last line."""
    out, last = passed_on(b"Aborted")

    assert (out, last) == (b"Aborted\n", "Aborted")


@pytest.mark.parametrize("end", [b"", b"\n"])
def test_a_line_without_end_is_passed_on_in_pieces(passed_on, end) -> None:
    """The sidecar must not collect an endless line in its memory."""
    out, _ = passed_on(b"x" * 3 * MOST_LINE + end)

    assert {len(line) for line in out.splitlines(keepends=True)[:-1]} == {MOST_LINE}
    assert out.replace(b"\n", b"") == b"x" * 3 * MOST_LINE


def test_every_line_of_one_of_two_simulators_begins_with_its_mark(passed_on) -> None:
    """Two simulators share one log, so each piece of a long line needs the mark too."""
    out, last = passed_on(b"one\n" + b"x" * MOST_LINE + b"\ntwo", mark="b: ")

    lines = out.splitlines(keepends=True)
    assert all(line.startswith(b"b: ") and len(line) <= MOST_LINE for line in lines)
    assert (lines[0], lines[-1], last) == (b"b: one\n", b"b: two\n", "two")
    assert out.count(b"x") == MOST_LINE


def test_bytes_that_are_no_text_are_passed_on(passed_on) -> None:
    """The log gets the bytes unchanged; the last line becomes text, because /state is JSON."""
    out, last = passed_on(b"\xff\xfe\n")

    assert (out, last) == (b"\xff\xfe\n", "\ufffd\ufffd")


def test_our_own_lines_say_that_they_are_ours(capfdbinary) -> None:
    """A reader of the log must see which lines are the sidecar's.

    A line break in a message is replaced by a space.
    """
    record = logging.makeLogRecord({"msg": "failed: %s", "args": ("a\nb",)})

    LineHandler().emit(record)

    assert capfdbinary.readouterr().out == b"palaestra-sidecar: failed: a b\n"
