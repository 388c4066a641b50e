"""The files of a run directory: after a crash, each of them can be read."""

from __future__ import annotations

import json

import pytest

from palaestra_trainer.job.run_directory import RunDirectory, append_line, read_lines
from palaestra_trainer.run.summary import finished, summarise, write_summary
from palaestra_trainer.run.telemetry.progress import Progress


@pytest.fixture
def directory(tmp_path):
    """Return a run directory."""
    (tmp_path / "uid" / "0").mkdir(parents=True)
    return RunDirectory(tmp_path / "uid" / "0")


def test_attempts_are_counted(directory):
    """The number of lines is the number of the attempt."""
    numbers = [directory.begin_attempt("pod-1", "new run"), directory.begin_attempt("pod-2", "resumed")]

    assert numbers == [1, 2]
    assert [line["pod"] for line in read_lines(directory.attempts)] == ["pod-1", "pod-2"]


def test_a_line_that_a_crash_tore_is_left_out(tmp_path):
    """A run continues after a crash, so the lines before and after the torn line must be readable."""
    path = tmp_path / "lines.jsonl"
    append_line(path, {"step": 1})
    with path.open("a") as file:
        file.write('{"step": 2, "succ')
    append_line(path, {"step": 3})

    assert [line["step"] for line in read_lines(path)] == [1, 3]


def test_a_file_that_is_not_there_has_no_lines(tmp_path):
    """At the start of a run, nothing has been evaluated, so the file of evaluations does not exist."""
    assert list(read_lines(tmp_path / "none")) == []


def test_a_summary_makes_a_run_finished(directory, make_configuration):
    """A person may raise the steps of the job, and then the run is not finished any more."""
    before = finished(directory, make_configuration(steps=100))
    write_summary(directory, summarise(directory, Progress(100, [])))

    assert before is None
    assert finished(directory, make_configuration(steps=100))["target"] == 100
    assert finished(directory, make_configuration(steps=200)) is None


@pytest.mark.parametrize("text", ["", "[]", json.dumps({"steps": 3})])
def test_a_summary_that_says_nothing_finishes_nothing(directory, make_configuration, text):
    """Another program may have written such a file."""
    directory.summary.write_text(text)

    assert finished(directory, make_configuration()) is None


@pytest.mark.parametrize("line", ["5", "[1]", "null"])
def test_a_line_that_is_no_object_is_left_out(tmp_path, line):
    """A file that a disk damaged may have a line that is JSON by chance."""
    (tmp_path / "lines").write_text(f'{{"a": 1}}\n{line}\n{{"a": 2}}\n')

    assert list(read_lines(tmp_path / "lines")) == [{"a": 1}, {"a": 2}]
