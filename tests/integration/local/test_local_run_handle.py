"""`palaestra.run` trains a job in the background of a Python program."""

import json
import os
import select
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

import palaestra
from palaestra.errors import SpecErrors
from palaestra.local.bounded_log import FIRST, LAST
from palaestra.local.errors import RunRefused, StillRunning
from tests.jobs import make_job
from tests.local_run import below, left_of
from tests.waiting import eventually

PATIENCE_S = 60.0
WAIT = """\
import os, pathlib, signal, sys
run = pathlib.Path(os.environ["PALAESTRA_RUN"])
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
(run / "begun").touch()
signal.sigwait([signal.SIGTERM])
(run / "summary.json").write_text('{"steps": 7}')
sys.exit(75)
"""
ANSWER = """\
import http.server, json, os, pathlib, yaml
from palaestra_protocol.pod.status import TrainerStatus
config = yaml.safe_load(pathlib.Path(os.environ["PALAESTRA_CONFIG"]).read_text())
status = TrainerStatus(
    step=40, target=100, episodes=2, phase="training", steps_per_second=12.5, success_rate=0.5,
    faults={"dead": 1, "hung": 2},
).to_json()

class Status(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.end_headers()
        self.wfile.write(json.dumps(status).encode())

host, port = config["statusAddress"].split(":")
http.server.HTTPServer((host, int(port)), Status).serve_forever()
"""
END = """\
import os, pathlib
run = pathlib.Path(os.environ["PALAESTRA_RUN"])
(run / "model.zip").touch()
(run / "summary.json").write_text('{"steps": 7, "success_rate": 0.5, "faults": 2}')
"""
PRINT = """\
for _ in range(1000):
    print("x" * 20_000)
"""
FAIL = """\
import os, pathlib, sys
run = pathlib.Path(os.environ["PALAESTRA_RUN"])
(run / "summary.json").write_text('{"steps": 7}')
sys.exit(1)
"""
NOTEBOOK = """\
import os, sys, time
import palaestra

run = palaestra.run(sys.argv[1], runs=sys.argv[2])
{fork}
print(run.directory, flush=True)
time.sleep(1000)
"""


@pytest.fixture
def job(tmp_path):
    """Return a function that builds jobs as plain data, with a small Python program as trainer."""

    def make(program, name="desk", **spec):
        file = tmp_path.with_name(f"{tmp_path.name}-{hash(program)}.py")
        file.write_text(program)
        return make_job(name, **{"backoffLimit": 0, "trainer": {"command": ["python", str(file)]}, **spec})

    return make


def begun(run):
    """Wait until the trainer of a run waits for SIGTERM."""
    eventually(lambda: (run.directory / "begun").exists() or run.ended, PATIENCE_S)


def test_a_complete_run_has_a_result_and_is_not_repeated(job, tmp_path):
    """A user who runs a notebook again from its first cell must not train again."""
    with palaestra.run(job(END), runs=tmp_path) as run:
        readable, _, _ = select.select([run], [], [], PATIENCE_S)
        assert readable == [run]
        result = run.result(PATIENCE_S)

    assert (result.exit_code, result.succeeded, result.steps, result.faults) == (0, True, 7, 2)
    assert result.policy == tmp_path / "desk/0/model.zip"
    assert (run.progress.phase, run.progress.step, run.progress.success_rate) == ("ended", 7, 0.5)
    again = palaestra.run(job(END), runs=tmp_path)
    assert again.result(PATIENCE_S) == result
    assert "has already finished" in again.log.read_text()


def test_the_log_of_a_run_has_a_limit(job, tmp_path):
    """An environment may print at every step, and its output must not fill the disk."""
    with palaestra.run(job(PRINT + END), runs=tmp_path) as run:
        result = run.result(PATIENCE_S)

    log = run.log.read_text()
    assert result.succeeded
    assert len(log) <= FIRST + 2 * LAST < 1000 * 20_000
    assert "bytes were left out here" in log
    assert log.splitlines()[-1].split() == ["run", "directory", str(run.directory)]


def test_a_result_is_not_that_of_an_earlier_run(job, tmp_path):
    """A run that cannot start writes no outcome, so an older file must not be reported."""
    with palaestra.run(job(FAIL), runs=tmp_path) as run:
        first = run.result(PATIENCE_S)
    logs = run.directory / "logs"
    logs.rename(run.directory / "earlier logs")
    logs.touch()

    with palaestra.run(job(FAIL), runs=tmp_path) as run:
        second = run.result(PATIENCE_S)

    assert (first.exit_code, first.steps) == (1, 7)
    assert (second.exit_code, second.steps) == (1, None)
    assert str(logs) in second.reason


def test_two_runs_at_the_same_time_are_stopped_with_a_checkpoint(job, tmp_path):
    """Each run has its own ports and its own directory, so two can train at once.

    A timeout of `result` must end neither of them.
    """
    with (
        palaestra.run(job(WAIT), runs=tmp_path) as one,
        palaestra.run(job(WAIT, "b"), runs=tmp_path) as other,
    ):
        begun(one)
        begun(other)
        with pytest.raises(StillRunning, match="wait longer, or stop it"):
            one.result(0.0)
        stopped = one.stop()

        assert not other.ended
    assert (stopped.exit_code, stopped.succeeded, stopped.steps) == (75, False, 7)
    assert other.ended
    assert other.result(0.0).exit_code == 75


def test_the_progress_is_what_the_trainer_reports(job, tmp_path):
    """Before the trainer's first response, the phase is `starting`."""
    with palaestra.run(job(ANSWER), runs=tmp_path) as run:
        first = run.progress
        progress = eventually(lambda: run.progress if run.progress.step else None, PATIENCE_S)
        run.kill()

    assert (first.phase, first.step) == ("starting", 0)
    assert (progress.phase, progress.step, progress.target, progress.faults) == ("training", 40, 100, 3)
    assert (progress.steps_per_second, progress.success_rate) == (12.5, 0.5)
    assert run.result(0.0).exit_code == 130


def test_a_second_run_of_the_same_directory_is_refused_at_once(job, tmp_path):
    """The caller must get an exception, because nobody reads the log of a run that did not start."""
    with palaestra.run(job(WAIT), runs=tmp_path) as run:
        with pytest.raises(RunRefused, match="is in use by"):
            palaestra.run(job(WAIT), runs=tmp_path)
        begun(run)

    with pytest.raises(RunRefused, match=r"spec.seed: was 1, is 2"):
        palaestra.run(palaestra.changed(job(WAIT), {"seed": 2}), runs=tmp_path)


def test_mistakes_are_raised_before_anything_is_started(job, tmp_path):
    """The call that contains the mistake must raise the exception."""
    with pytest.raises(SpecErrors, match=r"spec.seed: -1 is less than 0"):
        palaestra.run(job(END, seed=-1), runs=tmp_path)
    with pytest.raises(RunRefused, match="choose it with replica="):
        palaestra.run(job(END, replicas=2), runs=tmp_path)
    with pytest.raises(RunRefused, match="use 0 to 1"):
        palaestra.run(job(END, replicas=2), replica=2, runs=tmp_path)
    with pytest.raises(RunRefused, match=r"spec\.suspend"):
        palaestra.run(job(END, suspend=True), runs=tmp_path)

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("fork", ["", "os.fork() or time.sleep(1000)"], ids=["alone", "with-a-fork"])
def test_all_of_it_ends_with_the_program_also_after_sigkill(job, tmp_path, fork):
    """If the program ends in any way, its run saves a checkpoint and leaves no process.

    This must work even if a forked child of the program still holds the pipe.
    """
    (tmp_path / "job.yaml").write_text(json.dumps(job(WAIT)))
    script = NOTEBOOK.format(fork=fork)
    program = subprocess.Popen(
        [sys.executable, "-c", script, tmp_path / "job.yaml", tmp_path],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        program.stdout.readline()
        eventually((tmp_path / "desk/0/begun").exists, PATIENCE_S)
        pids = [pid for pid, words in below(program.pid) if "palaestra.run(" not in " ".join(words)]
        program.kill()
        program.wait(PATIENCE_S)

        outcome = eventually(lambda: outcome_of(tmp_path / "desk/0"), PATIENCE_S)
        assert (outcome["exit_code"], outcome["steps"]) == (75, 7)
        assert len(pids) >= 5
        assert left_of(pids) == []
    finally:
        program.stdout.close()
        with suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)


def outcome_of(directory: Path):
    """Return the outcome of a run, or None while it runs."""
    path = directory / "outcome.json"
    return json.loads(path.read_text()) if path.exists() else None
