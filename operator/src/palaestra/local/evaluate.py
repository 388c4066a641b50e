"""`palaestra eval`: measure a trained policy on episodes that nothing was chosen on.

The job's own pod again, with `palaestra-eval` in the trainer's place, in a directory of its own beside
the runs: simulators, ROS names and ports are new, the run that is measured is only read.
"""

import asyncio
from pathlib import Path

from palaestra.api import TrainingJob
from palaestra.local import rundir
from palaestra.local.errors import LocalError, Refused
from palaestra.local.output import say
from palaestra.local.ports import HeldPorts
from palaestra.local.replica import Setting, meaning, run_replica
from palaestra.local.run import Options, check, chosen_ports, layout
from palaestra.plan import identified, plan

FOLDER = "evaluation"


def evaluate(job: TrainingJob, options: Options, episodes: int) -> int:
    """Print what `palaestra-eval` measured, one JSON object, and return its exit code.

    Raises:
        LocalError: there is no policy, or it cannot be measured here.
    """
    replica = options.replica or 0
    runs = rundir.job_directory(options.runs, job.metadata.name)
    measured = runs / str(replica)
    if not (measured / "model.zip").exists():
        raise Refused(f"{measured}: there is no model.zip; train it first with `palaestra run`")
    place = runs / FOLDER
    job = _measuring(identified(job, rundir.uid_of(place)), measured, episodes)
    check(job, place, options)
    path = place / str(replica)
    with rundir.locked(path), HeldPorts() as held:
        rundir.remove(path)
        ports = chosen_ports(held, job, options)
        planned = plan(job, layout(place, options, ports)).replicas[replica]
        show = say if options.verbose else None
        outcome = asyncio.run(run_replica(planned, Setting(directory=path, show=show)))
        result = _last_object(path / "logs" / "trainer.log")
    if outcome.exit_code or result is None:
        said = f"the evaluation ended with {meaning(outcome.exit_code)}"
        raise LocalError(f"{said}; read {path / 'logs' / 'trainer.log'}")
    say(result)
    return 0


def _measuring(job: TrainingJob, measured: Path, episodes: int) -> TrainingJob:
    """Return the job with `palaestra-eval` as its program, and no second try."""
    command = ("palaestra-eval", str(measured), "--episodes", str(episodes))
    trainer = job.spec.trainer.model_copy(update={"command": command})
    spec = job.spec.model_copy(update={"trainer": trainer, "backoff_limit": 0})
    return job.model_copy(update={"spec": spec})


def _last_object(log: Path) -> str | None:
    """Return the last line of a log that is a JSON object."""
    lines = log.read_text(errors="replace").splitlines()
    return next((line for line in reversed(lines) if line.startswith("{")), None)
