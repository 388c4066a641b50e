"""The seconds from a command to the first step of its training: `palaestra run`, and other programs.

`palaestra run` starts ROS master, sidecar, stub and trainer. `subproc` is the program with Stable-Baselines3
and one stub in a process of `SubprocVecEnv`, and needs no runner.
"""

import statistics
import tempfile
import time
from pathlib import Path

from tests.bench.peer_runs import LOOK_EVERY_S, Program, job, started_at_s, wait_for_steps
from tests.bench.sizes import scaled
from tests.local_run import running
from tests.soak.jobs import ANY_NUMBER

TIMES = 20


def measure(scale=1.0):
    """Return the median times of the whole start of each program, and of the phases of `palaestra run`."""
    times = scaled(TIMES, scale)
    ours, theirs = [], []
    for _ in range(times):
        ours.append(phases())
        theirs.append(of_program())
    return {
        "times": times,
        "palaestra_s": median(sum(each.values()) for each in ours),
        "subproc_s": median(theirs),
        "phases_s": {name: median(each[name] for each in ours) for name in ours[0]},
    }


def phases():
    """Return the seconds of each phase of `palaestra run`, which add up to the whole start."""
    began = time.time()
    with running(job(ANY_NUMBER)) as run:
        run.until(lambda: (run.status() or {}).get("step"), look_every_s=LOOK_EVERY_S)
        moments = {
            "runner": started_at_s(run.trainer()),
            "trainer": (run.directory / "attempts.jsonl").stat().st_mtime,
            "first step": time.time(),
        }
    ends = list(moments.values())
    begins = [began, *ends[:-1]]
    return {name: end - begin for name, begin, end in zip(moments, begins, ends, strict=True)}


def of_program():
    """Return the seconds from the start of a program to its first step."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.time()
        with Program(Path(folder)) as training:
            wait_for_steps(training, 1)
            return time.time() - began


def median(seconds):
    """Return the median of some durations, in seconds."""
    return round(statistics.median(seconds), 2)
