"""The evaluation of the policy in model.zip, and the confirmation of the same policy.

A killed attempt may leave in model.zip a policy that it evaluated after its last checkpoint. The resumed
attempt then has other policies at the same steps, and drops the lines of the killed attempt. So model.zip
itself contains the record of its evaluation, with a digest of the policy. A confirmation counts for model.zip
only if it has the same step and the same digest.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palaestra_protocol.pod.status import EvaluationStatus
from palaestra_trainer.job.run_directory import RunDirectory, drop_lines, read_lines

BEST = "evaluation.json"  # a member of model.zip
RECORD = "evaluation-record.json"  # a member of model.zip; older releases neither write nor read it
POLICY = "policy"  # field with the digest of a policy, in RECORD and in confirmations.jsonl
_DIGITS = 4  # as in `EvaluationResult.summary`


@dataclass(frozen=True, slots=True, kw_only=True)
class Best:
    """The evaluation of the policy in model.zip.

    Attributes:
        step: number of valid environment steps from which the policy had learned.
        success_rate: share of successful episodes, 0 to 1; None: the environment does not report success.
        mean_return: mean return of the evaluation's episodes.
        record: the line of the evaluation in evaluations.jsonl, with the digest of the policy as `policy`;
            empty if an older release wrote model.zip.
    """

    step: int
    success_rate: float | None
    mean_return: float
    record: Mapping[str, Any]

    @property
    def score(self) -> tuple[float, float]:
        """The rank as in `EvaluationResult.score`; the best evaluation has the highest rank."""
        return (self.success_rate or 0.0, self.mean_return)

    @property
    def policy(self) -> str | None:
        """The digest of the policy; None if an older release wrote model.zip."""
        return self.record.get(POLICY)

    @property
    def figures(self) -> dict[str, Any]:
        """The content of the member `evaluation.json`: step, success rate and mean return."""
        return {"step": self.step, "success_rate": self.success_rate, "mean_return": self.mean_return}

    def add_to(self, model: Path) -> None:
        """Add the evaluation to the zip of a model."""
        with zipfile.ZipFile(model, "a") as archive:
            archive.writestr(BEST, json.dumps(self.figures))
            archive.writestr(RECORD, json.dumps(self.record))


def best_of(directory: RunDirectory) -> Best | None:
    """Return the evaluation of model.zip; None if model.zip is missing or was not evaluated."""
    if not directory.model.exists():
        return None
    with zipfile.ZipFile(directory.model) as archive:
        members = archive.namelist()
        if BEST not in members:
            return None
        record = json.loads(archive.read(RECORD)) if RECORD in members else {}
        return Best(**json.loads(archive.read(BEST)), record=record)


def confirmation_of(directory: RunDirectory, best: Best) -> dict[str, Any] | None:
    """Return the confirmation of the policy in model.zip; None if that policy was not confirmed."""
    wanted = (best.step, best.policy)
    found = (
        line for line in read_lines(directory.confirmations) if (line["step"], line.get(POLICY)) == wanted
    )
    return next(found, None)


def measured(directory: RunDirectory) -> dict[str, Any]:
    """Return the most reliable evaluation of model.zip; empty if model.zip was never evaluated."""
    best = best_of(directory)
    if best is None:
        return {}
    return confirmation_of(directory, best) or dict(best.record) or _line_of(directory, best) or best.figures


def last_evaluation(directory: RunDirectory, step: int) -> EvaluationStatus | None:
    """Return the last evaluation up to `step`; None if the run has no such evaluation."""
    lines = (line for line in read_lines(directory.evaluations) if line["step"] <= step)
    newest = max(lines, key=lambda line: int(line["step"]), default=None)
    return None if newest is None else status_of(newest)


def last_evaluated(directory: RunDirectory, step: int) -> int:
    """Return the number of steps at the last evaluation up to `step`; 0 without an evaluation.

    The file evaluations.jsonl does not contain an interrupted evaluation, so a resumed attempt repeats it.
    """
    evaluation = last_evaluation(directory, step)
    return 0 if evaluation is None else evaluation.step


def forget_after(directory: RunDirectory, step: int) -> None:
    """Drop evaluations after the resumed `step`, and confirmations whose evaluation is not recorded."""
    drop_lines(directory.evaluations, lambda line: line["step"] > step)
    evaluated = last_evaluated(directory, step)
    drop_lines(directory.confirmations, lambda line: line["confirmed_at"] > evaluated)


def status_of(line: Mapping[str, Any]) -> EvaluationStatus:
    """Return a line of evaluations.jsonl as it is reported."""
    return EvaluationStatus(
        step=line["step"], success_rate=line["success_rate"], mean_return=line["mean_return"]
    )


def _line_of(directory: RunDirectory, best: Best) -> dict[str, Any] | None:
    """Return the line of an evaluation that has no record in model.zip.

    A line of the same step with other figures is the evaluation of another policy.
    """
    rate = None if best.success_rate is None else round(best.success_rate, _DIGITS)
    wanted = {"step": best.step, "success_rate": rate, "mean_return": round(best.mean_return, _DIGITS)}
    return next((line for line in read_lines(directory.evaluations) if line.items() >= wanted.items()), None)
