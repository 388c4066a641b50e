"""The seconds until training continues after a simulator fails, and until a hang is detected."""

import os
import signal
import statistics
import time
from contextlib import contextmanager
from pathlib import Path

from palaestra_trainer.ros.service import DEADLINE_S
from tests.local_run import running
from tests.soak.jobs import LITTLE_DQN, tiny_job

TIMES = 10
WARM_STEPS = 100
LOOK_EVERY_S = 0.02
SIMULATOR = "collect-0"
# No claim covers a spare that is still starting; a start takes half a second.
SPARE_READY_S = 30.0


def measure(scale):
    """Return the seconds from SIGKILL to the next step, and from a hang to its detection."""
    times = max(round(TIMES * scale), 2)
    killed = recoveries(times)
    swapped = recoveries(times, standby=True)
    noticed = noticings(times)
    return {
        "times": times,
        "killed_s": spread(killed),
        "killed_with_standby_s": spread(swapped),
        "hang_noticed_s": spread(noticed),
        "hang_deadline_s": DEADLINE_S,
        "claims": {
            "stepping again within 10 s": max(killed) < 10.0,
            "stepping again within 1 s with a standby": max(swapped) < 1.0,
            "a hang is noticed within its deadline + 1 s": max(noticed) < DEADLINE_S + 1.0,
        },
    }


def recoveries(times, *, standby=False):
    """Kill the simulator in use several times, and return the seconds until each next training step."""
    with training(standby=standby) as run:
        return [recovery(run, standby=standby) for _ in range(times)]


def recovery(run, *, standby):
    """Kill the simulator that collects, and return the seconds until the next training step."""
    run.until(lambda: is_ready(run, standby=standby), SPARE_READY_S)
    process, restarts = in_use(run), simulator(run)["restarts"]
    os.kill(process, signal.SIGKILL)
    began = time.monotonic()
    run.until(lambda: simulator(run)["restarts"] > restarts, look_every_s=LOOK_EVERY_S)
    step = run.ask()["step"]
    run.until(lambda: run.ask()["step"] > step, look_every_s=LOOK_EVERY_S)
    return time.monotonic() - began


def noticings(times):
    """Stop the simulator's process several times, and return the seconds until each hang is counted."""
    with training() as run:
        return [noticing(run) for _ in range(times)]


def noticing(run):
    """Stop the process of the simulator that collects, and return the seconds until a hang is counted."""
    run.until(lambda: is_ready(run, standby=False))
    process, before = in_use(run), run.faults().get("hung", 0)
    os.kill(process, signal.SIGSTOP)
    began = time.monotonic()
    run.until(lambda: run.faults().get("hung", 0) > before, look_every_s=LOOK_EVERY_S)
    return time.monotonic() - began


@contextmanager
def training(*, standby=False):
    """Start an endless run that collects with one simulator, and yield it after its first steps."""
    collect = {"recycle": {"afterResets": 0}} | ({"standby": True} if standby else {})
    job = tiny_job(
        collect=collect,
        algorithm=LITTLE_DQN,
        steps=1_000_000,
        evaluation={"everySteps": 0},
        checkpoint={"everySteps": 1_000_000},
    )
    with running(job) as run:
        run.wait_for_step(WARM_STEPS)
        yield run


def is_ready(run, *, standby):
    """Return whether the simulator is ready and, with `standby`, whether its spare is ready too."""
    seen = simulator(run)
    return seen["state"] == "ready" and (not standby or seen["standby"] == "ready")


def simulator(run):
    """Return the entry of the simulator that collects in /status."""
    return next(each for each in run.ask()["simulators"] if each["name"] == SIMULATOR)


def in_use(run):
    """Return the process of the simulator that training steps now; the spare uses no processor time."""
    before = {pid: processor_s(pid) for pid in run.pids("palaestra-stub", SIMULATOR)}
    step = run.ask()["step"]
    run.wait_for_step(step + WARM_STEPS)
    return max(before, key=lambda pid: processor_s(pid) - before[pid])


def processor_s(pid):
    """Return the processor seconds of a process, or 0 if it no longer exists."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def spread(seconds):
    """Return median and maximum of some durations, in seconds."""
    return {"median": round(statistics.median(seconds), 2), "most": round(max(seconds), 2)}
