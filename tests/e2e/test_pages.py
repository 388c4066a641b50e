"""Every command of the pages about installation and training in a cluster, on a real cluster.

tests/e2e/test_kueue.py runs docs/howto/queues.md, because its other tests need the page's queue too.
"""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
import yaml

from tests.chart.definitions import kinds_of_prometheus
from tests.chart.helm import ROOT
from tests.e2e.allowances import allow
from tests.e2e.jobs import WAIT, tiny_job
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM, Namespace
from tests.e2e.served import (
    NOTEBOOKS,
    assert_a_notebook_starts_simulators_in_pods,
    assert_notebooks_are_served_to_who_has_the_token,
    assert_the_first_notebook_drives_a_robot,
    page_of,
    token_of,
)
from tests.e2e.test_operators import KINDS, fingerprint
from tests.pages import blocks, chapters
from tests.terminal import Terminal

TYPED_S = 600  # `helm test` trains a job, and the deletion of a namespace waits for its pods
READY_S = 180
SESSION_S = 800  # long enough for a small training that is paused once
RUNS = "from urllib.request import urlopen; print(urlopen('http://127.0.0.1:6006/data/runs').read())"
INSTALL = (ROOT / "docs/howto/install.md").read_text()
FIRST = (ROOT / "docs/start/cluster.md").read_text()
PYTHON = (ROOT / "docs/howto/python.md").read_text()
SWEEPS = (ROOT / "docs/howto/sweeps.md").read_text()
LAB = "lab"  # the namespace of the runs that TensorBoard shows
NAMESPACES = (LAB, "robots", "drones")  # the page creates these, besides the operator's namespace
TENSORBOARD = "palaestra-tensorboard"
# The Deployments that exist after the commands of each chapter of install.md, with their replicas.
PROMISED = {
    "Install": {OPERATOR: 1},
    "More than one operator": {OPERATOR: 2},
    "Monitoring": {OPERATOR: 2},
    "Locked down": {OPERATOR: 2},
    "What pods may carry": {OPERATOR: 2},
    "What pods may ask for": {OPERATOR: 2},
    "TensorBoard and notebooks": {OPERATOR: 2, TENSORBOARD: 1, NOTEBOOKS: 1},
    "Simulators of notebooks in pods": {OPERATOR: 2, TENSORBOARD: 1, NOTEBOOKS: 1},
    "Upgrade": {OPERATOR: 2, TENSORBOARD: 1, NOTEBOOKS: 1},
    "Uninstall": {},
    "In some namespaces only": {},
    "For the people who train": {},
    "Without Helm": {OPERATOR: 2},
}


def checkout(folder, **environment):
    """Return a terminal in a checkout of the release, with its programs on the PATH."""
    for name in ("charts", "manifests"):
        (folder / name).symlink_to(ROOT / name)
    return Terminal(folder, path=Path(sys.executable).parent, **environment)


@pytest.fixture
def terminal(tmp_path):
    """A terminal in a checkout of the release."""
    return checkout(tmp_path)


@pytest.fixture
def untouched(cluster, terminal):
    """Prepare a cluster without Palaestra, as the page expects it, and restore everything at the end."""
    if there := [name for name in NAMESPACES if cluster.get("namespaces", None, name) is not None]:
        (pytest.skip if os.environ.get("PALAESTRA_CLUSTER") == "existing" else pytest.fail)(
            f"this cluster has the namespaces {there} already"
        )
    kinds = " ".join(kinds_of_prometheus())
    undo = (
        f"helm uninstall palaestra --namespace {SYSTEM} --ignore-not-found",
        f"kubectl delete --ignore-not-found namespace {SYSTEM} {' '.join(NAMESPACES)}",
        "kubectl delete --ignore-not-found --filename manifests/examples/platform/roles.yaml",
        f"kubectl delete --ignore-not-found {kinds}",
    )
    try:
        terminal.type_in("kubectl delete --filename manifests/install.yaml", TYPED_S)
        terminal.type_in(f"kubectl apply --server-side {kinds}", TYPED_S)
        yield
    finally:
        for each in undo:
            with suppress(subprocess.TimeoutExpired):
                terminal.try_(each, TYPED_S)
        terminal.type_in("kubectl apply --server-side --filename manifests/install.yaml", TYPED_S)
        allow(cluster)


def running(cluster):
    """Return the Deployments of the release with their ready replicas."""
    for each, namespace in deployments(cluster):
        cluster.rolled_out(namespace, each["metadata"]["name"])
    found = [each for each, _ in deployments(cluster)]
    return {each["metadata"]["name"]: each["status"].get("readyReplicas", 0) for each in found}


def deployments(cluster):
    """Return the Deployments that the page creates, with their namespaces."""
    return [(each, place) for place in (SYSTEM, LAB) for each in cluster.select("deployments", place)]


class Stays:
    """A job that runs while the operator is upgraded and removed."""

    def __init__(self, namespace):
        self._namespace = namespace
        namespace.apply(tiny_job("stays", script=WAIT))
        namespace.wait_for_pod("stays", LONG_S)
        namespace.wait(lambda: namespace.status("stays").get("phase") == "Running")
        self._before = self._seen()

    def assert_nothing_has_touched_it(self):
        """Assert that the pod and the other objects of the job are unchanged."""
        assert self._seen() == self._before
        assert self._namespace.status("stays")["phase"] == "Running"

    def _seen(self):
        return {kind: fingerprint(self._namespace, kind) for kind in KINDS}


@pytest.mark.changes_the_operator
@pytest.mark.timeout(1800)
@pytest.mark.usefixtures("untouched")
def test_every_command_of_the_installation_works_and_touches_no_job_that_runs(terminal, cluster, namespace):
    """A command that works alone may fail after the others, because a release keeps its earlier values."""
    seen, stays = {}, None
    for heading, text in chapters(INSTALL):
        commands = blocks(text, "sh")
        for block in commands:
            terminal.type_in(block, TYPED_S)
            if stays:
                stays.assert_nothing_has_touched_it()
            if heading == "Uninstall":
                stays = None  # the next command deletes all jobs
        if commands:
            seen[heading] = running(cluster)
        if heading == "Install":
            stays = Stays(namespace)
        if heading == "TensorBoard and notebooks":
            assert_all_is_served(cluster)
        if heading == "Simulators of notebooks in pods":
            assert_a_notebook_starts_simulators_in_pods(cluster)

    assert seen == PROMISED


def assert_all_is_served(cluster):
    """Assert that TensorBoard and the notebooks, as installed by the page, respond."""
    assert "TensorBoard" in page_of(cluster, LAB, TENSORBOARD, 6006)
    assert_a_run_is_shown_by_the_name_of_its_job(Namespace(cluster, LAB, there=True))
    assert_notebooks_are_served_to_who_has_the_token(cluster, token_of(cluster, "notebooks"))
    assert_the_first_notebook_drives_a_robot(cluster)


def assert_a_run_is_shown_by_the_name_of_its_job(lab):
    """Assert that TensorBoard shows the run of a job with the page's `storage` by its documented name."""
    specs = [yaml.safe_load(block).get("spec", {}) for block in blocks(INSTALL, "yaml")]
    [storage] = [spec["storage"] for spec in specs if "storage" in spec]
    uid = lab.apply(tiny_job("shown", storage=storage))["metadata"]["uid"]
    assert lab.wait_for_end("shown", LONG_S) == "Succeeded"

    name, where = f"shown-{uid[:8]}/0", ("--namespace", LAB, f"deploy/{TENSORBOARD}")
    lab.wait(lambda: name in lab.cluster.kubectl("exec", *where, "--", "python3", "-c", RUNS))


def at_home(namespace, folder):
    """Wait for the operator, and return a terminal whose kubeconfig selects the namespace."""
    namespace.cluster.rolled_out(SYSTEM, OPERATOR)
    Terminal(folder).type_in("kubectl config view --raw --flatten >config", READY_S)
    home = checkout(folder, KUBECONFIG=str(folder / "config"))
    home.type_in(f"kubectl config set-context --current --namespace={namespace.name}", READY_S)
    return home


@pytest.mark.beside
@pytest.mark.comes_late  # after the long run, which kills the operator repeatedly
@pytest.mark.timeout(900)
def test_every_command_of_the_first_job_works(namespace, tmp_path):
    """A reader starts with an empty namespace, fetches a policy, and deletes the job at the end."""
    [session] = blocks(FIRST, "sh")

    printed = at_home(namespace, tmp_path).type_in(session, SESSION_S)

    assert (tmp_path / "fetched/minimal/0/model.zip").is_file()
    assert "suspension 1" in printed
    assert namespace.select("trainingjobs") == []


@pytest.mark.beside
@pytest.mark.comes_late  # after the long run, which kills the operator repeatedly
@pytest.mark.timeout(900)
def test_the_script_of_the_page_about_python_trains(namespace, tmp_path):
    """A reader copies the script and runs it with the example job, without a change."""
    [script] = blocks(PYTHON, "python with-a-cluster")
    (tmp_path / "train.py").write_text(script)

    printed = at_home(namespace, tmp_path).type_in("python train.py", SESSION_S)

    assert "Succeeded 2000 " in printed
    assert namespace.select("trainingjobs") == []


@pytest.mark.beside
@pytest.mark.comes_late  # after the long run, which kills the operator repeatedly
@pytest.mark.timeout(900)
def test_the_sweep_of_the_page_trains_in_the_cluster(namespace, tmp_path):
    """The sweep compares two trials with two seeds each.

    The page's commands list the jobs and delete them.
    """
    [sweep] = blocks(SWEEPS, "yaml sweep")
    (tmp_path / "sweep.yaml").write_text(sweep)
    home = at_home(namespace, tmp_path)

    printed = "".join(home.type_in(block, SESSION_S) for block in blocks(SWEEPS, "sh"))

    assert "best: rates-" in printed
    assert (tmp_path / "runs/rates/table.txt").is_file()
    namespace.wait(lambda: namespace.select("trainingjobs") == [])
