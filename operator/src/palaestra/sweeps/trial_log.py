"""The folder of a sweep, with a copy of the Sweep and the trials that have ended.

<dir>/<sweep>/sweep.yaml        the Sweep, with its job
<dir>/<sweep>/trials.jsonl      a line for each trial that has ended
<dir>/<sweep>/optuna.journal    the state of the search, if the Sweep has `optuna`
<dir>/<sweep>/<sweep>-<n>/      on this machine: the runs of trial n, one folder a seed
<dir>/<sweep>/table.txt, curves.png     the result
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml

from palaestra.local.errors import RunRefused
from palaestra.local.files import storage, write
from palaestra.sweeps.model import Sweep
from palaestra.sweeps.trial import Point, RunFigures, TrialFigures, TrialProgress

RECORD = "sweep.yaml"
TRIALS = "trials.jsonl"
MUTABLE = {"trials"}
# In a sweep without Optuna, this field may change, because trials.jsonl has the figures of both objectives.
# A search by Optuna has used the figures of only one objective.
_COMPARING = {"objective"}


def begin(folder: Path, sweep: Sweep) -> None:
    """Write the Sweep into its folder; a Sweep that is already there must be equal.

    Only `trials` may differ, and without Optuna also `objective`.

    A crash may leave an incomplete last line in `trials.jsonl`. This line is removed, so that the next record
    begins a new line.

    Raises:
        RunRefused: the folder belongs to another sweep.
        StorageFailed: a file cannot be written.
    """
    record = sweep.model_dump(mode="json", by_alias=True, exclude_none=True)
    path = folder / RECORD
    if path.exists():
        before = yaml.safe_load(path.read_bytes())
        mutable = MUTABLE if sweep.spec.optuna else MUTABLE | _COMPARING
        if changes := [field for field in _fields(before, record) if field not in mutable]:
            named = ", ".join(f"spec.{field}" for field in changes)
            raise RunRefused(
                f"{named}: differs from the sweep whose runs are in {folder}; "
                "undo the change, give the sweep another name, or choose another folder with --dir"
            )
    write(path, yaml.safe_dump(record, sort_keys=False).encode())
    _remove_cut_line(folder / TRIALS)


def ended(folder: Path) -> Mapping[int, TrialFigures]:
    """Return the ended trials by number; if a trial has several lines, the last line counts."""
    path = folder / TRIALS
    if not path.exists():
        return {}
    *lines, _ = path.read_text().split("\n")
    return {line["trial"]: _figures(line) for line in map(json.loads, lines)}


def note(folder: Path, number: int, figures: TrialFigures) -> None:
    """Append a line about the end of a trial.

    Raises:
        StorageFailed: the file cannot be written.
    """
    line = {"trial": number, **asdict(figures)}
    with storage(folder / TRIALS), (folder / TRIALS).open("a") as file:
        file.write(json.dumps(line) + "\n")


def _remove_cut_line(path: Path) -> None:
    if path.exists():
        with storage(path), path.open("rb+") as file:
            file.truncate(file.read().rfind(b"\n") + 1)


def _fields(before: Any, now: Mapping[str, Any]) -> list[str]:
    old = before.get("spec", {}) if isinstance(before, dict) else {}
    new = now["spec"]
    return [field for field in sorted(old.keys() | new.keys()) if old.get(field) != new.get(field)]


def _figures(line: Mapping[str, Any]) -> TrialFigures:
    runs = tuple(
        RunFigures(**{**run, "curve": tuple(Point(**point) for point in run["curve"])})
        for run in line["runs"]
    )
    return TrialFigures(state=TrialProgress(line["state"]), runs=runs)
