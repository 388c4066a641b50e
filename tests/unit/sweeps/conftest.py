"""Builders of sweeps, as users write them, and of results of trials."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from palaestra.sweeps.model import Sweep, load
from palaestra.sweeps.trial import Point, RunFigures, TrialFigures
from tests.jobs import make_job

JOB = make_job("j")


@pytest.fixture
def sweep(tmp_path: Path) -> Callable[..., Sweep]:
    """Return a builder of sweeps; its keywords are fields of the spec."""

    def make(**spec: Any) -> Sweep:
        file = tmp_path / "sweep.yaml"
        content = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "Sweep", "metadata": {"name": "s"}}
        file.write_text(yaml.safe_dump({**content, "spec": {"job": JOB, **spec}}, sort_keys=False))
        return load(file)

    return make


def figures(
    *curves: dict[int, float], ended: bool = True, succeeded: bool = True, reason: str = ""
) -> TrialFigures:
    """Return the results of a trial whose runs have these success rates by step."""
    return TrialFigures.of(
        tuple(
            RunFigures(
                curve=tuple(
                    Point(step=step, success_rate=rate, mean_return=-rate) for step, rate in curve.items()
                ),
                ended=ended,
                succeeded=succeeded,
                reason=reason,
            )
            for curve in curves
        )
    )
