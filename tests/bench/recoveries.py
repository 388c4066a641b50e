"""The seconds from the SIGKILL of a simulator to the next step, with Palaestra and with Stable-Baselines3.

`palaestra` restarts the simulator during the run. `standby` does the same with a spare simulator. The run of
`without_restarts` ends with exit code 80, and a loop starts the run again. `subproc` is Stable-Baselines3
with `SubprocVecEnv`: its program ends with an EOFError, and a loop restarts it from its newest checkpoint.
"""

import statistics
import tempfile
import time
from pathlib import Path

from tests.bench.peer_runs import Palaestra, Program, kill, wait_for_steps, wait_until
from tests.bench.sizes import scaled
from tests.soak import recovery

TIMES = 10
WARM_STEPS = 100
NEVER = {"limit": 0, "withinSeconds": 600}


def measure(scale=1.0):
    """Return median and maximum of the seconds until the next step, by the way of training."""
    times = scaled(TIMES, scale)
    return {
        "times": times,
        "palaestra": recovery.spread(recovery.recoveries(times)),
        "standby": recovery.spread(recovery.recoveries(times, standby=True)),
        "without_restarts": of_a_loop(lambda folder: Palaestra(folder, NEVER), times),
        "subproc": of_a_loop(Program, times),
    }


def of_a_loop(make, times):
    """Return the spread of several recoveries of a training, and the steps that each of them repeats."""
    with tempfile.TemporaryDirectory() as folder, make(Path(folder)) as training:
        found = [recovered(training) for _ in range(times)]
    seconds, lost = zip(*found, strict=True)
    return recovery.spread(seconds) | {"steps_lost": round(statistics.median(lost))}


def recovered(training):
    """Kill the simulator, and return the seconds until the next step and the number of lost steps."""
    wait_for_steps(training, training.steps() + WARM_STEPS)
    revivals, began = training.revivals, time.monotonic()
    kill(training)
    reached = training.steps()
    wait_until(lambda: training.revivals > revivals, training)
    resumed = training.steps()
    wait_for_steps(training, resumed + 1)
    return time.monotonic() - began, max(reached - resumed, 0)
