"""A job that a program passes in, and the same job with new values in some fields."""

import copy

import pytest

import palaestra
from palaestra.api import load
from palaestra.errors import SpecErrors
from palaestra.job_input import job_of

TEXT = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata: {name: a}
spec:
  trainer:
    algorithm: {name: PPO, hyperparameters: {gamma: 0.9}}
"""
RATE = "trainer.algorithm.hyperparameters.learning_rate"


def test_a_job_is_the_same_in_every_form(tmp_path):
    """A caller may pass a path, a path as text, YAML text, plain data or a model."""
    (tmp_path / "job.yaml").write_text(TEXT)
    model = load(TEXT)
    plain = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": {"name": "a"}}
    plain["spec"] = model.model_dump(mode="json", by_alias=True, exclude_unset=True)["spec"]

    forms = [tmp_path / "job.yaml", str(tmp_path / "job.yaml"), TEXT, plain, model]

    assert [job_of(form) for form in forms] == [model] * 5


def test_fields_are_changed_by_their_path_and_the_given_job_stays():
    """In a notebook, a user can compare two jobs that differ in one field."""
    job = load(TEXT)
    before = copy.deepcopy(job)

    other = palaestra.changed(job, {RATE: 1e-3, "spec.seed": 7, "metadata.name": "b"})

    assert other.spec.trainer.algorithm.hyperparameters == {"gamma": 0.9, "learning_rate": 1e-3}
    assert (other.spec.seed, other.metadata.name) == (7, "b")
    assert job == before


def test_an_item_of_a_list_is_changed_also_if_the_list_is_a_default():
    """This job does not list its simulators, so the change applies to the default groups."""
    job = palaestra.changed(TEXT, {"simulators[0].count": 2, 'metadata.labels["a.b/c"]': "d"})

    assert [group.count for group in job.spec.simulators] == [2, 1]
    assert job.metadata.labels == {"a.b/c": "d"}


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"trainer.step": 1}, "spec.trainer.step: is not a field; did you mean steps?"),
        ({"seed": -1}, "spec.seed: -1 is less than 0; use 0 or more"),
        ({"seed.x": 1}, "spec.seed: a mapping is not a whole number; write one"),
        ({"simulators[2].count": 1}, "spec.simulators[2]: the list has 2 entries; use an index below 2"),
        ({"a..b": 1}, "'a..b': is not the path of a field; write it as in spec.trainer.steps"),
    ],
)
def test_a_mistake_is_reported_as_in_a_file(changes, problem):
    """A person gets the same message for a change in Python as for a line in a file."""
    with pytest.raises(SpecErrors) as refused:
        palaestra.changed(TEXT, changes)

    assert refused.value.problems == (problem,)


def test_a_document_that_is_no_job_is_refused_as_in_a_file():
    """A change of a document that is not a job has no meaning, so the document is checked first."""
    with pytest.raises(SpecErrors, match="the document is a list, not a mapping"):
        palaestra.changed("- a\n- b\n", {"seed": 1})
