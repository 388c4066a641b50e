"""`palaestra run`: train the policy of a TrainingJob file on this machine.

All checks pass before a process is started or a file is written. Replicas run one after another, because one
replica may need all of a small machine. `--replica` selects one replica, so that two terminals can run two
replicas at the same time.
"""

import asyncio
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from palaestra.api import TrainingJob
from palaestra.local import preflight, run_directory
from palaestra.local.errors import KILLED, RunRefused
from palaestra.local.outcome import RunOutcome, summary
from palaestra.local.output import Show, say
from palaestra.local.pod_spec import read_pod
from palaestra.local.ports import HeldPorts
from palaestra.local.progress import ProgressReader
from palaestra.local.progress_line import show_progress
from palaestra.local.readable_log import readable
from palaestra.local.replica import DEADLINE_EXCEEDED, Setting, meaning, run_replica, trains_by_itself
from palaestra.local.report import complete_report
from palaestra.plan import Images, LocalLayout, Ports, ReplicaPlan, identified, plan
from palaestra.plan.replica import TRAINER
from palaestra_protocol.pod.status import ExitCode

SHOWN_LINES = 5  # last lines of the log that are shown if the trainer failed without a termination message


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """The options of the command line.

    `lock` is the descriptor of the run directory's lock, if the parent process has already taken the lock for
    this process; else None.
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
        LocalError: the job cannot be run here; the message has one line for each reason.
        PlanError: the job cannot be run on one machine.
        WorldError: a world of the job is invalid.
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
    """Run all checks that do not write files; raise the same errors as `run`."""
    planned = plan(job, layout(directory, options, Ports()), replicas=chosen)
    for replica in planned.replicas.values():
        read_pod(replica.job["spec"]["template"], uid="")
    preflight.check(preflight.PreflightRequest(job=job, runs=options.runs.absolute()))


def layout(directory: Path, options: RunOptions, ports: Ports) -> LocalLayout:
    """Return the layout of a job whose runs are in `directory`."""
    images = Images.of_release(options.version)
    return LocalLayout(images=images, job_directory=str(directory), ports=ports)


def chosen_ports(held: HeldPorts, job: TrainingJob, options: RunOptions) -> Ports:
    """Return free ports for one replica; all ports are chosen before the first port is used.

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
            f"--replica {replica}: the job has {job.spec.replicas} replicas; "
            f"use 0 to {job.spec.replicas - 1}, or raise spec.replicas"
        )
    return range(replica, replica + 1)


def _run_one(job: TrainingJob, path: Path, replica: int, options: RunOptions) -> RunOutcome:
    record = run_directory.record_of(job)
    with run_directory.locked(path, options.lock), HeldPorts() as held:
        ports = chosen_ports(held, job, options)
        anew = options.fresh or run_directory.is_correction(path, record)
        if anew and (aside := run_directory.set_aside(path)):
            say(f"{path}: the earlier run was moved to {aside}")
        run_directory.refuse_another_job(path, record)
        before = RunOutcome.of(path)
        if before is not None and before.finished and not run_directory.is_prolonged(path, record):
            say(
                f"{job.metadata.name}-{replica}: has already finished; "
                "to prolong it, raise spec.trainer.steps; to start a new run, add --fresh"
            )
            _tell(before, path, built_in=True)
            return before
        run_directory.prepare(path, record)
        planned = plan(job, layout(path.parent, options, ports), replicas=[replica]).replicas[replica]
        say(f"{planned.job['metadata']['name']}: {path} (logs in {path / 'logs'})")
        say(f"ROS_MASTER_URI=http://127.0.0.1:{ports.ros_master}")
        return _trained(planned, path, options, job.spec.active_deadline_seconds)


def _trained(planned: ReplicaPlan, path: Path, options: RunOptions, deadline_s: float | None) -> RunOutcome:
    built_in = trains_by_itself(planned)
    draws = sys.stdout.isatty() and not options.verbose and not built_in
    setting = Setting(
        directory=path,
        show=say,
        shown={} if draws else _shown(planned, verbose=options.verbose, built_in=built_in),
        terminal=sys.stdout.fileno() if draws else None,
        deadline_s=deadline_s,
    )
    reader = ProgressReader(path) if built_in and not options.verbose else None
    outcome = asyncio.run(_run(planned, setting, reader))
    outcome.keep(path)
    complete_report(path)
    _tell(outcome, path, built_in=built_in)
    return outcome


async def _run(planned: ReplicaPlan, setting: Setting, reader: ProgressReader | None) -> RunOutcome:
    """Run the replica; if a reader is given, show the progress meanwhile."""
    if reader is None:
        return await run_replica(planned, setting)
    showing = asyncio.create_task(show_progress(reader, say))
    try:
        return await run_replica(planned, setting)
    finally:
        showing.cancel()


def _shown(planned: ReplicaPlan, *, verbose: bool, built_in: bool) -> dict[str, Show]:
    """Return the functions that show lines of output, for all containers or for the trainer only."""
    if not verbose and built_in:
        return {TRAINER: _say_readable}
    pod = planned.job["spec"]["template"]["spec"]
    names = [container["name"] for container in (*pod["initContainers"], *pod["containers"])]
    return {name: partial(_say_of, name) for name in names if verbose or name == TRAINER}


def _say_of(container: str, line: str) -> None:
    say(f"[{container}] {line}")


def _say_readable(line: str) -> None:
    if (text := readable(line)) is not None:
        say(text)


def _tell(outcome: RunOutcome, path: Path, *, built_in: bool) -> None:
    if outcome.exit_code in {ExitCode.INTERRUPTED, KILLED} and not built_in:
        ended = "killed" if outcome.exit_code == KILLED else "interrupted"
        say(f"{ended}; the same command starts the job's program again")
    elif outcome.exit_code == ExitCode.INTERRUPTED:
        place = "before it trained" if outcome.steps is None else f"at step {outcome.steps}"
        after = "there" if outcome.saved in {None, outcome.steps} else f"step {outcome.saved}"
        say(f"interrupted {place}; the same command continues from {after}")
    elif outcome.exit_code == KILLED:
        say("killed; the same command continues from the newest checkpoint")
    elif outcome.reason == DEADLINE_EXCEEDED:
        say(f"failed: {DEADLINE_EXCEEDED}: spec.activeDeadlineSeconds has passed; raise it to continue")
    elif not outcome.finished:
        what = "interrupted, and failed" if outcome.interrupted else "failed"
        log = path / "logs" / "trainer.log"
        last = log.read_text(errors="replace").splitlines()[-SHOWN_LINES:]
        said = outcome.reason or "\n".join(last)
        say(f"{what}: the trainer ended with {meaning(outcome.exit_code)}: {said}; the whole log is {log}")
    for line in summary(outcome, path):
        say(line)
