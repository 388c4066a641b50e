"""`python -P -m palaestra_trainer.cli.play RUN` plays episodes with a run's policy until SIGTERM.

A TrainingJob can name this program as its `trainer.command`. The program plays in the simulators of that job,
and does not learn. The program prints a line for each episode. A simulator that fails is restarted, and the
next episode begins.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import write_line
from palaestra_trainer.errors import TrainerError
from palaestra_trainer.run.fault_tolerant.env import FaultTolerantEnv
from palaestra_trainer.run.fault_tolerant.make import make_players
from palaestra_trainer.run.policies import load_policy

USAGE = "usage: python -P -m palaestra_trainer.cli.play RUN"


def main(arguments: Sequence[str]) -> int:
    """Play episodes until SIGTERM, and return the exit code."""
    if len(arguments) != 1:
        sys.stderr.write(f"{USAGE}\n")
        return ExitCode.CONFIGURATION
    interrupted = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: interrupted.set())
    try:
        policy = load_policy(Path(arguments[0]))
        players = make_players(policy.environment_id, 1, "Collect", policy.environment_options)
        with FaultTolerantEnv(players) as env:
            _play(policy, env, interrupted)
    except TrainerError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return ExitCode.INTERRUPTED  # with another code, the run would count as complete


def _play(policy: Any, env: Any, interrupted: threading.Event) -> None:
    played = succeeded = 0
    while not interrupted.is_set():
        observation, _ = env.reset(seed=played)
        steps, info, over = 0, {}, False
        while not (over or interrupted.is_set()):
            action, _ = policy.predict(observation)
            observation, _, terminated, truncated, info = env.step(action)
            over, steps = terminated or truncated, steps + 1
        fault = info.get("palaestra", {}).get("sim_fault")
        if fault:
            write_line(f"the simulator broke: {fault}; it is restarted")
        elif over:
            played, succeeded = played + 1, succeeded + bool(info.get("is_success"))
            outcome = str(info.get("outcome", "ended")).replace("_", " ")
            write_line(f"episode {played}: {outcome} after {steps} steps; {succeeded} of {played} succeeded")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
