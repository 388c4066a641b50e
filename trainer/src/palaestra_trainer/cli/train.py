"""`palaestra-train` runs one attempt of a training run."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from palaestra_protocol.imports import import_without, without_collections

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.linux import require_linux
from palaestra_trainer.cli.program import leaving, parser, refuse
from palaestra_trainer.errors import ConfigurationError, TrainerError
from palaestra_trainer.job.configuration import CONFIG_VARIABLE, load
from palaestra_trainer.job.run_directory import RUN_VARIABLE, RunDirectory
from palaestra_trainer.run.signals import end_undisturbed, leaving_when_asked
from palaestra_trainer.run.telemetry.logs import configure_logs

EXIT_CODES = """\
exit codes:
  0   done
  2   the configuration is wrong; a retry cannot help
  75  interrupted by a signal or the loss of the ROS master; state saved; run the same command to resume
  80  a simulator failed more often than its restart budget allows
  81  diverged: a number of the environment, a loss or a weight is NaN or infinite
  82  stalled, or a simulator hung: no environment step for stallDeadlineSeconds
  1   any other error; a retry may help
"""
TRAIN = f"""\
Train a policy as training.yaml describes, in the simulators that it lists.

reads:
  the configuration ({CONFIG_VARIABLE}), the newest checkpoint of the run directory
writes:
  the run directory ({RUN_VARIABLE}): attempts.jsonl, checkpoints/, tensorboard/,
  evaluations.jsonl, confirmations.jsonl, model.zip (the policy with the best evaluation), training.yaml,
  hyperparameters.json, faults.jsonl, replays.json and, at the end, summary.json, end.json and report.html;
  the termination message
  (PALAESTRA_TERMINATION_LOG); on a claim, the link
  tensorboard/<job>-<first 8 of its UID>/<replica> at its top

A run directory with a checkpoint is resumed. If the run is finished, its result is reported.
"""


def train(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-train`; return its exit code."""
    options = parser("palaestra-train", TRAIN, EXIT_CODES)
    options.add_argument("--config", type=Path, help=f"training.yaml (default: ${CONFIG_VARIABLE})")
    options.add_argument("--run", type=Path, help=f"run directory (default: ${RUN_VARIABLE})")
    options.add_argument(
        "--resume", action="store_true", help="only resume an existing run; never begin a new one"
    )
    chosen = options.parse_args(arguments)
    require_linux("palaestra-train")
    configure_logs()
    try:
        configuration = load(chosen.config)
        directory = RunDirectory(_run_directory(chosen.run))
    except (TrainerError, OSError) as error:
        return refuse(error)
    with leaving_when_asked():
        # These imports take seconds, so they come after the check of the configuration.
        with without_collections():
            from palaestra_trainer.run import attempt
            from palaestra_trainer.simulators.connect import connect_members

        return attempt.run(configuration, directory, connect_members, must_resume=chosen.resume)


def train_and_leave() -> int:
    """Run `palaestra-train`, and end the process soon even if a thread of the job's code still runs."""
    return leaving(_undisturbed_at_the_end)


def _undisturbed_at_the_end() -> int:
    code = train()
    end_undisturbed()
    return code


def _run_directory(chosen: Path | None) -> Path:
    name = chosen or os.environ.get(RUN_VARIABLE)
    if not name:
        raise ConfigurationError(f"{RUN_VARIABLE}: is not set; set it to the run directory")
    return Path(name)
