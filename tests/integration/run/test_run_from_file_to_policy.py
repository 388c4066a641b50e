"""`palaestra run` leads from the file of a TrainingJob to a policy on one machine."""

import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from palaestra.cli.demo import playing_job
from palaestra.job_input import data_of, job_of
from palaestra_sim.world import robots
from palaestra_trainer.ros.master import Master
from tests.jobs import example
from tests.local_run import EXAMPLES, PALAESTRA, LocalRun, left_of

PAGE = re.compile(r"http://127\.0\.0\.1:\d+(?= shows )")
EVAL = Path(sys.executable).with_name("palaestra-eval")
FEW = {
    "steps": 600,
    "evaluation": {"everySteps": 300, "episodes": 2, "confirmEpisodes": 2},
    "checkpoint": {"everySteps": 200, "keep": 2},
}
FEWEST = {
    "steps": 200,
    "evaluation": {"everySteps": 200, "episodes": 1, "confirmEpisodes": 1},
    "checkpoint": {"everySteps": 200, "keep": 2},
}
# The tests in test_bench.py run these examples.
MEASURED = {
    "chaos",
    "move-to-target",
    "move-to-target-mujoco",
    "navigate",
    "paper-dqn",
    "see-target",
    "sparse-reward",
}
# The length of a rollout for the example two-collectors, an eighth of the example's own.
ROLLOUT_STEPS = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A finished run whose collecting simulator was killed during training."""

    run: LocalRun
    code: int
    output: str


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return a finished run for the tests of results."""
    job = example("move-to-target")
    job["spec"]["trainer"].update(FEW | {"steps": 1000})  # enough for the kill to come during training
    with LocalRun(tmp_path_factory.mktemp("finished"), job) as run:
        run.wait_for_step(200)
        os.kill(run.pid_of("palaestra-stub", "collect-0"), signal.SIGKILL)
        code, output = run.end()
    return Finished(run=run, code=code, output=output)


@dataclass(frozen=True, slots=True, kw_only=True)
class Unplugged:
    """The state of a run during training, and its processes after a kill of its runner.

    Attributes:
        nodes: the robots that were registered at the ROS master.
        named: the robots in the worlds of the sidecars.
        page: the response of the page of `--view`.
        pids: the ids of all processes below the runner.
        left: the ids of processes that still ran after the kill.
    """

    nodes: set[str]
    named: set[str]
    page: str
    pids: list[int]
    left: list[int]


@pytest.fixture(scope="module")
def unplugged(tmp_path_factory):
    """Kill the runner of a run with two collecting simulators, and return the observations."""
    job = example("two-collectors")
    job["spec"]["trainer"].update(FEW | {"steps": 50_000})
    run = LocalRun(tmp_path_factory.mktemp("unplugged"), job)
    with ExitStack() as stack:
        stack.callback(run.stop)
        run.start("-v", "--view")
        run.wait_for_step(100)
        page = page_of(run)
        nodes = registered(run)
        worlds = sorted((run.directory / "scratch").glob("*/work/*.wbt"))
        pids = [pid for pid, _ in run.processes()]
        run.process.kill()
        run.end()
    return Unplugged(
        nodes=nodes,
        named={f"/{robot.ros_name}" for world in worlds for robot in robots(world.read_bytes())},
        page=page,
        pids=pids,
        left=left_of(pids),
    )


def registered(run):
    """Return the names of the robots that are registered at a run's ROS master.

    The address of the master is in the run's output.
    """
    master = Master("/test")
    master.uri = re.search("ROS_MASTER_URI=(.+)", run.output())[1]
    return {name for name in master.node_names() if "robotino" in name}


@pytest.mark.parametrize("name", sorted({path.stem for path in EXAMPLES.glob("*.yaml")} - MEASURED))
def test_every_example_runs(run, name):
    """Users copy the examples, so every example must work.

    The test reduces the number of steps.
    """
    code, output = run(name, **FEWEST).start().end()

    assert code == 0, output
    assert "success rate" in output


def test_each_simulator_has_a_legal_name_of_its_own(unplugged):
    """Two simulators with one name would remove each other from the ROS master."""
    assert len(unplugged.nodes) == 3
    assert unplugged.nodes == unplugged.named


def test_after_a_sigkill_of_the_runner_nothing_is_left(unplugged):
    """If the runner is killed, no simulator may keep a processor busy."""
    assert len(unplugged.pids) >= 8
    assert unplugged.left == []


def test_a_killed_simulator_is_one_fault_and_training_goes_on(finished):
    """Only the killed simulator restarts, and the run completes all its steps."""
    assert finished.code == 0, finished.output
    assert finished.run.summary()["steps"] == 1000
    assert finished.run.summary()["faults"] == 1
    assert "faults            1" in finished.output


def test_a_person_reads_how_the_run_goes(finished):
    """A user must understand the output without knowledge of the log's fields."""
    lines = finished.output.splitlines()

    assert any(line.startswith("step ") and " of 1,000 · " in line for line in lines), lines
    (fault,) = [line for line in lines if line.startswith("warning: simulator fault: ")]
    assert fault.endswith("(kind dead, simulator collect-0)")
    assert "[info" not in finished.output


def test_the_demo_plays_a_policy_until_it_is_interrupted(finished, tmp_path):
    """A viewer watches the policy, which does not learn during the demo.

    The same command starts the demo again.
    """
    job = data_of(playing_job(job_of(finished.run.file), finished.run.directory))
    run = LocalRun(tmp_path, job)
    with ExitStack() as stack:
        stack.callback(run.stop)
        run.start("--view")
        run.until(lambda: "[trainer] episode 1: " in run.output())
        address = address_of(run)
        page = page_of(run)
        run.process.send_signal(signal.SIGTERM)
        code, output = run.end()

    assert code == 75, output
    assert " succeeded" in output
    assert "interrupted; the same command starts the job's program again" in output
    assert "<title>" in page
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(address, timeout=5)


def test_a_run_can_be_watched_in_a_browser(unplugged):
    """The page of `--view` is served from the start of the run."""
    assert "<title>" in unplugged.page


def address_of(run):
    """Wait until a run with `--view` has printed the address of its page, and return the address."""
    return run.until(lambda: PAGE.search(run.output()))[0]


def page_of(run):
    """Wait until a run with `--view` serves its page, and return the page."""
    with urllib.request.urlopen(address_of(run), timeout=30) as response:
        return response.read().decode()


def test_a_finished_run_is_reported_and_not_repeated(finished):
    """A user who runs `make run` twice sees the result again at once."""
    before = (finished.run.directory / "attempts.jsonl").read_text()

    code, output = finished.run.start().end()

    assert code == 0
    assert (
        "already finished; to prolong it, raise spec.trainer.steps; to start a new run, add --fresh" in output
    )
    assert (finished.run.directory / "attempts.jsonl").read_text() == before


def test_a_policy_can_be_measured_afterwards(finished):
    """The runner prints this command at its end, so it must work."""
    result = subprocess.run(
        [EVAL, finished.run.directory, "--episodes", "3"],
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
    )

    found = json.loads(result.stdout)
    assert found["episodes"] == 3
    assert found["simulators"] == ["stub"]
    assert found["model"] == hashlib.sha256((finished.run.directory / "model.zip").read_bytes()).hexdigest()


def test_a_policy_is_measured_on_the_same_episodes_in_each_simulator(finished):
    """A user learns whether a policy depends on the simulator in which it was trained."""
    result = subprocess.run(
        [EVAL, finished.run.directory, "--episodes", "2", "--in", "stub,mujoco"],
        capture_output=True,
        text=True,
        timeout=200,
        check=True,
    )

    head, *rows = result.stdout.splitlines()
    assert head.split()[:2] == ["simulator", "success"]
    assert [row.split()[0] for row in rows] == ["stub", "mujoco"]
    assert all(re.search(r"\d+% +\d+% to \d+%", row) for row in rows), rows


def test_a_policy_is_compared_with_itself_in_two_simulators(finished):
    """In a deterministic simulator, equal policies must have equal results in every episode."""
    result = subprocess.run(
        [PALAESTRA, "compare", *[finished.run.directory] * 2, "--episodes", "20", "--json"],
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )

    found = json.loads(result.stdout)
    assert result.returncode == 3, result.stderr
    assert (found["verdict"], found["episodes"], found["difference"]) == ("undecided", 20, 0.0)
    assert (found["only_a"], found["only_b"]) == (0, 0)


def test_an_interrupted_run_goes_on_and_ends_where_it_would_have(tmp_path):
    """The run ends at the boundary of a PPO rollout, as an uninterrupted run would.

    Between the two commands, no process of the run exists: no simulator, no sidecar and no master.
    """
    job = example("two-collectors")
    trainer = job["spec"]["trainer"]
    trainer |= FEW | {"steps": 300, "evaluation": {"everySteps": 0}}
    trainer["algorithm"]["hyperparameters"] |= {"n_steps": ROLLOUT_STEPS, "batch_size": ROLLOUT_STEPS}
    with LocalRun(tmp_path, job) as training:
        training.wait_for_step(150)
        pids = [pid for pid, _ in training.processes()]
        training.process.send_signal(signal.SIGINT)
        code, output = training.end()
        left = left_of(pids)
        saved = max(int(folder.name) for folder in (training.directory / "checkpoints").iterdir())

        assert code == 75, output
        assert "the same command continues" in output
        assert len(pids) >= 8
        assert left == []
        code, output = training.start().end()

        assert code == 0, output
        assert f"resumed at step {saved}" in training.log()
        assert training.summary()["steps"] == 3 * 2 * ROLLOUT_STEPS
