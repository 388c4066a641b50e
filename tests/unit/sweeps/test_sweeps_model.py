"""The reader of a Sweep reports each mistake in one line, with the remedy."""

import pytest
import yaml

from palaestra.errors import SpecErrors
from palaestra.sweeps.model import load
from tests.unit.sweeps.conftest import JOB

MATRIX = {"matrix": {"seed": [1, 2]}}
RANDOM = {"random": {"seed": {"low": 1, "high": 9}}, "trials": 3}


def test_the_job_is_inline_or_a_file_beside_the_sweep(sweep, tmp_path):
    """A path is relative to the sweep, so a person can move both files together."""
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))

    assert sweep(job="job.yaml", **MATRIX).spec.job == sweep(**MATRIX).spec.job == JOB


@pytest.mark.parametrize(
    ("spec", "problem"),
    [
        ({}, "spec: needs either matrix or random; give one of them"),
        ({**MATRIX, **RANDOM}, "spec: needs either matrix or random; give one of them"),
        (
            {**MATRIX, "trials": 3},
            "spec.trials: is the number of random trials; set it if random is set, and only then",
        ),
        (
            {**MATRIX, "optuna": {}},
            "spec.optuna: searches only in random; replace matrix by random, or remove optuna",
        ),
        ({"matrix": {"seed": []}}, "spec.matrix.seed: has no entry; give one or remove the line"),
        ({"matrix": {"a..b": [1]}}, "'a..b': is not the path of a field; write it as in spec.trainer.steps"),
        (
            {"matrix": {"metadata.name": ["a"]}},
            "'metadata.name': is not the path of a field; write it as in spec.",
        ),
        (
            {"random": {"seed": {"low": 3}}, "trials": 1},
            "spec.random.seed: has only one of low and high; give both",
        ),
        (
            {"random": {"seed": {}}, "trials": 1},
            "spec.random.seed: needs low and high, or choice; give one of them",
        ),
        (
            {"random": {"seed": {"low": 3, "high": 1}}, "trials": 1},
            "spec.random.seed: low is not less than high; exchange them",
        ),
        (
            {"random": {"seed": {"low": 0, "high": 1, "log": True}}, "trials": 1},
            "spec.random.seed: log needs a low above 0; raise low, or remove log",
        ),
        ({**MATRIX, "seed": "x"}, 'spec.seed: "x" is text; write a whole number without quotes'),
        ({**MATRIX, "sedes": 1}, "spec.sedes: is not a field; use job, matrix, random, trials, seed, seeds"),
        (
            {**MATRIX, "objective": "Fame"},
            'spec.objective: "Fame" is not an objective; use SuccessRate or MeanReturn',
        ),
    ],
)
def test_a_mistake_is_one_line_with_the_remedy(sweep, spec, problem):
    """The reader of a TrainingJob reports its mistakes in the same way."""
    with pytest.raises(SpecErrors) as refused:
        sweep(**spec)

    [line] = refused.value.problems
    assert line.startswith(problem)


def test_a_file_of_another_kind_is_refused(tmp_path):
    """A person most likely gives the file of the job by mistake."""
    file = tmp_path / "job.yaml"
    file.write_text(yaml.safe_dump(JOB))

    with pytest.raises(SpecErrors, match="is not a Sweep; begin it with"):
        load(file)
