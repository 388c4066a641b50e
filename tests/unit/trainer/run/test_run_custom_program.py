"""Programs of users report their progress; each test runs one as a process."""

from __future__ import annotations

import json
import multiprocessing
import os
import socket
import subprocess
import sys
from urllib.request import urlopen

import pytest
import yaml

from palaestra_protocol.pod.enums import Role
from palaestra_protocol.pod.status import Cause, EvaluationStatus, Termination, TrainerStatus
from palaestra_trainer import report
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.run.custom_program import ProgramReport, reported

LONG_S = 60
PROGRAM = """
import sys
from palaestra_trainer import report
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.run.custom_program import ProgramReport
for line in sys.stdin:
    report(**eval(line))
    print("reported", flush=True)
"""


@pytest.fixture
def address():
    """Return a free address."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{listener.getsockname()[1]}"


@pytest.fixture
def program(tmp_path, address):
    """Yield a function that lets a program report and waits for the report.

    The program has a target of 1000 steps.
    """
    job = {
        "job": "own",
        "environment": {"id": "Task-v0"},
        "steps": 1000,
        "statusAddress": address,
        "simulators": [{"name": "a-0", "group": "a", "index": 0, "role": "Collect"}],
    }
    (tmp_path / "training.yaml").write_text(yaml.safe_dump(job))
    variables = {
        "PALAESTRA_CONFIG": str(tmp_path / "training.yaml"),
        "PALAESTRA_TERMINATION_LOG": str(tmp_path / "word"),
    }
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        env=os.environ | variables,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:

        def reports(**arguments):
            process.stdin.write(f"{arguments!r}\n")
            process.stdin.flush()
            assert process.stdout.readline() == "reported\n"

        yield reports
        process.stdin.close()
        assert process.wait(LONG_S) == 0


def answer(address, path):
    """Return the program's response to a request."""
    with urlopen(f"http://{address}{path}", timeout=LONG_S) as response:
        return response.read().decode()


def test_a_program_that_reports_answers_as_the_built_in_loop_does(program, address):
    """The operator reads /status of every trainer, and Prometheus reads /metrics."""
    program(step=10, success_rate=0.5)
    program(step=20)

    status = TrainerStatus.from_json(json.loads(answer(address, "/status")))
    lines = answer(address, "/metrics").splitlines()
    assert (status.step, status.target, status.success_rate, status.phase) == (20, 1000, 0.5, "training")
    assert status.last_progress is not None
    assert status.last_evaluation == EvaluationStatus(step=10, success_rate=0.5)
    assert "palaestra_trainer_steps_total 20.0" in lines
    assert answer(address, "/healthz") == "ok\n"


def test_what_a_program_spends_its_time_on_is_not_known(program, address):
    """A second with a wrong cause would mislead more than a second with an unknown cause."""
    program(step=10)

    assert json.loads(answer(address, "/status"))["goodput"] == {}
    assert not [line for line in answer(address, "/metrics").splitlines() if "seconds_total{cause" in line]


def test_a_program_that_reaches_its_steps_has_said_its_last_word(program, tmp_path):
    """The program may end before the operator polls it again."""
    program(step=999)
    before = (tmp_path / "word").exists()

    program(step=1000, success_rate=0.75)

    word = Termination.from_message((tmp_path / "word").read_text())
    assert not before
    assert (word.step, word.success_rate) == (1000, 0.75)
    assert word.last_evaluation == EvaluationStatus(step=1000, success_rate=0.75)


@pytest.mark.parametrize(
    ("arguments", "mistake"),
    [
        ({"step": -1}, "step: -1 is negative"),
        ({"step": 1, "success_rate": 95}, "95 is not a share"),
    ],
)
def test_a_report_of_what_cannot_be_is_refused(arguments, mistake):
    """A rate in percent would look like a very good policy."""
    with pytest.raises(ValueError, match=mistake):
        report(**arguments)


def test_a_report_outside_of_a_job_does_nothing(monkeypatch):
    """The same program must run in a notebook."""
    monkeypatch.delenv("PALAESTRA_CONFIG", raising=False)

    report(step=1)


def test_steps_of_tolerant_environments_count_until_the_program_reports():
    """After its first report, only the program's own number counts, because it includes earlier attempts."""
    progress = ProgramReport(100, [])

    progress.played(Role.COLLECT, [{}, {"episode": {"r": 1.0, "l": 5}}, {"palaestra": {"sim_fault": {}}}])
    before = progress.status()
    progress.reports(50, None)
    progress.played(Role.COLLECT, [{}])

    assert (before.step, before.episodes, before.mean_return) == (2, 1, 1.0)
    assert progress.status().step == 50


def test_steps_of_an_evaluating_environment_are_none_of_training(clock):
    """The operator must neither count these steps nor take an evaluation for a stalled training."""
    progress = ProgramReport(100, [], clock)
    progress.played(Role.COLLECT, [{}])

    progress.played(Role.EVALUATE, [{}])

    assert (progress.status().step, progress.phase) == (1, "evaluating")
    clock.now += 61.0
    assert progress.phase == "training"  # a minute without a step may be a hung training
    progress.played(Role.COLLECT, [{}])
    assert (progress.status().step, progress.phase) == (2, "training")


def test_a_worker_process_has_a_progress_that_is_not_served(make_configuration, monkeypatch):
    """The main process serves the address, so a worker must not."""
    monkeypatch.setattr(multiprocessing, "parent_process", multiprocessing.current_process)
    configuration = make_configuration()

    assert reported(configuration) is not reported(configuration)
    assert reported(configuration).target == configuration.steps


def test_faults_and_restarts_of_a_program_s_simulators_are_in_its_status():
    """The operator reads the same fields of each trainer, whether its loop is built in or a user's."""
    progress = ProgramReport(100, [])
    progress.add("collect-0", Role.COLLECT)
    progress.add("collect-0", Role.COLLECT)
    progress.started("collect-0")

    progress.fault("collect-0", SimulatorDead("collect-0", "gone"), 3)
    with progress.spending(Cause.RECOVERING):
        progress.restarted("collect-0", recycled=False)

    status = progress.status()
    assert (status.faults["dead"], status.steps_lost, status.goodput) == (1, 3, {})
    assert [(it.name, it.state, it.restarts) for it in status.simulators] == [("collect-0", "ready", 1)]
