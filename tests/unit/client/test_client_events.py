"""`concerns` accepts an event about a job or its children, and refuses an event about another job."""

import pytest

from palaestra.client.events import concerns
from tests.unit.view.jobs import running_job


def event(kind, name, uid=None):
    """Return an event whose `involvedObject` has this kind, name and uid."""
    return {"involvedObject": {"kind": kind, "name": name, "uid": uid}}


@pytest.mark.parametrize(
    ("kind", "name", "uid"),
    [
        ("TrainingJob", "job", "0d1f"),
        ("Job", "job-0", None),
        ("Pod", "job-12-x7k2p", None),
        ("ConfigMap", "job-1-0123456789", None),
        ("PersistentVolumeClaim", "job-0-0d1f", None),
    ],
)
def test_what_was_made_for_a_job_concerns_it(kind, name, uid):
    """A user who reads a job's events must see, for example, that its pod cannot be scheduled."""
    assert concerns(event(kind, name, uid), running_job())


@pytest.mark.parametrize(
    ("kind", "name", "uid"),
    [
        ("TrainingJob", "job", "of-the-one-before"),
        ("TrainingJob", "job-0", None),
        ("Pod", "job-0-1-x7k2p", None),
        ("Job", "job-0-0", None),
        ("Pod", "myjob-0-x7k2p", None),
        ("Node", "job-0", None),
    ],
)
def test_what_only_looks_like_it_does_not(kind, name, uid):
    """A TrainingJob `job-0` may exist next to a TrainingJob `job`, whose child has the name `job-0` too."""
    assert not concerns(event(kind, name, uid), running_job())
