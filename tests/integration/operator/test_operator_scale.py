"""One operator with many TrainingJobs plans all of them, needs little memory, and then sends no requests.

`make bench` measures a thousand jobs. The control plane has no nodes, so that the test measures only the
operator. The operator has exactly the permissions of manifests/install.yaml.
"""

import os
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import yaml

from palaestra.cluster import Api, connect
from palaestra.cluster.resources import (
    CLAIMS,
    CONFIG_MAPS,
    JOBS,
    LEASES,
    NAMESPACES,
    NETWORK_POLICIES,
    TRAINING_JOBS,
)
from tests.bench import operator as bench
from tests.bench import operator_memory, single
from tests.control_plane.plane import running
from tests.control_plane.programs import REQUIRED
from tests.integration.operator.installed import READS, asked, operator, wait_for

pytestmark = [
    pytest.mark.minutes(3),
    pytest.mark.skipif(
        os.environ.get(REQUIRED) != "1", reason=f"takes two minutes; set {REQUIRED}=1, as `.ci/run` does"
    ),
]

ROOT = Path(__file__).parents[3]
NAMESPACE = "crowd"
TRAINING_JOBS_COUNT, REPLICAS = 60, 2
PLANNED_S = 240
SETTLED_S, SETTLES_S = 10, 120
QUIET_S = 60
MOST_BYTES = 120_000_000
LABEL = "palaestra.dev/job"


@pytest.fixture(scope="module")
def crowd(tmp_path_factory):
    """Yield a separate control plane with Palaestra and many TrainingJobs, and a client."""
    with running(tmp_path_factory.mktemp("crowd")) as plane:
        installed = plane.kubectl("apply", "-f", str(ROOT / "manifests" / "install.yaml"))
        assert installed.returncode == 0, installed.stderr
        plane.await_kinds("crd/trainingjobs.palaestra.dev")
        api = connect(str(plane.kubeconfig))
        wait_for(lambda: api.serves("palaestra.dev/v1alpha1"), 30, api.version)
        api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": NAMESPACE}})
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(lambda number: create_job(api, number), range(TRAINING_JOBS_COUNT)))
        yield plane, api
        api.close()


@pytest.fixture(scope="module")
def settled(crowd, tmp_path_factory):
    """Yield an operator that has planned all jobs and is idle."""
    plane, api = crowd
    with operator(plane, tmp_path_factory.mktemp("operator") / "log") as first:
        wait_for(
            lambda: count(api, JOBS) == TRAINING_JOBS_COUNT * REPLICAS, PLANNED_S, lambda: count(api, JOBS)
        )
        wait_for(lambda: quiet(plane, SETTLED_S), SETTLES_S, lambda: asked(plane)[-5:])
        yield first


def create_job(api: Api, number: int) -> None:
    """Create the smallest TrainingJob with `REPLICAS` replicas."""
    job = yaml.safe_load((ROOT / "manifests" / "examples" / "minimal.yaml").read_text())
    job["metadata"] = {"name": f"job-{number:03d}", "namespace": NAMESPACE}
    job["spec"]["replicas"] = REPLICAS
    api.within(60).create(TRAINING_JOBS, job)


def count(api: Api, resource) -> int:
    """Return the number of objects of a kind that belong to TrainingJobs."""
    return len(api.within(60).list(resource.only_metadata(), NAMESPACE, labels=LABEL))


def quiet(plane, seconds):
    """Wait, and return whether the operator sent only watches and requests for the Lease."""
    before = len([each for each in asked(plane) if each.counts])
    time.sleep(seconds)  # the period in which no request may arrive
    return len([each for each in asked(plane) if each.counts]) == before


def test_every_job_gets_what_it_needs_exactly_once(crowd, settled):
    """The audit log of the API server must show that no object was created twice."""
    plane, api = crowd
    created = Counter((each.resource, each.name) for each in asked(plane) if each.verb == "create")
    made = Counter(resource for resource, _ in created if resource != "events")

    assert settled.process.poll() is None
    assert [count(api, kind) for kind in (JOBS, CONFIG_MAPS, CLAIMS)] == [TRAINING_JOBS_COUNT * REPLICAS] * 3
    assert count(api, NETWORK_POLICIES) == TRAINING_JOBS_COUNT
    assert {each.code for each in asked(plane) if each.verb == "create"} == {201}
    assert set(created.values()) == {1}, made


def test_every_job_says_that_it_was_accepted(crowd, settled):
    """A user sees in the status that the operator has processed the current spec."""
    _, api = crowd
    jobs = api.list(TRAINING_JOBS, NAMESPACE)
    accepted = [
        condition["status"]
        for job in jobs
        for condition in job["status"]["conditions"]
        if condition["type"] == "Accepted"
    ]

    assert settled.process.poll() is None
    assert accepted == ["True"] * TRAINING_JOBS_COUNT
    assert all(job["status"]["observedGeneration"] == job["metadata"]["generation"] for job in jobs)


def test_nothing_is_asked_in_a_minute_in_which_nothing_changes(crowd, settled):
    """An idle operator must not load the API server, so it may send only watches and Lease requests.

    The operator's metrics and the audit log must agree.
    """
    plane, _ = crowd
    told, recorded = settled.requests(), [each for each in asked(plane) if each.counts]
    time.sleep(QUIET_S)  # the period in which no request may arrive

    assert settled.requests() - told == Counter()
    assert [each for each in asked(plane) if each.counts][len(recorded) :] == []


def test_the_operator_stays_small(settled):
    """The cache holds every TrainingJob and about nine other objects for each, including pods.

    So each object must need little memory.
    """
    assert settled.rss_bytes() < MOST_BYTES


def test_one_that_follows_changes_nothing(crowd, settled, tmp_path):
    """All work is done, so the first operator ends within two seconds and the second one writes nothing.

    The second operator lists all objects at once, which takes more memory than watching their creation.
    """
    plane, api = crowd
    seconds = settled.end()
    before = len(asked(plane))

    with operator(plane, tmp_path / "log") as second:
        wait_for(lambda: leader(api) != "", 30, lambda: leader(api))
        wait_for(lambda: quiet(plane, SETTLED_S), SETTLES_S, lambda: asked(plane)[-5:])

        assert second.rss_bytes() < MOST_BYTES
    writes = [each for each in asked(plane)[before:] if each.counts and each.verb not in READS]
    assert writes == []
    assert seconds < 2


def test_the_figures_of_the_operator_can_be_measured(crowd, tmp_path):
    """The functions of `make bench` must work, so this test runs them on the existing control plane.

    At this small size, the numbers have no meaning.
    """
    plane, api = crowd
    figures = bench.figures_of_a_crowd(plane, api.within(60), tmp_path, count=2, quiet_s=1)
    with operator(plane, tmp_path / "log"):
        asked_for = single.requests_of_one_job(plane, api.within(60))
    operator_memory.create_finished(api.within(60), 1)
    at_rest = operator_memory.started(plane)

    assert figures["requests_in_silence"] == 0
    assert figures["cpu_ms_a_job"] > 0
    assert asked_for["to_the_end"]["writes"] > asked_for["to_the_pod"]["writes"] > 0
    assert at_rest["peak_mib"] >= at_rest["rss_mib"] > 0


def leader(api: Api) -> str:
    """Return the holder of the operator's Lease, or "" if the Lease has none."""
    leases = api.list(LEASES, "palaestra-system")
    return next((each["spec"].get("holderIdentity", "") for each in leases), "")
