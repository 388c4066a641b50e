"""From a TrainingJob file to a policy, on one machine."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from palaestra_sim.world import robots
from palaestra_trainer.ros.master import Master
from tests.local_run import is_running

EXAMPLES = Path(__file__).parents[3] / "manifests/examples"
EVAL = Path(sys.executable).with_name("palaestra-eval")
FEW = {
    "steps": 600,
    "evaluation": {"everySteps": 300, "episodes": 2},
    "checkpoint": {"everySteps": 200, "keep": 2},
}


@pytest.mark.parametrize("example", sorted(path.stem for path in EXAMPLES.glob("*.yaml")))
def test_every_example_runs(run, example):
    """With few steps here; what people copy must work."""
    code, output = run(example, **FEW).start().end()

    assert code == 0, output
    assert "success rate" in output


def test_each_simulator_has_a_legal_name_of_its_own(run):
    """What `rosnode list` shows, and what stands in the generated worlds of the run directory."""
    training = run("two-collectors", **FEW | {"steps": 50_000}).start("-v")
    training.wait_for_step(100)

    master = Master("/test")
    master.uri = re.search("ROS_MASTER_URI=(.+)", training.output())[1]
    nodes = {name for name in master.node_names() if "robotino" in name}

    worlds = sorted((training.directory / "worlds").glob("*.wbt"))
    named = {f"/{robot.ros_name}" for world in worlds for robot in robots(world.read_bytes())}
    assert len(nodes) == 3
    assert nodes == named


def test_a_killed_simulator_is_one_fault_and_training_goes_on(run):
    """It alone is restarted; the run ends as if nothing had been."""
    training = run(**FEW | {"steps": 1500}).start()
    training.wait_for_step(200)

    os.kill(training.pid_of("palaestra-stub", "collect-0"), signal.SIGKILL)
    code, output = training.end()

    assert code == 0, output
    assert training.summary()["steps"] == 1500
    assert training.summary()["faults"] == 1
    assert "faults            1" in output


@pytest.mark.parametrize(("example", "steps"), [("move-to-target", 3000), ("two-collectors", 9000)])
def test_an_interrupted_run_goes_on_and_ends_where_it_would_have(run, example, steps):
    """DQN exactly at its steps, PPO at its rollout boundary, as without the interruption."""
    wanted = FEW | {"steps": steps, "evaluation": {"everySteps": 0}}
    training = run(example, **wanted).start()
    training.wait_for_step(steps // 3)
    training.process.send_signal(signal.SIGINT)
    code, output = training.end()
    saved = max(int(folder.name) for folder in (training.directory / "checkpoints").iterdir())

    assert code == 75, output
    assert "the same command goes on" in output
    code, output = training.start().end()

    assert code == 0, output
    assert f"resumed at step {saved}" in training.log()
    # Two simulators with 512 steps each, as the example says.
    rollout = 2 * 512 if example == "two-collectors" else 1
    assert training.summary()["steps"] == -(-steps // rollout) * rollout


def test_a_finished_run_is_reported_and_not_repeated(run):
    """A second `make run` says what there is, in seconds."""
    run_ = run(**FEW)
    run_.start().end()
    before = (run_.directory / "attempts.jsonl").read_text()

    code, output = run_.start().end()

    assert code == 0
    assert "finished already; --fresh begins anew" in output
    assert (run_.directory / "attempts.jsonl").read_text() == before


def test_after_a_sigkill_of_the_runner_nothing_is_left(run):
    """Pulling the plug on the runner must not leave simulators behind."""
    training = run(**FEW | {"steps": 50_000}).start()
    training.wait_for_step(50)
    pids = [pid for pid, _ in training.processes()]

    training.process.kill()
    training.end()

    assert len(pids) >= 8
    give_up = time.monotonic() + 10
    while any(map(is_running, pids)) and time.monotonic() < give_up:
        time.sleep(0.05)
    assert [pid for pid in pids if is_running(pid)] == []


def test_a_policy_can_be_measured_afterwards(run):
    """As the runner says at its end."""
    training = run(**FEW)
    training.start().end()

    result = subprocess.run(
        [EVAL, training.directory, "--episodes", "3"], capture_output=True, text=True, timeout=100, check=True
    )

    assert json.loads(result.stdout)["episodes"] == 3
