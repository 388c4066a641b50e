"""`palaestra.run`: train a TrainingJob in the background of a Python program.

The run is a separate process (`child_main`). So it does not take over signals or the terminal, and several
runs at the same time do not affect each other. All processes of the run end with this process, even if
SIGKILL ends this process.
"""

import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO, Self

from palaestra.api import TrainingJob
from palaestra.api.yaml_io import write
from palaestra.job_input import Given, data_of, job_of
from palaestra.local import run_directory
from palaestra.local.child_main import ChildRequest
from palaestra.local.errors import KILLED, RunRefused, StillRunning
from palaestra.local.files import storage
from palaestra.local.outcome import RunOutcome
from palaestra.local.process import end_descriptor
from palaestra.local.progress import ProgressReader, RunProgress
from palaestra.local.run import RunOptions, check
from palaestra.plan import identified

STOP_S = 90.0  # A pod has 60 s for its last checkpoint; the other 30 s are for the end of its processes.
# Keeps each running handle alive, so that a run continues if the program drops its handle.
_RUNNING: set["RunHandle"] = set()


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """The end of a run; a value is None if it was not measured.

    Attributes:
        exit_code: the exit code that `palaestra run` returns for this end.
        succeeded: whether the training is complete.
        reason: the reason for the end; empty if no reason was reported.
        directory: the run directory.
        policy: the path of `model.zip`, the policy with the best evaluation; None if the file does not exist.
        steps: environment steps from which the run has learned.
        success_rate: success rate of the best policy, 0 to 1; if the run is not complete, of the last
            evaluation.
        steps_per_second: environment steps per second over the whole run.
        faults: number of faults of all simulators.
    """

    exit_code: int
    succeeded: bool
    reason: str
    directory: Path
    policy: Path | None
    steps: int | None
    success_rate: float | None
    steps_per_second: float | None
    faults: int | None


class RunHandle:
    """One replica that trains in the background; at the end of a `with` block, it is stopped.

    Several threads may use one handle.

    Attributes:
        directory: the run directory.
        log: the file with the output of `palaestra run`; logs/ in the run directory has all other output.
    """

    def __init__(self, directory: Path, request: ChildRequest, control: int) -> None:
        self.directory = directory
        self.log = directory.with_name(f"{directory.name}.log")
        self._control = os.fdopen(control, "wb", buffering=0)
        self._watch = ProgressReader(directory)
        with storage(self.log), _emptied(self.log) as log, tempfile.TemporaryFile() as file:
            file.write(request.to_json())
            file.seek(0)
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "palaestra.local.child_main"],
                stdin=file,
                stdout=log,
                stderr=subprocess.STDOUT,
                pass_fds=[request.control, request.lock],
                start_new_session=True,
            )
        self._end = end_descriptor(self._process.pid)

    def __enter__(self) -> Self:
        """Return the run."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the run if it has not ended."""
        self.stop()

    @property
    def progress(self) -> RunProgress:
        """Return the newest values; after the end, return the values of the result."""
        newest = self._watch.progress()
        if not self.ended:
            return newest
        result = self._result()
        known = {
            "step": result.steps,
            "success_rate": result.success_rate,
            "steps_per_second": result.steps_per_second,
            "faults": result.faults,
        }
        measured: dict[str, Any] = {name: value for name, value in known.items() if value is not None}
        return replace(newest, phase="ended", **measured)

    @property
    def ended(self) -> bool:
        """Return whether the run has ended."""
        return self.wait(0.0)

    def fileno(self) -> int:
        """Return a descriptor that is readable once the run has ended; `wait` closes it after that end."""
        return self._end

    def wait(self, deadline_s: float) -> bool:
        """Wait at most `deadline_s`, and return whether the run has ended."""
        try:
            self._process.wait(deadline_s)
        except subprocess.TimeoutExpired:
            return False
        self._let_go()
        return True

    def result(self, deadline_s: float) -> Result:
        """Wait for the end and return the result.

        Raises:
            StillRunning: the run has not ended after `deadline_s`, and continues.
        """
        if not self.wait(deadline_s):
            raise StillRunning(
                f"{self.directory}: the run has not ended within {deadline_s:g} s; wait longer, or stop it"
            )
        return self._result()

    def interrupt(self) -> None:
        """Request a checkpoint and the end of the run, and return at once; the job can resume later."""
        if not self.ended:
            with suppress(BrokenPipeError, ValueError):  # the run has just ended
                self._control.write(b"\n")

    def stop(self, deadline_s: float = STOP_S) -> Result:
        """Save a checkpoint, end the run and return the result; after `deadline_s`, kill the run."""
        self.interrupt()
        if not self.wait(deadline_s):
            self.kill()
        return self._result()

    def kill(self) -> None:
        """Kill the run at once; the same job resumes from the newest checkpoint."""
        self._process.kill()
        self._process.wait()
        self._let_go()

    def _let_go(self) -> None:
        with suppress(KeyError):  # another thread has already called `_let_go`
            _RUNNING.remove(self)
            self._control.close()
            os.close(self._end)

    def _result(self) -> Result:
        code = self._process.returncode
        code = KILLED if code < 0 else code
        outcome = RunOutcome.of(self.directory)
        # If the exit codes differ, an earlier run wrote this outcome, and this run wrote none.
        if outcome is None or outcome.exit_code != code:
            last = self.log.read_text(errors="replace").splitlines()[-1:]
            outcome = RunOutcome(exit_code=code, reason="".join(last))
        policy = self.directory / "model.zip"
        return Result(
            exit_code=code,
            succeeded=outcome.finished,
            reason=outcome.reason,
            directory=self.directory,
            policy=policy if policy.exists() else None,
            steps=outcome.steps,
            success_rate=outcome.success_rate,
            steps_per_second=outcome.steps_per_second,
            faults=outcome.faults,
        )


def run(
    job: Given, *, runs: Path | str = "runs", replica: int | None = None, fresh: bool = False
) -> RunHandle:
    """Train a job on this machine, in the background, and return its handle.

    The run works like `palaestra run`: it resumes from its newest checkpoint, and ends at once if it is
    complete. A job with more `trainer.steps` prolongs it. When this process ends, the run saves a checkpoint
    and ends.

    Args:
        job: the job, as the path of a file, YAML text, plain data or the model.
        runs: folder of all runs; the run directory is `<runs>/<job>/<replica>`.
        replica: the number of the replica; None only if the job has one replica.
        fresh: start at step 0; an existing run is set aside.

    Raises:
        SpecErrors: the job is invalid; the error lists every problem.
        LocalError: the job cannot be run here, or another process runs it.
        PlanError: the job cannot be run on one machine.
        WorldError: a world of the job is invalid.
        OSError: the file cannot be read.
    """
    given = job_of(job)
    number = _replica(given, replica)
    directory = run_directory.job_directory(Path(runs), given.metadata.name)
    options = RunOptions(runs=Path(runs), version=version("palaestra"), replica=number, fresh=fresh)
    identified_job = identified(given, run_directory.uid_of(directory))
    check(identified_job, directory, range(number, number + 1), options)
    with run_directory.locked(directory / str(number)) as lock:
        if not fresh:
            run_directory.refuse_another_job(directory / str(number), run_directory.record_of(identified_job))
        return _started(given, directory / str(number), options, lock)


def _emptied(log: Path) -> BinaryIO:
    """Empty a log file, and open it for reading and appending, as `LimitedFile` requires."""
    log.write_bytes(b"")
    return log.open("a+b")


def _replica(job: TrainingJob, replica: int | None) -> int:
    """Return the number of the replica to run.

    Raises:
        RunRefused: the replica does not exist, or the job has several replicas and `replica` is None.
    """
    count = job.spec.replicas
    if replica is None and count > 1:
        raise RunRefused(
            f"spec.replicas: the job has {count} replicas, but a handle runs only one; "
            "choose it with replica="
        )
    number = replica or 0
    if not 0 <= number < count:
        raise RunRefused(
            f"replica={number}: the job has {count} replicas; use 0 to {count - 1}, or raise spec.replicas"
        )
    return number


def _started(job: TrainingJob, directory: Path, options: RunOptions, lock: int) -> RunHandle:
    theirs, ours = os.pipe()
    try:
        request = ChildRequest(
            job=write(data_of(job)),
            runs=str(options.runs.absolute()),
            replica=int(directory.name),
            fresh=options.fresh,
            process=os.getpid(),
            control=theirs,
            lock=lock,
        )
        started = RunHandle(directory, request, ours)
    finally:
        os.close(theirs)
    _RUNNING.add(started)
    return started
