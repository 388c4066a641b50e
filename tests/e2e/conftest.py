"""What the end-to-end tests share: the cluster, a namespace for each test, small jobs, one long run.

`make e2e` brings a cluster up, installs Palaestra in it and runs these tests; without one they are
skipped. They come place by place: those that look at the middle of the long run, then most, then those of
LATE. The long run goes on beside them until its end is looked at; what mostly waits, beside its own place.
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
from tests.e2e.jobs import make_job
from tests.e2e.long_run import LongRun
from tests.e2e.namespace import Namespace, unique

CHOSEN = "PALAESTRA_E2E"  # set to confirm that the cluster of $KUBECONFIG is for tests
MONITORING = "monitoring"  # the operator's --monitoring-namespace
BEGIN_FIRST = ("long_run", "evictions", "always_interrupted")
LATE = {  # marks, in the order of their places
    "after_the_kills": "looks at what an operator must see at once",
    "comes_late": "looks at the end of what waits for minutes",
    "changes_the_cluster": "brings what acts on each Job and each pod that is made",
    "after_the_long_run": "looks at its end",
    "changes_the_operator": "takes away what all others need",
    "looks_back": "looks at what all others have left",
}


def pytest_configure(config: pytest.Config) -> None:
    """Name the marks by which tests are put in order."""
    config.addinivalue_line("markers", f"{BESIDE}: mostly waits, so it goes on beside others; see beside.py")
    for mark, why in LATE.items():
        config.addinivalue_line("markers", f"{mark}: {why}")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put them in order; of a place those come last that go on beside the others."""
    items.sort(key=lambda item: (_place(item), item.get_closest_marker(BESIDE) is not None))


def _place(item: pytest.Item) -> int:
    late = [place for place, mark in enumerate(LATE, start=1) if item.get_closest_marker(mark)]
    return max(late, default=-1 if "long_run" in getattr(item, "fixturenames", ()) else 0)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Wait for a test that has begun before its turn, instead of calling it."""
    stories = pyfuncitem.funcargs["stories"]
    assert isinstance(stories, Stories)
    return stories.end(pyfuncitem) or None


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
        allow(reached)
        yield reached


@pytest.fixture(scope="session")
def begun(request: pytest.FixtureRequest) -> dict[str, object]:
    """Begin what takes long before all tests, if one of them looks at it; return it by its fixture's name."""
    looked_at = {name for item in request.session.items for name in getattr(item, "fixturenames", ())}
    return {name: request.getfixturevalue(name) for name in BEGIN_FIRST if name in looked_at}


@pytest.fixture(scope="session")
def stories(cluster: Cluster, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stories]:
    """The tests that go on beside others."""
    with Stories(cluster, tmp_path_factory) as told:
        yield told


@pytest.fixture(autouse=True)
def in_order(begun: dict[str, object], stories: Stories, request: pytest.FixtureRequest) -> None:
    """Begin, with the first test of a place, those of the same place that go on beside it."""
    place = _place(request.node)
    if place > 0 and isinstance(run := begun.get("long_run"), LongRun):
        run.wait_for_kills()
    stories.begin([item for item in request.session.items if _place(item) == place])


@pytest.fixture(scope="session")
def long_run(cluster: Cluster) -> Iterator[LongRun]:
    """move-to-target in full and a job of two replicas, while their operator is killed again and again."""
    with LongRun(Namespace(cluster, unique("move-to-target"))) as run:
        yield run


@pytest.fixture(scope="session")
def evictions(cluster: Cluster) -> Iterator[Evictions]:
    """A training whose pod is evicted again and again."""
    with Evictions(Namespace(cluster, unique("evictions"))) as run:
        yield run


@pytest.fixture(scope="session")
def always_interrupted(cluster: Cluster) -> Iterator[Namespace]:
    """A namespace with the job `always`, whose trainer exits with 75 at the same step each time."""
    made = Namespace(cluster, unique("always"))
    word = '{"step": 7, "reason": "Interrupted: always"}'
    made.apply(make_job("always", script=f"echo '{word}' >/dev/termination-log; exit 75", backoffLimit=0))
    yield made
    made.delete()


@pytest.fixture(scope="module")
def shared(cluster: Cluster, request: pytest.FixtureRequest) -> Iterator[Namespace]:
    """A namespace for all tests of a module, whose jobs wait side by side."""
    made = Namespace(cluster, unique(request.path.stem.removeprefix("test_")))
    yield made
    made.delete()


@pytest.fixture
def namespace(cluster: Cluster, stories: Stories, request: pytest.FixtureRequest) -> Iterator[Namespace]:
    """A namespace of the test's own, which enforces *restricted*."""
    made = stories.take(request.node) or Namespace(cluster, unique(request.node.name))
    yield made
    made.delete()


@pytest.fixture(scope="session")
def make_namespace(cluster: Cluster) -> Iterator[Callable[[str], Namespace]]:
    """Makes further namespaces, which stay until all tests have ended."""
    made = []

    def make(name: str) -> Namespace:
        made.append(Namespace(cluster, unique(name)))
        return made[-1]

    yield make
    for each in made:
        each.delete()


@pytest.fixture(scope="session")
def monitor(cluster: Cluster) -> Iterator[Asker]:
    """A pod where metrics are gathered from; a namespace that was there before stays."""
    there = cluster.get("namespaces", None, MONITORING) is not None
    place = Namespace(cluster, MONITORING, there=there)
    name = unique("monitor")
    yield Asker(place, name)
    cluster.delete("pods", MONITORING, name, grace_s=0)
    if not there:
        place.delete()


@pytest.fixture
def job() -> Callable[..., Object]:
    """Makes small TrainingJobs; the test says what matters."""
    return make_job
