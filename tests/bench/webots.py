"""Environment steps with the controller for Webots, and with the stub, in turns.

The tests' own Webots also simulates with the stub, but in another process. So the difference is the cost of
the controller, of libController's calls, and of the tests' Webots, which computes each result in Python.
"""

import itertools
import os
import statistics
import tempfile
from pathlib import Path
from unittest.mock import patch

from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.bench.stepping import rate, step
from tests.fake_webots.home import make_home

ROUNDS = 3
STEPS = 500


def measure(scale=1.0):
    """Return the steps per second with each simulator, and the median of the rounds' ratios."""
    with tempfile.TemporaryDirectory() as folder:
        home = make_home(Path(folder))
        path = f"{home}{os.pathsep}{os.environ['PATH']}"
        with patch.dict(os.environ, WEBOTS_HOME=str(home), PATH=path):
            pairs = [
                (steps_per_second("webots", scale), steps_per_second("stub", scale))
                for _ in range(scaled(ROUNDS, scale))
            ]
    return {
        "steps_per_second": round(statistics.median(webots for webots, _ in pairs)),
        "stub_steps_per_second": round(statistics.median(stub for _, stub in pairs)),
        "times_stub": round(statistics.median(webots / stub for webots, stub in pairs), 2),
    }


def steps_per_second(driver, scale):
    """Return the steps per second in the built-in arena."""
    with running(driver=driver) as (robot, _, _):
        ways = itertools.cycle((1.0, -1.0))
        return rate(lambda: step(robot, next(ways)), scaled(STEPS, scale))
