"""Small versions of `make soak`: faults during a run do not end the run.

Each test runs a part of tests/soak in its smallest size and shows that the part works. The figures in
docs/explain/reliability.md come from the full sizes. test_run_exact_resume.py compares a resumed run with an
uninterrupted one.
"""

import os
import random
import re
import signal
from dataclasses import dataclass
from typing import Any

import pytest

from tests.bench import runs
from tests.local_run import ROOT, is_running, running
from tests.soak import damage, kills, kinds, leaks, recovery
from tests.soak.jobs import LITTLE_PPO

FAULT = re.compile(r"^\| [^|]+ \| `([^`]+)` \| [^|]+ \| [^|]+ \|$", re.MULTILINE)
# There are faults of each kind, but so few that a restarted simulator completes some episodes.
MANY = "crash:probability=0.02 wrong_value:topic=ir2/value,step=31 exit:step=47 lost:topic=ir1/value,every=20"


def test_every_fault_that_the_stub_knows_has_its_line_in_the_table_of_what_follows():
    """The table of consequences must contain every fault of docs/reference/faults.md.

    This test compares only the faults' names, because the texts may differ.
    """
    text = (ROOT / "docs/reference/faults.md").read_text().partition("## The kinds")[2]
    known = FAULT.findall(text.partition("## When")[0])

    assert [fault for fault, _, _ in kinds.rows()] == known


@dataclass(frozen=True, slots=True, kw_only=True)
class Troubled:
    """The results of one run with several faults, in their order.

    Attributes:
        resumed: whether the run resumed from its newest checkpoint after a kill during the next save.
        ended: the end after SIGTERM, as `kills.end` returns it.
        code: the exit code of the trainer after the ROS master was lost.
        again: the reason of the next attempt.
        survived: whether the run resumed although its newest checkpoint was damaged.
    """

    resumed: bool
    ended: dict[str, Any]
    code: int
    again: str
    survived: bool


@pytest.fixture(scope="module")
def troubled():
    """Run a job with one fault after another, as in a run of days, and return the results."""
    moments = random.Random(0)
    with running(kills.job()) as run:
        run.until(run.checkpoints)
        kills.kill(run, moments, while_saving=True)
        resumed = kills.resumes(run)
        ended = kills.end(run, moments, hung=True)
        kills.goes_further(run)
        code, again = lose_the_master(run)
        run.stop()
        survived = damage.is_survived(run, "model.zip", damage.flip)
    return Troubled(resumed=resumed, ended=ended, code=code, again=again, survived=survived)


def lose_the_master(run):
    """Kill the ROS master; return the trainer's exit code and the reason of the next attempt.

    The runner is stopped until the trainer has ended, because the runner could restart the master in time.
    """
    ends, attempts, trainer = len(kills.ENDED.findall(run.output())), len(run.attempts()), run.trainer()
    run.process.send_signal(signal.SIGSTOP)
    try:
        os.kill(run.pid_of("palaestra-ros-master"), signal.SIGKILL)
        run.until(lambda: not is_running(trainer))
    finally:
        run.process.send_signal(signal.SIGCONT)
    (code,) = run.until(lambda: kills.ENDED.findall(run.output())[ends:])
    (again,) = run.until(lambda: run.attempts()[attempts:])
    return int(code), again


def test_a_run_whose_simulators_break_in_many_ways_succeeds():
    """Crashes and wrong data must not end a run.

    This run trains PPO, and test_bench.py trains DQN with similar faults.
    """
    found = kinds.play(MANY, LITTLE_PPO, "Succeeded")

    assert found["exit"] == 0
    assert set(found["faults"]) == {"dead", "wrong_data"}


def test_training_steps_again_after_a_simulator_was_killed_and_notices_one_that_hangs():
    """`make soak` and `make bench` measure the times on an idle machine.

    On a busy machine, this test only counts the faults.
    """
    with recovery.training() as run:
        recovery.recovery(run, standby=False)
        recovery.noticing(run)

        assert {kind: count for kind, count in run.faults().items() if count} == {"dead": 1, "hung": 1}
        figures = runs.memory(run) | runs.recovery(run) | runs.shutdown(run)
    assert len(figures) == len(runs.PROGRAMS) + 2
    assert all(figures.values())


def test_a_trainer_that_is_killed_while_it_saves_resumes(troubled):
    """The run must not use the incomplete checkpoint."""
    assert troubled.resumed


def test_a_trainer_that_is_asked_to_end_in_a_call_that_hangs_saves(troubled):
    """The checkpoint must be saved in half of the grace period, although a simulator never responds."""
    assert kills.is_in_time(troubled.ended), troubled.ended


def test_a_lost_ros_master_costs_an_attempt_and_not_the_run(troubled):
    """Nodes do not register with a new master, so the pod restarts from a checkpoint."""
    assert troubled.code == 75
    assert "resumed at step" in troubled.again


def test_a_damaged_checkpoint_is_noticed_and_the_one_before_is_used(troubled):
    """The checksum of a file shows the damage. Unit tests of the trainer damage the other files."""
    assert troubled.survived


def test_restarts_of_simulators_leave_nothing_behind():
    """After many restarts, the trainer and the sidecars must hold no more resources than before."""
    with running(leaks.job()) as run:
        early, late = leaks.least(run, 3, 6), leaks.least(run, 12, 15)
        if leaks.grown(early, late):  # a cleanup after a restart may be late
            late = leaks.least(run, 20, 40)

    assert leaks.grown(early, late) == []
