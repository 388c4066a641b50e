"""`palaestra-export` writes the best policy of a run, or its recorded episodes, for other programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from palaestra_protocol.imports import import_without, without_collections

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run
from palaestra_trainer.errors import TrainerError
from palaestra_trainer.run.telemetry.logs import configure_logs

EXPORT = """\
Write the best policy of a run, or its recorded episodes, as one file for other programs.

reads:
  RUN_DIR/model.zip, RUN_DIR/training.yaml; for mcap only RUN_DIR/replays.json
writes:
  the file, or the folder or zip of a package, only if it returns the actions of the policy for 1,000
  observations: discrete actions are equal, continuous actions differ by at most 1e-5; to standard output, one
  JSON object with the path and the largest difference
  for mcap, a ROS 2 bag of the recorded episodes; the JSON object then has the number of episodes and messages

The extra `export` of palaestra-trainer has the libraries, and the extra `deploy` has those for mcap.
Stable-Baselines3 unpickles model.zip, so export only runs that you trust.
"""
EXIT_CODES = """\
exit codes:
  0   done
  2   the run directory or the file name is wrong, or a library is missing
  1   any other error, such as a policy whose file would act differently; nothing is written
"""


def export(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-export`; return its exit code."""
    options = parser("palaestra-export", EXPORT, EXIT_CODES)
    options.add_argument("run", type=Path, metavar="RUN_DIR", help="run directory with a model.zip")
    options.add_argument(
        "--to", choices=("onnx", "safetensors", "package", "mcap"), required=True, help="format"
    )
    options.add_argument(
        "--output",
        type=Path,
        metavar="FILE",
        help="default: RUN_DIR/policy.FORMAT, RUN_DIR/package or RUN_DIR/episodes.mcap; a package is one "
        "file if the name ends in .zip",
    )
    options.add_argument(
        "--evaluated",
        type=Path,
        metavar="FILE",
        help="with --to package: further results of the policy, from `palaestra-eval --in NAMES --json`",
    )
    chosen = options.parse_args(arguments)
    if chosen.evaluated is not None and chosen.to != "package":
        options.error("--evaluated: only a package has results of evaluations; use --to package")
    configure_logs()
    with without_collections():
        from palaestra_trainer import exporting

    try:
        written = (
            exporting.export_episodes(chosen.run, chosen.output)
            if chosen.to == exporting.BAG
            else exporting.export(chosen.run, chosen.to, chosen.output, chosen.evaluated)
        )
    except (TrainerError, OSError) as error:
        return refuse_without_run(error)
    sys.stdout.write(json.dumps(asdict(written), default=str) + "\n")
    return ExitCode.DONE


def export_and_leave() -> int:
    """Run `palaestra-export`, and end the process soon even if a thread of the job's code still runs."""
    return leaving(export)
