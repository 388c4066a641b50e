"""`palaestra run` writes the report of a run if the trainer was killed before it could write one."""

import pytest

from palaestra.local.outcome import uses
from palaestra.local.report import complete_report


@pytest.fixture
def run_directory(tmp_path):
    """Return the directory of a run that has started."""
    (tmp_path / "attempts.jsonl").write_text('{"reason": "new run"}\n')
    (tmp_path / "training.yaml").write_text("job: killed\nreplica: 0\n")
    return tmp_path


def test_a_killed_run_has_a_report(run_directory):
    """A killed trainer cannot write a record of its end."""
    complete_report(run_directory)

    assert "its trainer was killed" in (run_directory / "report.html").read_text()
    assert any("report.html" in line for line in uses(run_directory))


def test_a_report_that_the_trainer_made_is_kept(run_directory):
    """The trainer's own report may have details that are not in the files."""
    (run_directory / "end.json").write_text("{}")

    complete_report(run_directory)

    assert not (run_directory / "report.html").exists()


def test_a_program_of_the_users_own_has_no_report(tmp_path):
    """Such a program may not write the files that the report needs."""
    complete_report(tmp_path)

    assert not (tmp_path / "report.html").exists()


def test_without_the_trainers_package_there_is_no_report(run_directory, monkeypatch):
    """The end of a run must not depend on whether a report can be written."""
    monkeypatch.setattr("palaestra.local.report.PROGRAM", "palaestra-none")

    complete_report(run_directory)

    assert not (run_directory / "report.html").exists()
