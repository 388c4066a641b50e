"""An event is about a job if it names the job or a child of it, and no other job."""

import pytest

from palaestra.client.events import concerns
from tests.unit.view.jobs import running_job


def event(kind, name, uid=None):
    """Return an event about an object."""
    return {"involvedObject": {"kind": kind, "name": name, "uid": uid}}


@pytest.mark.parametrize(
    ("kind", "name", "uid"),
    [
        ("TrainingJob", "job", "0d1f"),
        ("Job", "job-0", None),
        ("Pod", "job-12-x7k2p", None),
        ("PersistentVolumeClaim", "job-0-0d1f", None),
    ],
)
def test_what_was_made_for_a_job_concerns_it(kind, name, uid):
    """If a pod cannot be scheduled, that concerns its job."""
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
    """A job `job-0` may exist next to `job`."""
    assert not concerns(event(kind, name, uid), running_job())
