"""`palaestra run` of a job whose simulators have a spare."""

from dataclasses import dataclass

import pytest

from tests.local_run import is_running, running
from tests.soak import recovery, recycling
from tests.soak.jobs import LITTLE_DQN, tiny_job

SELDOM = {
    "evaluation": {"everySteps": 500_000, "episodes": 1, "confirmEpisodes": 1},
    "checkpoint": {"everySteps": 500_000},
}
EPISODES = 60
READY = {"collect-0": "ready", "collect-1": "ready", "evaluate-0": None}


def job(steps, **collect):
    """Return a job of two simulators with spares, and one for evaluation without a spare."""
    pair = {"count": 2, "standby": True} | collect
    return tiny_job(collect=pair, algorithm=LITTLE_DQN, steps=steps, **SELDOM)


@dataclass(frozen=True, slots=True, kw_only=True)
class Replaced:
    """The observations of a simulator that was killed while its spare was ready.

    Attributes:
        waited: whether the simulator now in use was the spare when the other one was killed.
        faults: of the run, by kind.
        took_over: the lines of the trainer's log about the change.
        spares: the processes that the first slot of the pair, which was killed, runs again.
        left: the simulators that still ran after the run's end.
    """

    waited: bool
    faults: dict[str, int]
    took_over: list[str]
    spares: list[int]
    left: list[int]


@pytest.fixture(scope="module")
def replaced():
    """Return one run that continues after the fault until all of its spares are ready again."""
    with running(job(1_000_000, recycle={"afterResets": 0})) as run:
        run.wait_for_step(recovery.WARM_STEPS)
        run.until(lambda: recovery.is_ready(run, standby=True), recovery.SPARE_READY_S)
        stood_by = run.pids("palaestra-stub", recovery.SIMULATOR)
        recovery.recovery(run, standby=True)
        run.until(lambda: {each["name"]: each["standby"] for each in run.ask()["simulators"]} == READY)
        waited = recovery.in_use(run) in stood_by
        faults, log = run.faults(), run.log().splitlines()
        simulators, spares = run.pids("palaestra-stub"), run.pids("palaestra-stub", "collect-0.wbt")
        run.stop()
        left = [pid for pid in simulators if is_running(pid)]
    return Replaced(
        waited=waited,
        faults=faults,
        took_over=[line for line in log if "took over" in line],
        spares=spares,
        left=left,
    )


def test_a_crash_waits_for_no_start(replaced):
    """A crash costs next to no time, like recycling, as `make soak` measures."""
    assert replaced.waited


def test_a_killed_simulator_is_replaced_by_its_spare_and_becomes_the_next_one(replaced):
    """It costs one fault and no wait for a start.

    The ROS name shows which of the two is in use.
    """
    (took_over,) = replaced.took_over

    assert "_0b_robotino_" in took_over
    assert replaced.faults == {"dead": 1}
    assert len(replaced.spares) == 1


def test_spares_end_with_their_run(replaced):
    """All simulators end with their run."""
    assert replaced.left == []


def test_a_simulator_with_a_spare_is_recycled_before_it_would_die_and_without_a_fault():
    """Here it is recycled every 24 resets, because it survives no more.

    `make soak` does the same for 2,500 episodes.
    """
    recycled = recycling.play(
        EPISODES, {"recycle": {"afterResets": recycling.RESETS}, "standby": True}, recycling.DIES
    )

    assert recycled["steps"] == EPISODES * recycling.STEPS_AN_EPISODE
    assert recycled["faults"] == 0
    assert recycled["recycled"] >= 2
