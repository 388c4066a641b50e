"""`palaestra sweep`: train with different values of some fields, and compare."""

import argparse
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from palaestra.cli.cluster import add_cluster, connected, say
from palaestra.cli.files import add_dir
from palaestra.cli.subcommands import Commands, command
from palaestra.client import Client
from palaestra.errors import PalaestraError, SpecErrors
from palaestra.local import run_directory
from palaestra.local.errors import KILLED
from palaestra.local.files import write
from palaestra.sweeps import grid, trial_log
from palaestra.sweeps.cluster_backend import ClusterBackend
from palaestra.sweeps.local_backend import LocalBackend
from palaestra.sweeps.model import Objective, Sweep, load
from palaestra.sweeps.runner import TrialBackend, carry_out
from palaestra.sweeps.search import InTurn, Search
from palaestra.sweeps.table import TrialRow, lines
from palaestra.sweeps.trial import TrialProgress
from palaestra_protocol.numbers import whole
from palaestra_protocol.pod.status import ExitCode
from palaestra_protocol.signals import obeyed

FAILED = 1
# Default number of trials that run at the same time in a cluster, for a Sweep with `optuna`. The number is
# small, because Optuna does not learn from running trials.
SEARCHED_AT_ONCE = 4
SWEEP = """\
Trains the job of the Sweep in FILE with different values of some fields, each with several seeds. Checks
every trial before it starts the first. Writes <dir>/<sweep>/: a run directory for each trial and seed,
trials.jsonl, table.txt and curves.png. The same command skips trials that are complete and resumes the
others. Prints a line when a trial begins, and a line with its result when it has ended.

Ctrl-C saves a checkpoint of each run and exits; a second Ctrl-C exits at once.
SIGTERM and SIGHUP act as Ctrl-C; a SIGINT or SIGHUP that was ignored at the start stays ignored.

With --cluster, each trial is a TrainingJob with the label palaestra.dev/sweep=<sweep>; if the job has a
queue, the queue decides when each trial runs. Ctrl-C ends the command, and the jobs continue; the same
command then continues the sweep. The command deletes the jobs of pruned trials.
"""
EXIT_CODES = """\
exit codes:
  0    all trials are complete or pruned
  1    a trial failed, or the cluster refused; the table or the last line gives the reason
  2    the sweep, its job, a world or this machine is not suitable; nothing was started; or the
       sweep compares success rates and the environment reports no success: the runs stop after a checkpoint
  75   interrupted after checkpoints; run the same command to resume
  130  killed by a second Ctrl-C, or with --cluster by the first; run the same command to resume
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "sweep", _sweep, SWEEP, EXIT_CODES)
    parser.add_argument("file", metavar="FILE", type=Path, help="a Sweep")
    add_dir(parser)
    parser.add_argument(
        "--at-once",
        metavar="N",
        type=whole(1),
        help="runs at the same time; default: as many as fit the processors. With --cluster: trials at the "
        f"same time; default: all, with optuna {SEARCHED_AT_ONCE}",
    )
    parser.add_argument(
        "--cluster", action="store_true", help="train in a cluster instead of on this machine"
    )
    add_cluster(parser)


def _sweep(options: argparse.Namespace) -> int:
    if options.cluster:
        return connected(_in_cluster)(options)
    if options.namespace or options.context or options.kubeconfig:
        raise PalaestraError("--cluster: is missing; add it, or remove the options that choose a cluster")
    return _on_this_machine(options)


def _on_this_machine(options: argparse.Namespace) -> int:
    sweep = _loaded(options.file)
    folder = options.dir.absolute() / sweep.metadata.name
    place = LocalBackend(folder, options.at_once)
    with _begun(sweep, place, folder) as search:
        code = 0
        try:
            with _interruptible():
                _carried_out(search, place, folder, sweep.spec.objective)
        except KeyboardInterrupt:
            code = int(ExitCode.INTERRUPTED) if place.stopped else KILLED
        shown = _shown(search, place, sweep, folder)
        return code or shown


def _carried_out(search: Search, place: LocalBackend, folder: Path, objective: Objective) -> None:
    """Run the trials; at the end, stop the runs that have not ended."""
    try:
        carry_out(search, place, folder, objective, _say)
    except KeyboardInterrupt:
        _say("interrupted; each run saves a checkpoint, and the same command resumes it")
        raise
    finally:
        place.stop()


def _in_cluster(client: Client, options: argparse.Namespace) -> int:
    sweep = _loaded(options.file)
    folder = options.dir.absolute() / sweep.metadata.name
    default = None if sweep.spec.optuna is None else SEARCHED_AT_ONCE
    place = ClusterBackend(client, sweep.metadata.name, options.at_once or default, _say)
    with _begun(sweep, place, folder) as search:
        carry_out(search, place, folder, sweep.spec.objective, _say)
        return _shown(search, place, sweep, folder)


def _loaded(file: Path) -> Sweep:
    """Return the Sweep in a file.

    Raises:
        PalaestraError: the file is invalid or cannot be read; no request was sent to a cluster.
    """
    try:
        return load(file)
    except SpecErrors as error:
        raise PalaestraError(str(error)) from error
    except OSError as error:
        raise PalaestraError(f"{error.filename}: {error.strerror}; name a readable file") from error


@contextmanager
def _begun(sweep: Sweep, place: LocalBackend | ClusterBackend, folder: Path) -> Iterator[Search]:
    """Check every trial, lock the folder and yield the search."""
    try:
        trials = grid.trials(sweep)
    except SpecErrors as error:
        raise PalaestraError(str(error)) from error
    for trial in trials:
        place.check(trial.job)
    optuna_search = None if sweep.spec.optuna is None else _extra("optuna_search", "spec.optuna")
    with run_directory.locked(folder):
        trial_log.begin(folder, sweep)
        if optuna_search is None:
            yield InTurn(trials, trial_log.ended(folder))
        else:
            yield optuna_search.OptunaSearch(sweep, folder)


def _extra(module: str, purpose: str) -> Any:
    """Return a module that needs an optional package.

    Raises:
        PalaestraError: the package is not installed.
    """
    try:
        return import_module(f"palaestra.sweeps.{module}")
    except ModuleNotFoundError as error:
        raise PalaestraError(
            f"{purpose}: needs the package {error.name}; install palaestra[sweeps] (`make setup` does)"
        ) from error


def _say(line: str) -> None:
    say([line])


@contextmanager
def _interruptible() -> Iterator[None]:
    """Handle SIGTERM and SIGHUP like Ctrl-C, but leave an ignored SIGHUP ignored, as under nohup."""
    numbers = obeyed((signal.SIGTERM, signal.SIGHUP))
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _shown(search: Search, place: TrialBackend, sweep: Sweep, folder: Path) -> int:
    """Print the table, write table and figure into the folder, and return the exit code."""
    ended, objective = trial_log.ended(folder), sweep.spec.objective
    rows = [
        TrialRow(
            name=trial.name,
            changes=trial.changes,
            figures=ended.get(trial.number) or replace(place.look(trial), state=TrialProgress.WAITING),
        )
        for trial in search.known
    ]
    table = list(lines(rows, objective))
    write(folder / "table.txt", "".join(f"{line}\n" for line in table).encode())
    say(["", *table, "", f"folder: {folder}"])
    try:
        if _extra("plot", "curves.png").draw(rows, objective, folder / "curves.png"):
            _say(f"picture: {folder / 'curves.png'}")
    except PalaestraError as error:
        sys.stderr.write(f"{error}\n")
    return FAILED if any(row.figures.state is TrialProgress.FAILED for row in rows) else 0
