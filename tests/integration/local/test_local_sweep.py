"""`palaestra sweep` on this machine: real runs, most of them with small programs as trainers."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from palaestra.cli import main
from palaestra.job_input import job_of
from palaestra.sweeps.local_backend import busy
from tests.jobs import make_job
from tests.local_run import EXAMPLES, below, left_of
from tests.waiting import eventually

PALAESTRA = Path(sys.executable).with_name("palaestra")
PATIENCE_S = 90.0
RATE = "trainer.algorithm.hyperparameters.learning_rate"
COMMON = """\
import json, os, pathlib, signal, sys, yaml
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
run = pathlib.Path(os.environ["PALAESTRA_RUN"])
config = yaml.safe_load(pathlib.Path(os.environ["PALAESTRA_CONFIG"]).read_text())
rate, seed = config["algorithm"]["hyperparameters"]["learning_rate"], config["seed"]

def evaluate(step, success_rate):
    line = {"step": step, "success_rate": success_rate, "mean_return": -1.0}
    with (run / "evaluations.jsonl").open("a") as file:
        file.write(json.dumps(line) + "\\n")

def finish(success_rate):
    (run / "summary.json").write_text(json.dumps({"steps": 20, "success_rate": success_rate}))

def wait():
    (run / "begun").touch()
    signal.sigwait([signal.SIGTERM])
    sys.exit(75)
"""
LEARN = """\
evaluate(10, rate * seed)
finish(rate * seed)
"""
WAIT_ONCE = """\
if not (run / "begun").exists():
    wait()
finish(1.0)
"""
FIRST_IS_BEST = """\
first = config["job"] == "s-0"
evaluate(10, 1.0 if first else rate)
if not first:
    wait()
finish(1.0)
"""


@pytest.fixture
def desk(tmp_path):
    """Return a function that writes a sweep whose trainer is a program, and returns the file."""

    def write(program, **spec):
        (tmp_path / "program.py").write_text(COMMON + program)
        command = ["python", str(tmp_path / "program.py")]
        trainer = {"command": command, "algorithm": {"name": "DQN"}}
        job = make_job("j", backoffLimit=0, trainer=trainer)
        sweep = {
            "apiVersion": "palaestra.dev/v1alpha1",
            "kind": "Sweep",
            "metadata": {"name": "s"},
            "spec": {"job": job, **spec},
        }
        (tmp_path / "sweep.yaml").write_text(yaml.safe_dump(sweep))
        return tmp_path / "sweep.yaml"

    return write


def states(folder):
    """Return the state of each finished trial, by number."""
    lines = (folder / "trials.jsonl").read_text().splitlines()
    return {line["trial"]: line["state"] for line in map(json.loads, lines)}


def test_a_sweep_ends_with_a_table_a_picture_and_a_run_directory_a_seed(desk, tmp_path, capsys):
    """The same command again must print the result without training."""
    typed = ["sweep", str(desk(LEARN, matrix={RATE: [0.1, 0.2]}, seeds=2)), "--dir", str(tmp_path / "runs")]

    assert main(typed) == 0

    folder = tmp_path / "runs" / "s"
    out = capsys.readouterr().out
    assert (folder / "table.txt").read_text() in out
    assert "s-0    0.1            complete  2/2    0.15          0.125 to 0.175" in out
    assert f"best: s-1, {RATE} = 0.2" in out
    assert (folder / "curves.png").read_bytes().startswith(b"\x89PNG")
    ended = {path: path.stat().st_mtime_ns for path in folder.glob("s-*/*/outcome.json")}
    assert len(ended) == 4
    assert main(typed) == 0
    assert {path: path.stat().st_mtime_ns for path in ended} == ended
    assert "best: s-1" in capsys.readouterr().out


def test_ctrl_c_ends_all_runs_with_a_checkpoint_and_the_same_command_resumes_them(desk, tmp_path):
    """A user may have to interrupt a sweep that takes days. Here two trials run, and a third one waits."""
    file = desk(WAIT_ONCE, matrix={RATE: [0.1, 0.2, 0.3]})
    command = [PALAESTRA, "sweep", file, "--dir", tmp_path / "runs", "--at-once", "2"]
    folder = tmp_path / "runs" / "s"
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as sweep:
        try:
            eventually(lambda: len(list(folder.glob("s-*/0/begun"))) == 2, PATIENCE_S)
            pids = [pid for pid, _ in below(sweep.pid)]
            sweep.send_signal(signal.SIGINT)
            out, _ = sweep.communicate(timeout=PATIENCE_S)
        finally:
            sweep.kill()

    assert (sweep.returncode, left_of(pids)) == (75, [])
    assert "interrupted; each run saves a checkpoint" in out
    assert {json.loads(path.read_text())["exit_code"] for path in folder.glob("s-*/0/outcome.json")} == {75}
    (folder / "s-2/0").mkdir(parents=True, exist_ok=True)
    (folder / "s-2/0/begun").touch()
    resumed = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert resumed.returncode == 0, resumed.stdout + resumed.stderr
    assert states(folder) == {0: "complete", 1: "complete", 2: "complete"}


def test_a_trial_that_optuna_prunes_is_stopped(desk, tmp_path, capsys):
    """The pruned trial keeps its checkpoint, and the sweep continues with the next trial."""
    space = {RATE: {"low": 0.1, "high": 0.2}}
    file = desk(FIRST_IS_BEST, random=space, trials=3, optuna={"startupTrials": 1})

    code = main(["sweep", str(file), "--dir", str(tmp_path / "runs"), "--at-once", "1"])

    assert code == 0, capsys.readouterr().out
    assert states(tmp_path / "runs" / "s") == {0: "complete", 1: "pruned", 2: "pruned"}
    assert "best: s-0" in capsys.readouterr().out


def test_every_trial_is_checked_before_the_first_begins(desk, tmp_path, capsys):
    """A user must not find the mistake only after a night, when the last trial starts."""
    file = desk(LEARN, matrix={"trainer.steps": [10, 0]})

    assert main(["sweep", str(file), "--dir", str(tmp_path / "runs")]) == 2

    assert capsys.readouterr().err == "trial 1: spec.trainer.steps: 0 is less than 1; use 1 or more\n"
    assert not (tmp_path / "runs").exists()


def test_a_failed_trial_is_named_and_the_others_go_on(desk, tmp_path, capsys):
    """A script uses the exit code, and a user reads the failed trial in the table."""
    file = desk("finish(1.0)\nsys.exit(81 if rate > 0.1 else 0)\n", matrix={RATE: [0.2, 0.1]})

    assert main(["sweep", str(file), "--dir", str(tmp_path / "runs")]) == 1

    assert states(tmp_path / "runs" / "s") == {0: "failed", 1: "complete"}
    assert "s-0: failed" in capsys.readouterr().out


def test_a_run_keeps_as_many_processors_busy_as_it_has_collecting_simulators():
    """The collecting simulators step at the same time, and each keeps one processor busy.

    Meanwhile the trainer waits, and the evaluating simulators are idle.
    """
    assert busy(job_of(EXAMPLES / "minimal.yaml")) == 1
    assert busy(job_of(EXAMPLES / "two-collectors.yaml")) == 2
