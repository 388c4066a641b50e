"""`palaestra run`: a TrainingJob file becomes a trained policy on this machine.

No process is started and no file is written before every check has passed. Replicas run one after another,
because each needs a whole small machine. `--replica` selects one, so that two terminals can run two replicas
at the same time.
"""

import asyncio
import sys
from dataclasses import dataclass
from pathlib import Path

from palaestra.api import TrainingJob
from palaestra.local import preflight, run_directory
from palaestra.local.errors import KILLED, RunRefused
from palaestra.local.outcome import RunOutcome, summary
from palaestra.local.output import say
from palaestra.local.pod_spec import read_pod
from palaestra.local.ports import HeldPorts
from palaestra.local.replica import DEADLINE_EXCEEDED, Setting, meaning, run_replica
from palaestra.plan import Images, LocalLayout, Ports, ReplicaPlan, identified, plan
from palaestra.plan.replica import TRAINER
from palaestra_protocol.pod.status import ExitCode

SHOWN_LINES = 5  # of the trainer's log, if the trainer failed without a termination message


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """The options of the command line.

    `lock` is the descriptor of the run directory's lock, which the parent process has already taken for this
    process; None: not taken.
    """

    runs: Path
    version: str
    replica: int | None = None
    fresh: bool = False
    verbose: bool = False
    ros_port: int | None = None
    lock: int | None = None


def run(job: TrainingJob, options: RunOptions) -> int:
    """Run a job's replicas and return 0, or the exit code of the first unfinished replica.

    Raises:
        LocalError: it cannot be run here; the message has one line for each reason.
        PlanError: it cannot be run on one machine.
        WorldError: one of its worlds is wrong.
    """
    directory = run_directory.job_directory(options.runs, job.metadata.name)
    job = identified(job, run_directory.uid_of(directory))
    chosen = _chosen(job, options.replica)
    check(job, directory, chosen, options)
    outcomes = []
    for replica in chosen:
        outcomes.append(_run_one(job, directory / str(replica), replica, options))
        if outcomes[-1].interrupted or outcomes[-1].exit_code == ExitCode.INTERRUPTED:
            break
    return next((outcome.exit_code for outcome in outcomes if not outcome.finished), 0)


def check(job: TrainingJob, directory: Path, chosen: range, options: RunOptions) -> None:
    """Run all checks that do not write files; raises the same errors as `run`."""
    planned = plan(job, layout(directory, options, Ports()), replicas=chosen)
    for replica in planned.replicas.values():
        read_pod(replica.job["spec"]["template"], uid="")
    preflight.check(preflight.PreflightRequest(job=job, runs=options.runs.absolute()))


def layout(directory: Path, options: RunOptions, ports: Ports) -> LocalLayout:
    """Return the layout of a job whose runs are in `directory`."""
    images = Images.of_release(options.version)
    return LocalLayout(images=images, job_directory=str(directory), ports=ports)


def chosen_ports(held: HeldPorts, job: TrainingJob, options: RunOptions) -> Ports:
    """Return free ports for one replica; all are chosen before the first one is used.

    Raises:
        RunRefused: the port that the person chose is in use.
    """
    simulators = sum(group.count for group in job.spec.simulators)
    return Ports(
        ros_master=held.any() if options.ros_port is None else held.this(options.ros_port),
        status=held.any(),
        control=tuple(held.any() for _ in range(simulators)),
        health=tuple(held.any() for _ in range(simulators)),
    )


def _chosen(job: TrainingJob, replica: int | None) -> range:
    if replica is None:
        return range(job.spec.replicas)
    if not 0 <= replica < job.spec.replicas:
        raise RunRefused(
            f"--replica {replica}: the job has {job.spec.replicas}; "
            f"use 0 to {job.spec.replicas - 1}, or raise spec.replicas"
        )
    return range(replica, replica + 1)


def _run_one(job: TrainingJob, path: Path, replica: int, options: RunOptions) -> RunOutcome:
    record = run_directory.record_of(job)
    with run_directory.locked(path, options.lock), HeldPorts() as held:
        ports = chosen_ports(held, job, options)
        anew = options.fresh or run_directory.is_correction(path, record)
        if anew and (aside := run_directory.set_aside(path)):
            say(f"{path}: the run that was there is now {aside}")
        run_directory.refuse_another_job(path, record)
        before = RunOutcome.of(path)
        if before is not None and before.finished and not run_directory.is_prolonged(path, record):
            say(
                f"{job.metadata.name}-{replica}: finished already; "
                "more spec.trainer.steps prolong it, --fresh starts a new run"
            )
            _tell(before, path)
            return before
        run_directory.prepare(path, record)
        planned = plan(job, layout(path.parent, options, ports), replicas=[replica]).replicas[replica]
        say(f"{planned.job['metadata']['name']}: {path} (logs in {path / 'logs'})")
        say(f"ROS_MASTER_URI=http://127.0.0.1:{ports.ros_master}")
        return _trained(planned, path, options, job.spec.active_deadline_seconds)


def _trained(planned: ReplicaPlan, path: Path, options: RunOptions, deadline_s: float | None) -> RunOutcome:
    on_terminal = sys.stdout.isatty() and not options.verbose
    setting = Setting(
        directory=path,
        show=say,
        shown=_shown(planned, options, on_terminal=on_terminal),
        terminal=sys.stdout.fileno() if on_terminal else None,
        deadline_s=deadline_s,
    )
    outcome = asyncio.run(run_replica(planned, setting))
    outcome.keep(path)
    _tell(outcome, path)
    return outcome


def _shown(planned: ReplicaPlan, options: RunOptions, *, on_terminal: bool) -> tuple[str, ...]:
    """Return the containers whose lines are shown: all, or the trainer if it cannot draw."""
    if options.verbose:
        pod = planned.job["spec"]["template"]["spec"]
        return tuple(container["name"] for container in (*pod["initContainers"], *pod["containers"]))
    return () if on_terminal else (TRAINER,)


def _tell(outcome: RunOutcome, path: Path) -> None:
    if outcome.exit_code == ExitCode.INTERRUPTED:
        place = "before it trained" if outcome.steps is None else f"at step {outcome.steps}"
        after = "there" if outcome.saved in {None, outcome.steps} else f"step {outcome.saved}"
        say(f"interrupted {place}; the same command goes on from {after}")
    elif outcome.exit_code == KILLED:
        say("killed; the same command goes on from the newest checkpoint")
    elif outcome.reason == DEADLINE_EXCEEDED:
        say(f"failed: {DEADLINE_EXCEEDED}: spec.activeDeadlineSeconds has passed; raise it to continue")
    elif not outcome.finished:
        what = "interrupted, and failed" if outcome.interrupted else "failed"
        log = path / "logs" / "trainer.log"
        last = log.read_text(errors="replace").splitlines()[-SHOWN_LINES:]
        said = outcome.reason or "\n".join(last)
        say(f"{what}: the trainer ended with {meaning(outcome.exit_code)}: {said}; more in {log}")
    for line in summary(outcome, path):
        say(line)
