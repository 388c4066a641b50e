"""A training with crashes, hangs and slow steps learns as much as a training without faults.

The job is manifests/examples/chaos.yaml.
"""

import json
import subprocess
import sys
from pathlib import Path

from tests.jobs import example
from tests.local_run import running

EVAL = Path(sys.executable).with_name("palaestra-eval")
EPISODES = 100
WANTED = 0.95
LEAST_STEPS = 1000
LONGEST_S = 7200.0


def measure(scale):
    """Return the results of the training.

    They include the policy's success rate on episodes that were not used to choose the policy.
    """
    job = example("chaos")
    trainer = job["spec"]["trainer"]
    trainer["steps"] = max(round(trainer["steps"] * scale), LEAST_STEPS)
    with running(job) as run:
        code, output = run.end(LONGEST_S)
        if code:
            raise AssertionError(output)
        success = measured(run.directory, max(round(EPISODES * scale), 10))
        summary, faults = run.summary(), run.faults()
    return {
        "success_rate": success,
        "faults": faults,
        "summary": summary,
        "claims": {
            "the simulators failed often": sum(faults.values()) >= trainer["steps"] / 4000,
            f"a success rate of {WANTED:.0%} or more": scale < 1 or success >= WANTED,
        },
    }


def measured(directory, episodes):
    """Return the success rate of the run's policy, measured in a simulator without faults."""
    command = [EVAL, directory, f"--episodes={episodes}", "--seeds=soak"]
    told = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(told.stdout)["success_rate"]
