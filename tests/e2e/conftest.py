"""Fixtures of the end-to-end tests: the cluster, a namespace for each test, small jobs, one long run.

`make e2e` starts a cluster, installs Palaestra in it and runs these tests. Without a cluster, the tests are
skipped. They run in groups: first the tests that need the long run unfinished, then most tests, then the
groups of LATE. The long run continues meanwhile until a test waits for its end. Tests that mostly wait run at
the same time as the other tests of their group.
"""

import os
import shutil
from collections.abc import Callable, Iterator

import pytest

from tests.e2e.allowances import allow
from tests.e2e.askers import Asker
from tests.e2e.beside import BESIDE, Stories
from tests.e2e.cluster import Cluster, Object
from tests.e2e.evictions import Evictions
from tests.e2e.jobs import tiny_job
from tests.e2e.long_run import LongRun
from tests.e2e.namespace import Namespace, unique

CHOSEN = "PALAESTRA_E2E"  # set by a person who confirms that the cluster of $KUBECONFIG is for tests
MONITORING = "monitoring"  # the operator's --monitoring-namespace
BEGIN_FIRST = ("long_run", "evictions", "always_interrupted")
LATE = {  # marks, in the order of their groups
    "after_the_kills": "looks at what an operator must see at once",
    "comes_late": "looks at the end of what waits for minutes",
    "changes_the_cluster": "brings what acts on each Job and each pod that is made",
    "after_the_long_run": "looks at its end",
    "changes_the_operator": "takes away what all others need",
    "looks_back": "looks at what all others have left",
}


def pytest_configure(config: pytest.Config) -> None:
    """Register the marks that determine the order of tests."""
    config.addinivalue_line("markers", f"{BESIDE}: mostly waits, so it runs next to others; see beside.py")
    for mark, why in LATE.items():
        config.addinivalue_line("markers", f"{mark}: {why}")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort tests by group; in each group, the tests that run at the same time as others come last."""
    items.sort(key=lambda item: (_place(item), item.get_closest_marker(BESIDE) is not None))


def _place(item: pytest.Item) -> int:
    late = [place for place, mark in enumerate(LATE, start=1) if item.get_closest_marker(mark)]
    return max(late, default=-1 if "long_run" in getattr(item, "fixturenames", ()) else 0)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """If a test has started early, wait for its end instead of calling it."""
    stories = pyfuncitem.funcargs["stories"]
    assert isinstance(stories, Stories)
    return stories.end(pyfuncitem) or None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Show the namespace of a failed test while it still exists."""
    report = yield
    if report.failed and report.when != "teardown":
        for each in getattr(item, "funcargs", {}).values():
            if isinstance(place := getattr(each, "namespace", each), Namespace):
                report.sections.append((f"namespace {place.name}", place.dump()))
    return report


@pytest.fixture(scope="session")
def cluster() -> Iterator[Cluster]:
    """The cluster of $KUBECONFIG, with Palaestra installed in it."""
    if CHOSEN not in os.environ:
        pytest.skip("no cluster was chosen; `make e2e` brings one up")
    kubectl = shutil.which("kubectl")
    assert kubectl, "kubectl is not on the PATH; `make e2e` builds it"
    with Cluster(kubectl) as reached:
        allow(reached)
        yield reached


@pytest.fixture(scope="session")
def begun(request: pytest.FixtureRequest) -> dict[str, object]:
    """Start the long fixtures that any test requests, before all tests, and return them by name."""
    looked_at = {name for item in request.session.items for name in getattr(item, "fixturenames", ())}
    return {name: request.getfixturevalue(name) for name in BEGIN_FIRST if name in looked_at}


@pytest.fixture(scope="session")
def stories(cluster: Cluster, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stories]:
    """The tests that run in threads, at the same time as others."""
    with Stories(cluster, tmp_path_factory) as told:
        yield told


@pytest.fixture(autouse=True)
def in_order(begun: dict[str, object], stories: Stories, request: pytest.FixtureRequest) -> None:
    """When the first test of a group begins, start the group's tests that run in threads."""
    place = _place(request.node)
    if place > 0 and isinstance(run := begun.get("long_run"), LongRun):
        run.wait_for_kills()
    stories.begin([item for item in request.session.items if _place(item) == place])


@pytest.fixture(scope="session")
def long_run(cluster: Cluster) -> Iterator[LongRun]:
    """The full training move-to-target and a job of two replicas; their operator is killed repeatedly."""
    with LongRun(Namespace(cluster, unique("move-to-target"))) as run:
        yield run


@pytest.fixture(scope="session")
def evictions(cluster: Cluster) -> Iterator[Evictions]:
    """A training whose pod is evicted repeatedly."""
    with Evictions(Namespace(cluster, unique("evictions"))) as run:
        yield run


@pytest.fixture(scope="session")
def always_interrupted(cluster: Cluster) -> Iterator[Namespace]:
    """A namespace with the job `always`, whose trainer always exits with 75 at the same step."""
    made = Namespace(cluster, unique("always"))
    word = '{"step": 7, "reason": "Interrupted: always"}'
    made.apply(tiny_job("always", script=f"echo '{word}' >/dev/termination-log; exit 75", backoffLimit=0))
    yield made
    made.delete()


@pytest.fixture(scope="module")
def shared(cluster: Cluster, request: pytest.FixtureRequest) -> Iterator[Namespace]:
    """A namespace for all tests of a module, so that their jobs wait at the same time."""
    made = Namespace(cluster, unique(request.path.stem.removeprefix("test_")))
    yield made
    made.delete()


@pytest.fixture
def namespace(cluster: Cluster, stories: Stories, request: pytest.FixtureRequest) -> Iterator[Namespace]:
    """The namespace of the test; it enforces the *restricted* standard."""
    made = stories.take(request.node) or Namespace(cluster, unique(request.node.name))
    yield made
    made.delete()


@pytest.fixture(scope="session")
def make_namespace(cluster: Cluster) -> Iterator[Callable[[str], Namespace]]:
    """Return a function that creates namespaces; they are deleted after all tests."""
    made = []

    def make(name: str) -> Namespace:
        made.append(Namespace(cluster, unique(name)))
        return made[-1]

    yield make
    for each in made:
        each.delete()


@pytest.fixture(scope="session")
def monitor(cluster: Cluster) -> Iterator[Asker]:
    """A pod in the namespace that collects metrics; an existing namespace is not deleted."""
    there = cluster.get("namespaces", None, MONITORING) is not None
    place = Namespace(cluster, MONITORING, there=there)
    name = unique("monitor")
    yield Asker(place, name)
    cluster.delete("pods", MONITORING, name, grace_s=0)
    if not there:
        place.delete()


@pytest.fixture
def job() -> Callable[..., Object]:
    """Return the builder of small TrainingJobs; a test passes only the fields that it needs."""
    return tiny_job
