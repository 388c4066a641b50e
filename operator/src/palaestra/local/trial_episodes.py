"""`palaestra try --local`: play a few episodes of a job's environment on this machine, without training.

The job is checked and planned as by `palaestra run`, but its files are written to a temporary folder. The
trainer's program `palaestra-try` then plays the episodes in the first collecting simulator. `palaestra-try`
starts this simulator in the same way as `palaestra-eval`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from palaestra.api import Driver, TrainingJob
from palaestra.local import preflight
from palaestra.local.errors import RunRefused
from palaestra.local.pod_spec import read_pod
from palaestra.local.replica import mount
from palaestra.local.run_directory import job_directory, uid_of
from palaestra.local.trainer_program import run_program
from palaestra.plan import Images, LocalLayout, identified, plan
from palaestra_protocol.pod.enums import Role
from palaestra_protocol.temporary_folder import temporary_folder

PROGRAM = "palaestra-try"
# Without these variables, the program starts its own ROS master.
_OF_A_RUNNING_MASTER = ("ROS_MASTER_URI", "ROS_HOSTNAME")


@dataclass(frozen=True, slots=True, kw_only=True)
class TryOptions:
    """The options of the command line; `version` is the version of this release."""

    agent: str
    episodes: int
    json: bool
    version: str


def try_here(job: TrainingJob, options: TryOptions) -> int:
    """Play the episodes and return the exit code of the program that plays.

    Raises:
        LocalError: the job cannot be played here; the message has one line for each reason.
        PlanError: the job cannot be run on one machine.
        WorldError: a world of the job is invalid.
    """
    _refuse_own_program(job)
    with temporary_folder("palaestra-try-") as folder:
        runs = folder.path
        preflight.check(preflight.PreflightRequest(job=job, runs=runs))
        directory = job_directory(runs, job.metadata.name)
        env = _prepare(identified(job, uid_of(directory)), directory, options)
        words = ["--agent", options.agent, "--episodes", str(options.episodes)]
        command = [PROGRAM, str(directory / "0"), *words, *(["--json"] if options.json else [])]
        return run_program(command, env, reads_keys=options.agent == "keyboard")


def _prepare(job: TrainingJob, directory: Path, options: TryOptions) -> dict[str, str]:
    """Write the files of the first replica, as for a run; return the environment variables of its trainer."""
    layout = LocalLayout(images=Images.of_release(options.version), job_directory=str(directory))
    planned = plan(job, layout, replicas=[0]).replicas[0]
    template = planned.job["spec"]["template"]
    pod = read_pod(template, uid="")
    mount(pod, template["spec"]["volumes"], planned.config_map)
    simulator = next(each for each in pod.init if each.name.startswith("sim-"))
    variables = {**simulator.env, **pod.main.env}
    return {name: value for name, value in variables.items() if name not in _OF_A_RUNNING_MASTER}


def _refuse_own_program(job: TrainingJob) -> None:
    collecting = [(at, group) for at, group in enumerate(job.spec.simulators) if group.role is Role.COLLECT]
    place, group = collecting[0]
    if group.driver is Driver.COMMAND:
        raise RunRefused(
            f"spec.simulators[{place}].driver: episodes cannot be tried with command; "
            "set stub, mujoco or webots, or train a few steps with `palaestra run`"
        )
