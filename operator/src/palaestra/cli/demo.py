"""`palaestra demo`: train a robot, show it in a browser, break its simulator on request, play its policy."""

import argparse
from collections.abc import Mapping
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from palaestra.api import TrainingJob
from palaestra.cli.files import add_dir
from palaestra.cli.subcommands import Commands, command
from palaestra.job_input import data_of, job_of
from palaestra.live_view.view_process import viewed
from palaestra.local.outcome import RunOutcome
from palaestra.local.output import say
from palaestra.local.run import RunOptions, run
from palaestra_protocol.pod.status import ExitCode

DEMO = """\
Trains a Robotino to drive to a target, in minutes, and shows the training in a browser. Two buttons of the
page kill and hang the shown simulator; the page shows after how many seconds the simulator steps again. Then
the best policy plays, about as fast as a real robot, until Ctrl-C. Without a display, the command prints the
address of the page and opens no browser. The same command resumes an interrupted training; after a finished
training, it plays the policy again. Needs the optional package viser.
"""
EXIT_CODES = """\
exit codes:
  0    ended by Ctrl-C while the policy played
  2    this machine is not suitable, or viser is missing; nothing was started
  75   interrupted while it trained; run the same command to resume
  1    failed; the last lines of the log give the reason
"""
JOB = "demo.yaml"
# The stub computes a step of the robot, which is 192 ms of simulated time, in less than 1 ms. With this
# fault, a step takes about as long as in real time.
ABOUT_REAL_TIME = {"name": "PALAESTRA_STUB_FAULTS", "value": "slow:latency_ms=190"}


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "demo", _demo, DEMO, EXIT_CODES)
    add_dir(parser)


def _demo(options: argparse.Namespace) -> int:
    learns = demo_job()
    trained = options.dir.absolute() / learns.metadata.name / "0"
    outcome = RunOutcome.of(trained)
    if outcome is None or not outcome.finished:
        code = _shown(learns, options.dir)
        if code != ExitCode.DONE:
            return code
    say("the best policy plays now; Ctrl-C ends it")
    code = _shown(playing_job(learns, trained), options.dir)
    return ExitCode.DONE if code == ExitCode.INTERRUPTED else code


def demo_job() -> TrainingJob:
    """Return the job that the demo trains."""
    return job_of((files("palaestra") / JOB).read_text(encoding="utf-8"))


def playing_job(learns: TrainingJob, trained: Path) -> TrainingJob:
    """Return a job that plays the policy of the run directory `trained` in the world of `learns`."""
    spec: Mapping[str, Any] = data_of(learns)["spec"]
    first = spec["simulators"][0]
    program = ["python", "-P", "-m", "palaestra_trainer.cli.play", str(trained)]
    return job_of(
        {
            **data_of(learns),
            "metadata": {"name": f"{learns.metadata.name}-plays"},
            "spec": {
                "simulators": [{**first, "name": "play", "env": [ABOUT_REAL_TIME]}],
                "trainer": {
                    "environment": spec["trainer"]["environment"],
                    "command": program,
                    "evaluation": {"everySteps": 0},
                },
            },
        }
    )


def _shown(job: TrainingJob, runs: Path) -> int:
    """Run a job on this machine, show it in a browser, and return its exit code."""
    with viewed(runs / job.metadata.name / "0", opened=True):
        return run(job, RunOptions(runs=runs, version=version("palaestra")))
