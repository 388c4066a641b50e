"""A cached TrainingJob is small whatever its spec, and the operator never takes it for the whole job."""

import json

import pytest

from palaestra.api import validate
from palaestra.observe import Lacking, lacking, trimmed
from tests.jobs import make_job

COLLECT, EVALUATE = {"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}
WORLD = "x" * 180_000
ENV = [{"name": f"V{number}", "value": "x" * 4096} for number in range(32)]
MOST_CHARACTERS = 34_000
# Fields that may be large, with the size that an API server allows.
LARGE = {
    "worlds": {"simulators": [{**COLLECT, "world": {"inline": WORLD}}, EVALUATE]},
    "variables": {"trainer": {"env": ENV}},
    "variables of simulators": {"simulators": [{**COLLECT, "env": ENV}, EVALUATE]},
    "hyperparameters": {"trainer": {"algorithm": {"hyperparameters": {"x": [0] * 100_000}}}},
    "their names": {"trainer": {"algorithm": {"hyperparameters": {"x" * 100_000: 0}}}},
    "options of the environment": {"trainer": {"environment": {"options": {"x": "x" * 100_000}}}},
    "affinity": {"scheduling": {"affinity": {"x": "x" * 100_000}}},
    "annotations of pods": {"scheduling": {"podAnnotations": {f"a{n}": "x" * 1024 for n in range(32)}}},
}


def raw_job(metadata=None, **spec):
    """Return a TrainingJob as an API server holds it; keywords are fields of its spec."""
    named = {"namespace": "default", "uid": "u", **(metadata or {})}
    spec = {"replicas": 3, "suspend": True, "ttlSecondsAfterFinished": 9, **spec}
    return make_job(metadata=named, status={"phase": "Pending"}, **spec)


@pytest.mark.parametrize("spec", LARGE.values(), ids=LARGE)
def test_a_cached_job_is_small_whatever_its_author_wrote(spec):
    """The cache also holds refused jobs. A few jobs of 1.4 MB each once ended the operator for all users."""
    kept = trimmed(raw_job(**spec))

    assert len(json.dumps(kept)) < MOST_CHARACTERS
    assert lacking(kept) is not None


@pytest.mark.parametrize("spec", LARGE.values(), ids=LARGE)
def test_what_decides_is_kept_of_every_job(spec):
    """Each reconcile reads counts, deadlines and `suspend`, but only the plan needs the rest of the spec."""
    job = validate({**trimmed(raw_job(**spec)), "status": {}})

    assert (job.spec.replicas, job.spec.suspend, job.spec.ttl_seconds_after_finished) == (3, True, 9)
    assert [(group.name, group.role.value) for group in job.spec.simulators] == [
        ("collect", "Collect"),
        ("evaluate", "Evaluate"),
    ]


def test_labels_do_not_make_a_cached_job_large():
    """The CustomResourceDefinition cannot limit the size of the labels."""
    kept = trimmed(raw_job({"labels": {f"label-{number}": "x" * 63 for number in range(4000)}}))

    assert len(json.dumps(kept)) < MOST_CHARACTERS
    assert lacking(kept) is Lacking.FIELDS


def test_a_digest_stands_for_each_world():
    """In a memory dump, digest and length show whether two worlds are equal."""
    kept = trimmed(raw_job(**LARGE["worlds"]))
    text = kept["spec"]["simulators"][0]["world"]["inline"]

    assert text.startswith("sha256:")
    assert text.endswith(", 180000 characters")
    assert lacking(kept) is Lacking.TEXTS


def test_a_usual_job_is_kept_whole():
    """The operator can plan a usual job from its cache, without a request."""
    whole = raw_job(simulators=[COLLECT, EVALUATE], trainer={"steps": 5})

    assert trimmed(whole) == whole
    assert lacking(trimmed(whole)) is None


@pytest.mark.parametrize("mark", ["texts", "fields", "nonsense"])
def test_only_the_cache_says_that_a_copy_lacks_something(mark):
    """If an author could set this annotation, the operator would read the job again for ever."""
    assert lacking(trimmed(raw_job({"annotations": {"palaestra.dev/lacks": mark}}))) is None
