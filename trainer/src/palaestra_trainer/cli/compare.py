"""`palaestra-compare` compares the policies of two runs on the same fresh episodes."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from palaestra_protocol.imports import import_without, without_collections

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.linux import require_linux
from palaestra_protocol.numbers import whole
from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run, write_line
from palaestra_trainer.errors import TrainerError
from palaestra_trainer.run.signals import Interruption
from palaestra_trainer.run.telemetry.logs import configure_logs
from palaestra_trainer.simulators.drivers import DRIVERS

if TYPE_CHECKING:
    from palaestra_trainer.run.compare import Comparison, Rules

COMPARE = """\
Play the policies of two run directories on the same fresh episodes, in the simulator that evaluates A's
policy, until the results show that the success rates differ, or that they differ by no more than a margin.

reads:
  model.zip, training.yaml and hyperparameters.json of both run directories, and A's worlds
writes:
  a line for each batch of episodes and a sentence to standard output, or with --json one JSON object

No run uses the seeds of these episodes. The bounds are right after any number of episodes, so you may end a
comparison at any time, or continue it with more --episodes. The probability that a comparison is wrong is at
most 5 %.
"""
EXIT_CODES = """\
exit codes:
  0   one policy is better, or they differ by no more than the margin
  2   a run directory or an option is wrong, or the policies have different tasks; nothing was started
  3   undecided after all episodes
  80  a simulator failed more often than its restart budget allows
  130 ended by Ctrl-C
  1   any other error; a retry may help
"""
UNDECIDED = 3


def compare(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-compare`; return its exit code."""
    chosen = _options().parse_args(arguments)
    require_linux("palaestra-compare")
    configure_logs()
    try:
        with Interruption() as interruption:
            return _compare(chosen, interruption)
    # The environment's code may raise SystemExit.
    except (KeyboardInterrupt, TrainerError, OSError, SystemExit) as error:
        return refuse_without_run(error)


def compare_and_leave() -> int:
    """Run `palaestra-compare`, and end the process soon even if a thread of a job's code still runs."""
    return leaving(compare)


def _options() -> argparse.ArgumentParser:
    options = parser("palaestra-compare", COMPARE, EXIT_CODES)
    options.add_argument("a", type=Path, metavar="A", help="run directory with a model.zip")
    options.add_argument("b", type=Path, metavar="B", help="run directory of the other policy")
    options.add_argument(
        "--episodes", type=whole(1), default=1000, help="most episodes that each policy plays (default: 1000)"
    )
    options.add_argument(
        "--margin",
        type=_margin,
        default=0.05,
        metavar="SHARE",
        help="success rates that differ by no more than this count as equal (default: 0.05)",
    )
    options.add_argument(
        "--in", dest="driver", choices=DRIVERS, help="simulator to play in (default: the simulator of A)"
    )
    options.add_argument(
        "--seeds", default="compare", metavar="NAME", help="name of the seed stream (default: compare)"
    )
    options.add_argument("--json", action="store_true", help="print one JSON object at the end")
    return options


def _compare(chosen: argparse.Namespace, interruption: Interruption) -> int:
    with without_collections():
        from palaestra_trainer.run import compare as comparing
        from palaestra_trainer.simulators.connect import connect_here

    rules = comparing.Rules(
        episodes=chosen.episodes, margin=chosen.margin, stream=chosen.seeds, driver=chosen.driver
    )
    comparing.contestants(chosen.a, chosen.b, chosen.driver)
    if not chosen.json:
        for line in (f"A: {chosen.a}", f"B: {chosen.b}", *comparing.notes(chosen.a, chosen.b)):
            write_line(line)
    found = comparing.compare(
        chosen.a,
        chosen.b,
        lambda run: partial(connect_here, run=run),
        rules,
        partial(_report, chosen, rules),
        interruption.check,
    )
    return ExitCode.DONE if found.decided else UNDECIDED


def _report(chosen: argparse.Namespace, rules: Rules, comparison: Comparison) -> None:
    from palaestra_trainer.run import compare as comparing

    if chosen.json and comparison.ended:
        runs = {"a": str(chosen.a), "b": str(chosen.b)}
        write_line(json.dumps({**runs, **comparing.as_json(comparison, rules)}))
    elif not chosen.json:
        write_line(comparing.line_of(comparison))
        if comparison.ended:
            write_line(comparing.sentence_of(comparison, rules))


def _margin(text: str) -> float:
    """Return a margin between 0 and 1."""
    try:
        margin = float(text)
    except ValueError:
        margin = -1.0
    if not 0.0 < margin < 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number between 0 and 1, such as 0.05")
    return margin
