"""RLlib's DQN with our simulator: the times of a whole run, of a start, and of a recovery after a SIGKILL.

RLlib is not installed with this project. `--rllib PYTHON` names an interpreter that imports Ray and
`palaestra_trainer`; without it, the part is skipped.
"""

import json
import subprocess
import tempfile
import time
from pathlib import Path

from tests.bench import plain
from tests.bench.peer_runs import Program, kill, wait_for_steps, wait_until
from tests.bench.recoveries import WARM_STEPS
from tests.bench.sizes import scaled
from tests.local_run import ROOT
from tests.soak import recovery

MODULE = "tests.bench.rllib_program"
TIMES = 5
VERSION = "import ray; print(ray.__version__)"


def measure(scale=1.0, python=None):
    """Return the times of RLlib's DQN in seconds: a start, recoveries, and a whole run of move-to-target.

    `program_ended` counts the recoveries in which the program ended and was started again.
    """
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, Program(Path(folder), MODULE, python) as training:
        wait_for_steps(training, 1)
        start_s = time.monotonic() - began
        recoveries = [recovered(training) for _ in range(scaled(TIMES, scale))]
        ended = training.revivals
    return {
        "start_s": round(start_s, 2),
        "recoveries_s": recovery.spread(recoveries),
        "program_ended": ended,
        "run_s": round(whole_run(scale, python)),
    }


def recovered(training):
    """Kill the simulator, and return the seconds until the next step."""
    wait_for_steps(training, training.steps() + WARM_STEPS)
    [before] = training.simulators()
    began = time.monotonic()
    kill(training)
    wait_until(lambda: not Path(f"/proc/{before}").exists(), training)
    steps = training.steps()
    wait_for_steps(training, steps + 1)
    return time.monotonic() - began


def whole_run(scale, python):
    """Return the seconds of a run of move-to-target, with evaluations and confirmation."""
    with tempfile.TemporaryDirectory() as folder:
        spec = Path(folder) / "spec.json"
        spec.write_text(json.dumps(plain.job(plain.NEW, scale)["spec"]))
        command = ["env", f"PYTHONPATH={ROOT}", python, "-m", MODULE, spec, folder]
        return plain.seconds_of(command)


def versions(python):
    """Return the version of Ray in another interpreter."""
    done = subprocess.run([python, "-c", VERSION], check=True, capture_output=True, text=True)
    return {"ray": done.stdout.strip()}
