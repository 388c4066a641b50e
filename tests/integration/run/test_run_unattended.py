"""Short forms of `make soak`: what breaks amid a run does not end it.

Each is a part of tests/soak in its smallest size, so that the whole proof is known to work; the figures
of docs/reliability.md come from the whole sizes. What is equal after a resume is in
test_run_exact_resume.py.
"""

import os
import random
import re
import signal

import pytest

from tests.local_run import ROOT, running
from tests.soak import damage, kills, kinds, leaks, recovery
from tests.soak.jobs import LITTLE_DQN, LITTLE_PPO

FAULT = re.compile(r"^\| [^|]+ \| `([^`]+)` \| [^|]+ \| [^|]+ \|$", re.MULTILINE)
# Of each kind some, and so seldom that a restarted simulator gets a few episodes far.
MANY = "crash:probability=0.02 wrong_value:topic=ir2/value,step=31 exit:step=47 lost:topic=ir1/value,every=20"


def test_every_fault_that_the_stub_knows_has_its_line_in_the_table_of_what_follows():
    """Both tables are played, each by other tests; here they are compared: what they say may differ."""
    text = (ROOT / "docs/simulators.md").read_text().partition("### The kinds")[2]
    known = FAULT.findall(text.partition("### When")[0])

    assert [fault for fault, _, _ in kinds.rows()] == known


@pytest.mark.parametrize("algorithm", [LITTLE_DQN, LITTLE_PPO], ids=["DQN", "PPO"])
def test_a_run_whose_simulators_break_in_many_ways_succeeds(algorithm):
    """The faults are counted by kind, and cost no more than what they cut."""
    found = kinds.play(MANY, algorithm, "Succeeded")

    assert found["exit"] == 0
    assert set(found["faults"]) == {"dead", "wrong_data"}


def test_a_simulator_steps_again_soon_after_it_was_killed_and_after_it_hung():
    """Recovery takes a restart; a hang is noticed by the deadline of the call that meets it."""
    with recovery.training() as run:
        assert recovery.recovery(run, standby=False) < 10.0
        assert recovery.noticing(run) < recovery.DEADLINE_S + 1.0


def test_a_standby_takes_over_in_less_than_a_second():
    """It is up already, so that a crash costs what a recycled simulator costs: next to nothing."""
    with recovery.training(standby=True) as run:
        assert recovery.recovery(run, standby=True) < 1.0


def test_a_trainer_that_is_killed_while_it_saves_resumes_and_one_that_is_asked_to_end_saves():
    """The second is asked amid a call that a hung simulator never answers."""
    moments = random.Random(0)
    with running(kills.job()) as run:
        run.until(run.checkpoints)
        kills.kill(run, moments, while_saving=True)
        resumed = kills.resumes(run)
        ended = kills.end(run, moments, hung=True)

    assert resumed
    assert kills.is_in_time(ended), ended


def test_a_lost_ros_master_costs_an_attempt_and_not_the_run():
    """Nothing registers again with a new master, so the pod begins anew, from a checkpoint."""
    with running(kills.job()) as run:
        run.until(run.checkpoints)
        os.kill(run.pid_of("rosmaster"), signal.SIGKILL)
        (code,) = run.until(lambda: kills.ENDED.findall(run.output()))
        again = run.until(lambda: run.attempts()[1:])

    assert code == "75"
    assert "resumed at step" in again[0]


def test_a_damaged_checkpoint_is_noticed_and_the_one_before_is_used(tmp_path):
    """By its checksum; tests of the trainer damage the other files."""
    run = damage.interrupted(tmp_path)

    assert damage.is_survived(run, "model.zip", damage.flip)


def test_restarts_of_simulators_leave_nothing_behind():
    """Neither in the trainer nor in the sidecars."""
    with running(leaks.job()) as run:
        early, late = leaks.least(run, 4, 8), leaks.least(run, 16, 20)
        if leaks.grown(early, late):  # what is leaked stays, what a restart needs goes
            late = leaks.least(run, 20, 40)

    assert leaks.grown(early, late) == []
