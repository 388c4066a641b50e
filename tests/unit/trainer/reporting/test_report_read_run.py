"""Reading a run directory for a report, as far as its files are readable."""

from __future__ import annotations

import json
import signal

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.job.run_directory import RunDirectory, append_line, read_lines
from palaestra_trainer.reporting.page import page
from palaestra_trainer.reporting.plain_values import flat, number, numbers, without_values_of_env
from palaestra_trainer.reporting.read_run import read_run
from palaestra_trainer.reporting.write_report import report_end, write_report

FILES = (
    *("attempts.jsonl", "confirmations.jsonl", "end.json", "evaluations.jsonl", "faults.jsonl"),
    *("hyperparameters.json", "journal.json", "outcome.json", "replays.json", "summary.json"),
    *("job.yaml", "training.yaml"),
)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


def test_the_report_of_a_complete_run_has_all_of_its_parts(play, job, directory):
    """The trainer writes the report itself, because in a cluster no other program has the volume."""
    code, _ = play(job())

    text, run = directory.report.read_text(encoding="utf-8"), read_run(directory)
    assert code == 0
    assert run.ended == "good"
    assert run.name == "corridor / 0"
    assert [one.step for one in run.evaluations] == [40, 80, 100]
    assert len(run.confirmations) == 1
    assert run.asked["algorithm.name"] == "DQN"
    assert run.asked["simulators collect"].startswith("1 \u00d7 ")
    assert "torch" in run.versions
    assert run.goodput["learning"] > 0
    assert [row[0] for row in run.checkpoints][-1] == "100"
    assert "train/loss" in run.curves
    assert "the training is complete" in text


def test_the_report_of_a_failed_run_has_its_reason_and_its_faults(play, job, directory):
    """A person mails this report to ask for help."""
    code, _ = play(job(), faults={"collect-0": {"steps": range(20, 1000)}}.items())

    run, text = read_run(directory), directory.report.read_text(encoding="utf-8")
    assert code == 80
    assert run.ended == "failed"
    assert run.end.startswith("SimulatorBudgetSpent")
    assert run.fault_count == len(run.faults) > 1
    assert run.faults[0].fact == "collect-0: died at step 20"
    assert run.faults[0].seconds is not None
    assert run.faults[-1].seconds is None
    assert "died at step 20" in text


def test_the_report_of_an_interrupted_run_says_so(play, job, directory):
    """The same command continues the run, so the report must not call it failed."""
    calls = iter(range(1000))

    code, _ = play(job(), on_step=lambda: next(calls) == 60 and signal.raise_signal(signal.SIGTERM))

    assert code == 75
    assert read_run(directory).ended == "interrupted"
    assert "interrupted" in directory.report.read_text(encoding="utf-8")


def test_a_resumed_run_is_reported_as_what_it_is_now(play, job, directory):
    """The end of the previous attempt is not the end of the run."""
    calls = iter(range(1000))
    play(job(), on_step=lambda: next(calls) == 60 and signal.raise_signal(signal.SIGTERM))

    play(job())

    run = read_run(directory)
    assert run.ended == "good"
    assert [reason.split(" at")[0] for _, reason in run.attempts] == ["new run", "resumed"]


def test_a_run_that_was_never_recorded_leaves_no_report(play, job, directory):
    """The run directory may belong to another job, so nothing is written to it."""
    code, _ = play(job(algorithm={"name": "None"}))

    assert code == 2
    assert not directory.report.exists()


def test_a_killed_run_is_reported_by_what_it_left(play, job, directory):
    """A killed run has neither a summary nor a recorded end."""
    play(job())
    for file in (directory.summary, directory.end):
        file.unlink()

    run = read_run(directory)

    assert run.ended == "open"
    assert "killed" in run.end
    assert run.evaluations


@given(st.sampled_from(FILES), json_values)
def test_files_of_any_content_are_read_without_an_error(tmp_path_factory, name, content):
    """Another release or another program may have written the file."""
    directory = RunDirectory(tmp_path_factory.mktemp("run") / "0")
    directory.path.mkdir()
    text = json.dumps(content)
    (directory.path / name).write_text(
        f'{{"step": 1, "seconds": {text}}}\n{text}\n' if "jsonl" in name else text
    )

    assert page([read_run(directory)])


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_leave_their_part_out(tmp_path, name):
    """After a crash of the machine, a file may contain any bytes."""
    directory = RunDirectory(tmp_path)
    (tmp_path / name).write_bytes(b'\xff\x00{"step": [')

    assert page([read_run(directory)])


def test_variables_and_passwords_of_a_job_are_left_out(tmp_path):
    """A report is mailed to people who must not see the values of variables."""
    env = [{"name": "TOKEN", "value": "hunter2"}]
    job = {"spec": {"trainer": {"env": env, "image": "oci://user:hunter3@registry/image"}}}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(job))

    shown = read_run(RunDirectory(tmp_path)).files["job.yaml"]

    assert "TOKEN" in shown
    assert "hunter" not in shown
    assert without_values_of_env({"env": "no list"}) == {"env": "no list"}


def test_only_numbers_that_a_chart_can_show_are_numbers():
    """A chart with NaN or 1e300 could not have an axis."""
    assert [number(value) for value in (1, 2.5, True, "3", None, float("nan"), 1e300, 10**400)] == [
        *(1.0, 2.5),
        *[None] * 6,
    ]
    assert numbers([1, "x"]) == ()
    assert dict(flat({"a": {"b": [1, 2]}, "c": None})) == {"a.b": "1, 2"}


def test_several_runs_make_one_report(play, job, directory, tmp_path):
    """A person compares seeds, sweeps or simulators in one report."""
    play(job())

    write_report([directory, directory], tmp_path / "both.html")

    assert "2 runs side by side" in (tmp_path / "both.html").read_text(encoding="utf-8")


def test_a_report_that_cannot_be_written_changes_no_end(tmp_path):
    """The run directory cannot be written, but the trained policy is still a success."""
    directory = RunDirectory(tmp_path / "missing")

    report_end(directory, lambda: {"exit_code": 0})

    assert not directory.path.exists()


def test_a_fault_that_a_restart_ends_has_its_seconds(tmp_path):
    """If a restart fails, two faults end with the same restart."""
    directory = RunDirectory(tmp_path)
    fault = {
        "time": "noon",
        "simulator": "collect-0",
        "kind": "dead",
        "fact": "gone",
        "step": 5,
        "attempt": 1,
    }
    for line in (fault, fault, {"simulator": "collect-0", "attempt": 1, "up_after_s": [2.5, 1.5]}, fault):
        append_line(directory.faults, line)

    assert [one.seconds for one in read_run(directory).faults] == [2.5, 1.5, None]
    assert len(list(read_lines(directory.faults))) == 4
