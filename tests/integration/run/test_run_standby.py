"""`palaestra run` of a job whose simulators have a spare."""

import os
import signal

import yaml

WITHOUT_EVALUATION = {"evaluation": {"everySteps": 0}, "checkpoint": {"everySteps": 5000, "keep": 2}}


def spares(status):
    """Return the state of each simulator's spare by its name."""
    return {each["name"]: each["standby"] for each in status["simulators"]}


def test_a_killed_simulator_is_replaced_by_its_spare_and_becomes_the_next_one(run):
    """One fault, no wait for a start, and the ROS name tells which of the two is played in."""
    training = run("standby", steps=100_000, **WITHOUT_EVALUATION)
    training.start().wait_for_step(50)
    training.until(lambda: spares(training.ask())["collect-0"] == "ready")

    os.kill(training.pid_of("palaestra-stub", "collect-0.wbt"), signal.SIGKILL)
    training.until(lambda: training.ask()["faults"].get("dead"))
    (took_over,) = training.until(
        lambda: [each for each in training.log().splitlines() if "took over" in each]
    )
    training.wait_for_step(training.ask()["step"] + 50)
    training.until(
        lambda: (
            spares(training.ask())
            == dict.fromkeys(["collect-0", "collect-1"], "ready") | {"evaluate-0": None}
        )
    )

    assert "_0b_robotino_" in took_over
    assert len(training.pids("palaestra-stub", "collect-0.wbt")) == 1
    training.stop()
    assert training.pids("palaestra-stub") == []


def test_simulators_with_a_spare_are_recycled_without_a_fault(run):
    """Often here: every second episode of each."""
    training = run("standby", steps=800, **WITHOUT_EVALUATION)
    job = yaml.safe_load(training.file.read_text())
    job["spec"]["simulators"][0]["recycle"] = {"afterResets": 2}
    training.file.write_text(yaml.safe_dump(job))

    code, output = training.start().end()

    assert code == 0, output
    assert training.summary()["faults"] == 0
    assert training.log().count("standby took over") >= 2
