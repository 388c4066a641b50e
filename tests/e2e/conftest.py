"""What the end-to-end tests share: the cluster, a namespace for each test, small jobs, one long run.

`make e2e` brings a cluster up, installs Palaestra in it and runs these tests; without one they are
skipped. What takes long goes on beside all other tests; those that change the operator wait for its end.
"""

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator

import pytest

from tests.e2e.askers import Asker
from tests.e2e.cluster import Cluster, Object
from tests.e2e.evictions import Evictions
from tests.e2e.jobs import make_job
from tests.e2e.long_run import LongRun
from tests.e2e.namespace import OPERATOR, SYSTEM, Namespace

CHOSEN = "PALAESTRA_E2E"  # set by whoever chose the cluster of $KUBECONFIG for tests
MONITORING = "monitoring"  # the operator's --monitoring-namespace
NAMESPACE_BYTES = 40
BEGIN_FIRST = ("long_run", "evictions", "always_interrupted")
LATE = ("comes_late", "trains", "changes_the_operator", "looks_back")


def pytest_configure(config: pytest.Config) -> None:
    """Name the marks by which tests are put in order."""
    config.addinivalue_line("markers", "comes_late: looks at the end of what takes long")
    config.addinivalue_line(
        "markers", "trains: needs two processors, so it waits for the end of what takes long"
    )
    config.addinivalue_line("markers", "changes_the_operator: comes late, so that it disturbs no other test")
    config.addinivalue_line(
        "markers", "looks_back: looks at what all other tests have left, so it comes last"
    )


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let those that look at the middle of the long run come first, those that wait or disturb last."""
    items.sort(key=_place)


def _place(item: pytest.Item) -> int:
    late = [place for place, mark in enumerate(LATE, start=1) if item.get_closest_marker(mark)]
    return max(late, default=-1 if "long_run" in getattr(item, "fixturenames", ()) else 0)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Show the namespace of a test that failed, while it is still there."""
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
        reached.rolled_out(SYSTEM, OPERATOR)
        yield reached


@pytest.fixture(scope="session", autouse=True)
def begun(request: pytest.FixtureRequest) -> None:
    """Begin what takes long before all tests, if one of them looks at it."""
    looked_at = {name for item in request.session.items for name in getattr(item, "fixturenames", ())}
    for name in BEGIN_FIRST:
        if name in looked_at:
            request.getfixturevalue(name)


@pytest.fixture(scope="session")
def long_run(cluster: Cluster) -> Iterator[LongRun]:
    """move-to-target in full, with two replicas, while its operator is killed again and again."""
    with LongRun(Namespace(cluster, _unique("move-to-target"))) as run:
        yield run


@pytest.fixture(scope="session")
def evictions(cluster: Cluster) -> Iterator[Evictions]:
    """A training whose pod is evicted five times."""
    with Evictions(Namespace(cluster, _unique("evictions"))) as run:
        yield run


@pytest.fixture(scope="session")
def always_interrupted(cluster: Cluster) -> Iterator[Namespace]:
    """A namespace with the job `always`, whose trainer does nothing but exit with 75."""
    made = Namespace(cluster, _unique("always"))
    made.apply(make_job("always", script="exit 75", backoffLimit=0))
    yield made
    made.delete()


@pytest.fixture(scope="module")
def shared(cluster: Cluster, request: pytest.FixtureRequest) -> Iterator[Namespace]:
    """A namespace for all tests of a module, whose jobs wait side by side."""
    made = Namespace(cluster, _unique(request.path.stem.removeprefix("test_")))
    yield made
    made.delete()


@pytest.fixture
def namespace(cluster: Cluster, request: pytest.FixtureRequest) -> Iterator[Namespace]:
    """A namespace of the test's own, which enforces *restricted*."""
    made = Namespace(cluster, _unique(request.node.name))
    yield made
    made.delete()


@pytest.fixture(scope="session")
def make_namespace(cluster: Cluster) -> Iterator[Callable[[str], Namespace]]:
    """Makes further namespaces, which stay until all tests have ended."""
    made = []

    def make(name: str) -> Namespace:
        made.append(Namespace(cluster, _unique(name)))
        return made[-1]

    yield make
    for each in made:
        each.delete()


@pytest.fixture(scope="session")
def monitor(cluster: Cluster) -> Iterator[Asker]:
    """A pod where metrics are gathered from; a namespace that was there before stays."""
    there = cluster.get("namespaces", None, MONITORING) is not None
    place = Namespace(cluster, MONITORING, there=there)
    name = _unique("monitor")
    yield Asker(place, name)
    cluster.delete("pods", MONITORING, name, grace_s=0)
    if not there:
        place.delete()


@pytest.fixture
def job() -> Callable[..., Object]:
    """Makes small TrainingJobs; the test says what matters."""
    return make_job


def _unique(text: str) -> str:
    plain = re.sub("[^a-z0-9]+", "-", text.removeprefix("test_").lower())[:NAMESPACE_BYTES].strip("-")
    return f"e2e-{plain}-{time.time_ns() // 1_000_000 % 0xFFFFFF:x}"
