"""The log of an operator while a namespace is deleted, with a real API server."""

from palaestra.cluster.resources import JOBS, NAMESPACES, PODS, TRAINING_JOBS
from tests.waiting import eventually

NAMES = ("one", "two")


def test_a_namespace_that_is_deleted_is_logged_once_for_each_job_and_as_no_warning(place, start):
    """A deletion of a namespace is normal, so an administrator must not see a warning for each object."""
    operator = start()
    for name in NAMES:
        place.train(name, replicas=2)
        for pod in place.pods(name, count=2):
            place.run(pod)
        place.until("Running", name)
        # The finalizer keeps the job longer than its objects, so the operator sees that they are missing.
        place.api.merge(TRAINING_JOBS, place.name, name, {"metadata": {"finalizers": ["example.com/kept"]}})

    place.api.delete(NAMESPACES, None, place.name)
    for pod in place.all(PODS):
        place.end(pod, 75)
    eventually(lambda: not place.all(PODS) and not place.all(JOBS))
    for name in NAMES:
        place.api.merge(TRAINING_JOBS, place.name, name, {"metadata": {"finalizers": None}})
    eventually(lambda: not place.all(TRAINING_JOBS))

    assert sorted(line["job"][1] for line in operator.said("namespace terminates")) == sorted(NAMES)
    assert [line for line in operator.lines() if line["level"] not in {"info", "debug"}] == []
