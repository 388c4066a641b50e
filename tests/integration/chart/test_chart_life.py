"""A release of the chart on a real API server, from its installation to its removal."""

import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest
import yaml

from palaestra.cluster import connect
from palaestra.cluster.resources import DEFINITIONS, JOBS, PODS, TRAINING_JOBS
from palaestra.smoke_test import TrialFailed, attempt
from tests.chart import installation
from tests.chart.helm import CHART, NAMESPACE, HelmRefused, helm
from tests.chart.modes import MODES
from tests.integration.chart.conftest import DEFINITION
from tests.integration.operator.cluster import served
from tests.integration.operator.operators import RunningOperator
from tests.jobs import make_job
from tests.waiting import eventually


@pytest.fixture
def release(cluster, places, kubectl):  # noqa: ARG001 - the release is installed there
    """Return a function that runs Helm on a cluster without a release.

    At the end, the fixture uninstalls all releases.
    """
    kubectl("delete", "crd", DEFINITION, "--ignore-not-found")

    def run(verb, name, *options, chart=CHART, namespace=NAMESPACE, values=None):
        of = () if verb in {"test", "uninstall"} else (str(chart), "--values=-")
        chosen = yaml.safe_dump(values or {})
        flags = (f"--namespace={namespace}", *options)
        return helm(verb, name, *of, *flags, sent=chosen, KUBECONFIG=str(cluster.kubeconfig), HOME="/tmp")

    yield run
    for each in ("palaestra", "second"):
        run("uninstall", each, "--ignore-not-found")
        run("uninstall", each, "--ignore-not-found", namespace="robots")
    kubectl("delete", "crd", DEFINITION, "--ignore-not-found")


@pytest.fixture
def older(tmp_path):
    """Return the chart of a fictitious earlier release, with another definition and another version."""
    chart = tmp_path / "palaestra"
    shutil.copytree(CHART, chart)
    for name, change in {
        "crd.yaml": ("shortNames:\n    - tj\n", "shortNames:\n    - old\n"),
        "Chart.yaml": ("appVersion: ", "appVersion: 0.0.9 # was "),
    }.items():
        text = (chart / name).read_text()
        assert text.count(change[0]) == 1
        (chart / name).write_text(text.replace(*change))
    return chart


def short_names(api):
    """Return the short names of the kind TrainingJob in the definition."""
    return api.get(DEFINITIONS, None, DEFINITION)["spec"]["names"]["shortNames"]


def test_an_upgrade_brings_the_new_definition_and_touches_no_job(release, older, api):
    """Helm never upgrades files in crds/, so the chart contains the definition as a template."""
    release("install", "palaestra", chart=older)
    eventually(lambda: served(api))
    made = api.create(TRAINING_JOBS, _in("robots", make_job("runs")))
    assert short_names(api) == ["old"]

    release("upgrade", "palaestra")

    assert short_names(api) == ["tj"]
    assert api.get(TRAINING_JOBS, "robots", "runs")["metadata"]["uid"] == made["metadata"]["uid"]


def test_the_end_of_a_release_leaves_the_jobs(release, api):
    """If Helm deleted the definition, Kubernetes would delete every TrainingJob of the cluster."""
    release("install", "palaestra")
    eventually(lambda: served(api))
    api.create(TRAINING_JOBS, _in("robots", make_job("stays")))

    release("uninstall", "palaestra")

    assert api.get(TRAINING_JOBS, "robots", "stays")
    release("install", "palaestra")  # the new release adopts the definition


@pytest.mark.parametrize("values", [{}, {"watchNamespaces": ["robots"]}], ids=["cluster", "namespaced"])
def test_a_second_release_for_the_same_jobs_is_refused(release, values):
    """Two operators with the same jobs would do all work twice."""
    release("install", "palaestra", values=values)

    with pytest.raises(HelmRefused, match="invalid ownership metadata"):
        release("install", "second", values={**values, "crds": {"install": False}}, namespace="robots")


def test_a_namespaced_operator_looks_after_its_namespaces_and_asks_for_no_other(
    release, cluster, api, tmp_path
):
    """The operator runs here with the release's own permissions, which cover only these two namespaces."""
    release("install", "palaestra", values={**MODES["namespaced"], "crds": {"install": True}})
    eventually(lambda: served(api))
    account = f"system:serviceaccount:{NAMESPACE}:palaestra-operator"
    operator = RunningOperator(
        cluster.kubeconfig_of(account, "system:serviceaccounts"),
        tmp_path / "operator.log",
        f"--operator-namespace={NAMESPACE}",
        "--namespace=robots",
        "--namespace=drones",
    )
    try:
        for namespace in ("robots", "drones", "default"):
            api.create(TRAINING_JOBS, _in(namespace, make_job("trains")))
        for namespace in ("robots", "drones"):
            eventually(lambda where=namespace: api.list(JOBS, where))

        assert api.get(TRAINING_JOBS, "default", "trains")["status"]["observedGeneration"] == 0
        assert operator.said("watch broken") == []
        # The operator's metric counts a job after the operator's own writes have reached its cache.
        eventually(lambda: pending(operator.ask("/metrics")) == 2)
    finally:
        operator.kill()


def pending(metrics):
    """Return the number of pending TrainingJobs in an operator's metrics."""
    lines = [line for line in metrics.splitlines() if line.startswith("palaestra_jobs{")]
    return sum(float(line.split()[-1]) for line in lines if 'phase="Pending"' in line)


def _in(namespace, job):
    return {**job, "metadata": {**job["metadata"], "namespace": namespace}}


def test_the_trial_needs_no_more_rights_than_it_has_and_says_what_is_missing(release, cluster, api):
    """Without an operator, `helm test` must end in time, name the check to make, and leave no job."""
    release("install", "palaestra")
    eventually(lambda: served(api))
    account = f"system:serviceaccount:{NAMESPACE}:palaestra-trial"
    tester = connect(str(cluster.kubeconfig_of(account, "system:serviceaccounts")))
    told = []

    with pytest.raises(TrialFailed, match=r"no operator has reconciled it; check that the operator runs"):
        attempt(tester, _in(NAMESPACE, make_job("trial")), within_s=1.0, report=told.append)

    assert [line.rpartition(": ")[2] for line in told] == ["Pending"]
    assert api.list(TRAINING_JOBS, NAMESPACE) == []


def test_a_test_of_a_release_is_reported_once(release, kubectl, api):
    """Helm reports each hook as a test suite, so the chart has one hook.

    The control plane has no nodes, so the test itself sets the phase of the hook's pod.
    """
    release("install", "palaestra")

    with ThreadPoolExecutor() as threads:
        said = threads.submit(release, "test", "palaestra")
        eventually(lambda: [each for each in api.list(PODS, NAMESPACE) if named(each) == "palaestra-test"])
        ended = '--patch={"status": {"phase": "Succeeded"}}'
        kubectl("patch", "pod", "palaestra-test", f"--namespace={NAMESPACE}", "--subresource=status", ended)

    assert said.result().count("TEST SUITE:") == 1
    assert api.list(PODS, NAMESPACE) == []


def named(obj):
    """Return the name of an object."""
    return obj["metadata"]["name"]


def test_helm_takes_over_what_kubectl_has_installed(release, kubectl, api):
    """Helm must keep the objects that kubectl created, including the definition and all jobs."""
    kubectl("apply", "-f", str(installation.PATH))
    eventually(lambda: served(api))
    made = api.create(TRAINING_JOBS, _in("robots", make_job("before")))

    release("install", "palaestra", "--take-ownership")
    release("upgrade", "palaestra", "--set=operator.replicas=2", "--force-conflicts")

    kept = api.get(TRAINING_JOBS, "robots", "before")
    assert kept["metadata"]["uid"] == made["metadata"]["uid"]
    assert "helm.sh/resource-policy" in api.get(DEFINITIONS, None, DEFINITION)["metadata"]["annotations"]
