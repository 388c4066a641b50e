"""The result of a replica's run, written to the run directory and shown to a person."""

import json
import shlex
import shutil
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self

from palaestra.local.files import storage, write
from palaestra_protocol.pod.status import SuccessInterval

FILE = "outcome.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOutcome:
    """The result of a replica's run; a value is None if it was not measured.

    `exit_code` is the exit code of the last trainer, unless the run was killed or took too long.
    `interrupted` is whether a person ended the run. `saved` is the step of the newest checkpoint. `faults` is
    the number of faults of all simulators and pods. `trained_share` is the share of the wall-clock time, 0 to
    1, in which the run did steps and learned from them.
    """

    exit_code: int
    reason: str = ""
    steps: int | None = None
    saved: int | None = None
    success_rate: float | None = None
    steps_per_second: float | None = None
    trained_share: float | None = None
    faults: int | None = None
    pods: int = 1
    interrupted: bool = False

    @property
    def finished(self) -> bool:
        """Return whether the training is complete."""
        return self.exit_code == 0

    def keep(self, run_directory: Path) -> None:
        """Write the result into the run directory.

        Raises:
            StorageFailed: the file cannot be written.
        """
        write(run_directory / FILE, json.dumps(asdict(self), indent=1).encode() + b"\n")

    @staticmethod
    def forget(run_directory: Path) -> None:
        """Remove the result of an earlier run in this directory.

        Raises:
            StorageFailed: the file cannot be removed.
        """
        path = run_directory / FILE
        with storage(path):
            path.unlink(missing_ok=True)

    @classmethod
    def of(cls, run_directory: Path) -> Self | None:
        """Return the result of the run in this directory; None if its runner has not ended, or was killed."""
        try:
            return cls(**json.loads((run_directory / FILE).read_bytes()))
        except (OSError, ValueError, TypeError):  # the file is missing, or another program wrote it
            return None


def summary(outcome: RunOutcome, run_directory: Path) -> tuple[str, ...]:
    """Return the lines that a person sees at the end of a run.

    A value that was not measured is left out; a custom program need not measure any value.
    """
    facts = {
        "success rate": _success(outcome.success_rate, run_directory),
        "steps": _shown(outcome.steps, "{:,}"),
        "steps per second": _shown(outcome.steps_per_second, "{:.0f}"),
        "trained": _shown(outcome.trained_share, "{:.0%} of the wall clock"),
        "faults": _shown(outcome.faults, "{}"),
        "run directory": str(run_directory),
    }
    return (*_lines(facts), *uses(run_directory))


def uses(run_directory: Path) -> tuple[str, ...]:
    """Return lines with commands for the results of a run.

    palaestra-eval reads only models of the built-in loop, which also writes attempts.jsonl. A custom program
    may write a model in another format, so without attempts.jsonl, palaestra-eval is not shown.
    """
    curves = run_directory / "tensorboard"
    measurable = all((run_directory / name).exists() for name in ("model.zip", "attempts.jsonl"))
    report = run_directory / "report.html"
    ways = {
        "report": str(report) if report.exists() else "",
        "see the curves": typed("tensorboard", "--logdir", curves) if curves.exists() else "",
        "try the policy": typed("palaestra-eval", run_directory) if measurable else "",
        "export it": typed("palaestra", "export", run_directory, "--to", "onnx") if measurable else "",
    }
    return _lines(ways)


def typed(program: str, *words: str | Path) -> str:
    """Return a command for a shell; each path is one word, even if it contains a space or a quote."""
    return shlex.join([_place_of(program), *map(str, words)])


def _place_of(program: str) -> str:
    """Return the path of a program of this installation, or only its name if the shell finds it."""
    beside = Path(sys.executable).with_name(program)
    if shutil.which(program) or not beside.exists():
        return program
    here = Path.cwd()
    return str(beside.relative_to(here)) if beside.is_relative_to(here) else str(beside)


def _success(rate: float | None, run_directory: Path) -> str:
    """Return the rate, with its interval if the run has finished."""
    try:
        content = json.loads((run_directory / "summary.json").read_bytes())
        interval = SuccessInterval.from_json(content["success_interval"])
    except (OSError, ValueError, KeyError, TypeError):
        return _shown(rate, "{:.0%}")
    bounds = f"95% interval {interval.low:.0%} to {interval.high:.0%}, {interval.episodes} episodes"
    return _shown(rate, f"{{:.0%}} ({bounds})")


def _lines(facts: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(f"  {name:<18}{value}" for name, value in facts.items() if value)


def _shown(value: float | None, form: str) -> str:
    return "" if value is None else form.format(value)
