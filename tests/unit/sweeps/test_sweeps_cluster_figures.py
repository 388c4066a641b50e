"""The figures of a trial in a cluster, which the sweep reads from the status of the trial's job."""

import pytest

from palaestra.api import validate
from palaestra.sweeps.cluster_backend import ClusterBackend
from palaestra.sweeps.grid import trials
from palaestra.sweeps.model import Objective
from palaestra.sweeps.trial import Point
from tests.jobs import make_job

SUCCESS, RETURN = Objective.SUCCESS_RATE, Objective.MEAN_RETURN


class Cluster:
    """The client of a namespace with one job, whose replica has the status that a test sets."""

    namespace = "default"

    def __init__(self):
        self.replica = {"index": 0, "phase": "Running"}

    def list(self, _selector):
        """Return the job."""
        status = {"phase": "Running", "observedGeneration": 1, "replicas": [self.replica]}
        return [validate(make_job("s-0", metadata={"generation": 1}, status=status))]


@pytest.fixture
def look(sweep):
    """Return a function that sets fields of the replica's status, and returns the trial's figures."""
    cluster = Cluster()
    backend = ClusterBackend(cluster, "s", None, print, look_s=0.0)
    [trial] = trials(sweep(matrix={"seed": [1]}))

    def looked(**fields):
        cluster.replica |= fields
        backend.wait()
        return backend.look(trial)

    return looked


def test_returns_of_training_episodes_are_not_an_evaluation(look) -> None:
    """A point without an evaluation would end a sweep by success: the environment would seem to report none.

    A sweep by return would compare episodes with exploration.
    """
    found = look(step=500, meanReturn=-3.0)

    assert [run.curve for run in found.runs] == [()]
    assert not found.lacks(SUCCESS)
    assert found.median(RETURN) is None


def test_each_new_evaluation_is_a_point_with_its_own_figures(look) -> None:
    """The success rate of the status may come from a confirmation, and its mean return from training."""
    look(step=1100, meanReturn=-3.0, lastEvaluation={"step": 1000, "successRate": 0.25, "meanReturn": 1.5})
    look(step=1900, meanReturn=-2.0)

    found = look(
        step=2100, successRate=0.9, lastEvaluation={"step": 2000, "successRate": 0.5, "meanReturn": 2.5}
    )

    assert found.runs[0].curve == (
        Point(step=1000, success_rate=0.25, mean_return=1.5),
        Point(step=2000, success_rate=0.5, mean_return=2.5),
    )
    assert (found.median(SUCCESS), found.median(RETURN)) == (0.9, 2.5)


def test_an_evaluation_without_success_shows_that_the_environment_reports_none(look) -> None:
    """The sweep can then end at the first evaluation, and not after hours of training."""
    found = look(step=1100, lastEvaluation={"step": 1000, "meanReturn": 1.5})

    assert found.lacks(SUCCESS)
    assert not found.lacks(RETURN)


def test_an_older_trainer_without_evaluations_still_has_its_success_rate(look) -> None:
    """The status of such a trainer has the success rate of the last evaluation, but not the step of it."""
    found = look(step=1100, successRate=0.75, meanReturn=-3.0)

    assert found.runs[0].curve == ()
    assert found.median(SUCCESS) == 0.75


def test_evaluations_that_a_resumed_run_repeats_replace_the_earlier_ones(look) -> None:
    """A run that was killed resumes from its checkpoint, and its next policies may differ."""
    for step in (1000, 2000, 3000):
        look(lastEvaluation={"step": step, "meanReturn": step / 1000})

    found = look(lastEvaluation={"step": 2000, "meanReturn": 9.0})

    assert [(point.step, point.mean_return) for point in found.runs[0].curve] == [(1000, 1.0), (2000, 9.0)]


def test_a_run_that_began_again_has_no_earlier_evaluations(look) -> None:
    """A person may give a lost run up, and its replica then trains from step 0."""
    look(lastEvaluation={"step": 1000, "meanReturn": 1.0})

    found = look(lastEvaluation=None, step=None)

    assert found.runs[0].curve == ()
