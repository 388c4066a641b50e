"""`palaestra-eval` evaluates the policy of a run on fresh episodes."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from palaestra_protocol.imports import import_without, without_collections

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.linux import require_linux
from palaestra_protocol.numbers import whole
from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run, write_line
from palaestra_trainer.errors import ConfigurationError, TrainerError
from palaestra_trainer.job.configuration import CONFIG_VARIABLE, load, load_run
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.telemetry.logs import configure_logs
from palaestra_trainer.simulators.drivers import DRIVERS

EVAL = f"""\
Evaluate the model.zip of a run directory, on episodes with seeds from a stream that training did not use.

reads:
  RUN_DIR/model.zip, RUN_DIR/training.yaml, RUN_DIR/hyperparameters.json; the simulators in
  {CONFIG_VARIABLE}, or, if it is not set, local processes that load the worlds in RUN_DIR
writes:
  one JSON object to standard output; with --in, a table with a row for each simulator, all on the same
  episodes; with --in and --json, a line with a JSON object for each simulator
"""
EXIT_CODES = """\
exit codes:
  0   done
  2   the configuration or the run directory is wrong; a retry cannot help
  80  a simulator failed more often than its restart budget allows
  130 ended by Ctrl-C; nothing is written
  1   any other error; a retry may help
"""
_HEAD = f"{'simulator':<10}{'success':>8}  {'95 % interval':<14}{'return':>9}{'steps':>8}{'faults':>8}"


def evaluate(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-eval`; return its exit code."""
    options = parser("palaestra-eval", EVAL, EXIT_CODES)
    options.add_argument("run", type=Path, metavar="RUN_DIR", help="run directory with a model.zip")
    options.add_argument("--episodes", type=whole(1), default=100, help="number of episodes (default: 100)")
    options.add_argument(
        "--seeds",
        default="B",
        help="name of the seed stream (default: B; A selects the model, C confirms it)",
    )
    options.add_argument(
        "--in",
        dest="drivers",
        type=_drivers,
        metavar="NAMES",
        help=f"simulators to evaluate in, of {','.join(DRIVERS)}, in local processes (default: the run's)",
    )
    options.add_argument("--json", action="store_true", help="with --in: JSON lines in place of the table")
    chosen = options.parse_args(arguments)
    require_linux("palaestra-eval")
    if chosen.json and chosen.drivers is None:
        options.error(
            "--json: has an effect only with --in; without --in the output is always JSON; remove --json"
        )
    configure_logs()
    try:
        _evaluate(chosen)
    # The environment's code may raise SystemExit.
    except (KeyboardInterrupt, TrainerError, OSError, SystemExit) as error:
        return refuse_without_run(error)
    return ExitCode.DONE


def evaluate_and_leave() -> int:
    """Run `palaestra-eval`, and end the process soon even if a thread of the job's code still runs."""
    return leaving(evaluate)


def _evaluate(chosen: argparse.Namespace) -> None:
    directory = RunDirectory(chosen.run)
    configuration = load_run(chosen.run)
    in_pod = CONFIG_VARIABLE in os.environ
    if in_pod and chosen.drivers is not None:
        raise ConfigurationError(
            "--in: a pod evaluates in its own simulators; remove the option, or evaluate on your machine"
        )
    if in_pod:
        configuration = configuration.model_copy(update={"simulators": load().simulators})
    with without_collections():
        from palaestra_trainer.run.evaluate import in_each, measure
        from palaestra_trainer.simulators.connect import connect_here, connect_members

    wanted = {"episodes": chosen.episodes, "stream": chosen.seeds}
    members = connect_members if in_pod else partial(connect_here, run=directory.path)
    if chosen.drivers is None:
        measure(configuration, directory.model, members, **wanted, report=_write_result)
        return
    results = in_each(chosen.drivers, configuration, directory.model, members, **wanted)
    for number, result in enumerate(results):
        if chosen.json:
            _write_result(result)
        else:
            write_line(_row(result) if number else f"{_HEAD}\n{_row(result)}")


def _write_result(result: dict[str, Any]) -> None:
    write_line(json.dumps(result))


def _drivers(text: str) -> tuple[str, ...]:
    """Return the names of simulators in the value of the option --in, such as `stub,mujoco`."""
    names = tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in DRIVERS:
            raise argparse.ArgumentTypeError(f"{name!r} is not a simulator; choose from {', '.join(DRIVERS)}")
    return names


def _row(result: Mapping[str, Any]) -> str:
    """Return the row of one result of `run.evaluate.in_each`."""
    rate, interval = result["success_rate"], result["success_interval"]
    bounds = "" if interval is None else f"{interval['low']:.0%} to {interval['high']:.0%}"
    success = "unknown" if rate is None else f"{rate:.0%}"
    return (
        f"{result['simulator']:<10}{success:>8}  {bounds:<14}"
        f"{result['mean_return']:>9.2f}{result['mean_length']:>8.1f}{result['faults']:>8}"
    )
