"""`palaestra run` of a job whose collecting simulators have spares."""

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
    """Return a job: two collecting simulators with spares, and one for evaluation without a spare."""
    pair = {"count": 2, "standby": True} | collect
    return tiny_job(collect=pair, algorithm=LITTLE_DQN, steps=steps, **SELDOM)


@dataclass(frozen=True, slots=True, kw_only=True)
class Replaced:
    """Observations of a run in which a simulator was killed while its spare was ready.

    Attributes:
        waited: whether the simulator in use afterwards was the spare at the time of the kill.
        faults: the run's faults by kind.
        took_over: the lines about the change in the trainer's log.
        spares: the processes in the slot of the killed simulator afterwards.
        left: the simulators that still ran after the end of the run.
    """

    waited: bool
    faults: dict[str, int]
    took_over: list[str]
    spares: list[int]
    left: list[int]


@pytest.fixture(scope="module")
def replaced():
    """Kill a simulator of a run, wait until all spares are ready again, and return the observations."""
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
    """The spare must already run, so that a crash costs almost no time. `make soak` measures that time."""
    assert replaced.waited


def test_a_killed_simulator_is_replaced_by_its_spare_and_becomes_the_next_one(replaced):
    """A crash costs one fault and no wait for a start.

    The ROS name in the log shows which of the two simulators is in use.
    """
    (took_over,) = replaced.took_over

    assert "_0b_robotino_" in took_over
    assert replaced.faults == {"dead": 1}
    assert len(replaced.spares) == 1


def test_spares_end_with_their_run(replaced):
    """A spare that stays would keep a processor busy after the run."""
    assert replaced.left == []


def test_a_simulator_with_a_spare_is_recycled_before_it_would_die_and_without_a_fault():
    """The simulator dies in its 25th reset, so it must be recycled every 24 resets.

    `make soak` does the same for 2,500 episodes.
    """
    recycled = recycling.play(
        EPISODES, {"recycle": {"afterResets": recycling.RESETS}, "standby": True}, recycling.DIES
    )

    assert recycled["steps"] == EPISODES * recycling.STEPS_AN_EPISODE
    assert recycled["faults"] == 0
    assert recycled["recycled"] >= 2
