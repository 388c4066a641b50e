"""`palaestra-train`, `palaestra-eval` and `palaestra-export`."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from palaestra_protocol.imports import import_without, without_collections

# With rich, structlog would format tracebacks, but the log has them as plain text.
import_without("rich", "structlog")

import structlog

from palaestra_protocol.numbers import whole
from palaestra_protocol.pod.status import ExitCode, Termination
from palaestra_trainer.configuration import CONFIG_VARIABLE, load
from palaestra_trainer.errors import ConfigurationError, TrainerError
from palaestra_trainer.run.termination import UNEXPECTED, end_of, write_last_word
from palaestra_trainer.run_directory import RUN_VARIABLE, RunDirectory
from palaestra_trainer.telemetry.logs import configure_logs, last_lines
from palaestra_trainer.waiting.exit import leave_after
from palaestra_trainer.waiting.signals import end_undisturbed, leaving_when_asked

log = structlog.get_logger(__name__)

EXIT_CODES = """\
exit codes:
  0   done
  2   the configuration is wrong; a retry cannot help
  75  interrupted by a signal or the loss of the ROS master; state saved; start it again to resume
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
  evaluations.jsonl, confirmations.jsonl, model.zip (the best by evaluation), training.yaml,
  hyperparameters.json and, at the end, summary.json; the termination message
  (PALAESTRA_TERMINATION_LOG); on a claim, the link
  tensorboard/<job>-<first 8 of its UID>/<replica> at its top

A run directory with a checkpoint is resumed. If the run is finished, its result is reported.
"""
EVAL = f"""\
Evaluate the model.zip of a run directory, on episodes with seeds from a stream that training did not use.

reads:
  RUN_DIR/model.zip, RUN_DIR/training.yaml, RUN_DIR/hyperparameters.json; the simulators in
  {CONFIG_VARIABLE}, or, if it is not set, local processes that load the worlds in RUN_DIR
writes:
  one JSON object to standard output
"""
EXPORT = """\
Write the best policy of a run as one file for other programs.

reads:
  RUN_DIR/model.zip, RUN_DIR/training.yaml
writes:
  the file, once it has acted as the policy on 1,000 observations: discrete actions are equal, continuous
  ones within 1e-5; its path and its largest difference as one JSON object to standard output

The extra `export` of palaestra-trainer has the libraries. Stable-Baselines3 unpickles model.zip, so export
only runs that you trust.
"""
EXPORT_EXIT_CODES = """\
exit codes:
  0   done
  2   the run directory or the file name is wrong, or a library is missing
  1   any other error, such as a policy whose file would act differently; nothing is written
"""

EVAL_EXIT_CODES = """\
exit codes:
  0   done
  2   the configuration or the run directory is wrong; a retry cannot help
  80  a simulator failed more often than its restart budget allows
  130 ended by Ctrl-C; nothing is written
  1   any other error; a retry may help
"""
LEFT_S = 10.0  # for the work of libraries at the exit of Python, such as an upload
KEYBOARD_INTERRUPT = 130  # the exit status that shells give a process ended by SIGINT


def train(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-train`; return its exit code."""
    parser = _parser("palaestra-train", TRAIN, EXIT_CODES)
    parser.add_argument("--config", type=Path, help=f"training.yaml (default: ${CONFIG_VARIABLE})")
    parser.add_argument("--run", type=Path, help=f"run directory (default: ${RUN_VARIABLE})")
    parser.add_argument(
        "--resume", action="store_true", help="only resume an existing run; never begin a new one"
    )
    chosen = parser.parse_args(arguments)
    configure_logs()
    try:
        configuration = load(chosen.config)
        directory = RunDirectory(_run_directory(chosen.run))
    except (TrainerError, OSError) as error:
        return _refuse(error)
    with leaving_when_asked():
        # The imports are here so that a wrong configuration is reported at once, not seconds later.
        with without_collections():
            from palaestra_trainer.run import attempt
            from palaestra_trainer.simulators.connect import connect_members
            from palaestra_trainer.telemetry import display

        return attempt.run(
            configuration,
            directory,
            connect_members,
            display.for_stream(sys.stderr),
            must_resume=chosen.resume,
        )


def train_and_leave() -> int:
    """Run `palaestra-train` as a program that ends soon, even if a thread of the job's code still runs."""
    code = train()
    end_undisturbed()
    return _leaving(code)


def evaluate(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-eval`; return its exit code."""
    parser = _parser("palaestra-eval", EVAL, EVAL_EXIT_CODES)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="run directory with a model.zip")
    parser.add_argument("--episodes", type=whole(1), default=100, help="number of episodes (default: 100)")
    parser.add_argument(
        "--seeds",
        default="B",
        help="name of the seed stream (default: B; A selects the model, C confirms it)",
    )
    chosen = parser.parse_args(arguments)
    configure_logs()
    try:
        _evaluate(chosen.run, chosen.episodes, chosen.seeds)
    except KeyboardInterrupt:
        log.error("ended by Ctrl-C")
        return KEYBOARD_INTERRUPT
    except (TrainerError, OSError, SystemExit) as error:  # the environment may end the program
        return _code_of_refusal(error)
    return ExitCode.DONE


def evaluate_and_leave() -> int:
    """Run `palaestra-eval` as a program that ends soon, even if a thread of the job's code still runs."""
    return _leaving(evaluate())


def export(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-export`; return its exit code."""
    parser = _parser("palaestra-export", EXPORT, EXPORT_EXIT_CODES)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="run directory with a model.zip")
    parser.add_argument("--to", choices=("onnx", "safetensors"), required=True, help="format of the file")
    parser.add_argument("--output", type=Path, metavar="FILE", help="default: RUN_DIR/policy.FORMAT")
    chosen = parser.parse_args(arguments)
    configure_logs()
    with without_collections():
        from palaestra_trainer import exporting

    try:
        written = exporting.export(chosen.run, chosen.to, chosen.output)
    except (TrainerError, OSError) as error:
        return _code_of_refusal(error)
    sys.stdout.write(json.dumps(asdict(written), default=str) + "\n")
    return ExitCode.DONE


def export_and_leave() -> int:
    """Run `palaestra-export` as a program that ends soon, even if a thread of the job's code still runs."""
    return _leaving(export())


def _leaving(code: int) -> int:
    sys.stdout.flush()
    leave_after(LEFT_S, code)
    return code


def _code_of_refusal(error: Exception | SystemExit) -> int:
    code = _refuse(error)
    return code if code in {ExitCode.CONFIGURATION, ExitCode.FAULT_BUDGET} else UNEXPECTED


def _evaluate(folder: Path, episodes: int, stream: str) -> None:
    directory = RunDirectory(folder)
    configuration = load(directory.configuration)
    in_pod = CONFIG_VARIABLE in os.environ
    if in_pod:
        configuration = configuration.model_copy(update={"simulators": load().simulators})
    with without_collections():
        from palaestra_trainer.run.evaluate import measure
        from palaestra_trainer.simulators.connect import connect_here, connect_members

    members = connect_members if in_pod else partial(connect_here, run=directory.path)
    measure(configuration, directory.model, members, episodes=episodes, stream=stream, report=_write_result)


def _write_result(result: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(result) + "\n")
    sys.stdout.flush()


def _parser(name: str, description: str, exit_codes: str) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(
        prog=name,
        description=description,
        epilog=exit_codes,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _run_directory(chosen: Path | None) -> Path:
    name = chosen or os.environ.get(RUN_VARIABLE)
    if not name:
        raise ConfigurationError(f"{RUN_VARIABLE}: is not set; set it to the run directory")
    return Path(name)


def _refuse(error: Exception | SystemExit) -> int:
    end = end_of(error)
    for line in end.message.splitlines():
        log.error(line, reason=end.reason)
    write_last_word(Termination(step=0, reason=f"{end.reason}: {end.message}", log=last_lines()))
    return int(end.code)
