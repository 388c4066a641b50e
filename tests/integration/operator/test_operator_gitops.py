"""GitOps tools evaluate a job by the rules of kstatus; Helm 4 waits by these rules, as Flux does.

The tests run the commands of docs/howto/gitops.md.
"""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import yaml

from palaestra.cluster.resources import CONFIG_MAPS, TRAINING_JOBS
from tests.control_plane.programs import programs
from tests.integration.operator.cluster import world_map, world_of
from tests.pages import blocks
from tests.terminal import Terminal
from tests.waiting import DEADLINE_S, eventually

PAGE = (Path(__file__).parents[3] / "docs/howto/gitops.md").read_text()
[TYPED] = blocks(PAGE, "sh")
UPGRADE = TYPED.splitlines()[-1]
TYPED_S = 60


@pytest.fixture
def type_in(control_plane, place, tmp_path):
    """Return a function that runs commands and returns exit code and output.

    The current namespace of the commands is the test's.
    """
    where = {"KUBECONFIG": str(control_plane.kubeconfig), "HELM_NAMESPACE": place.name}
    terminal = Terminal(tmp_path, path=programs(("helm",)), **where)
    return lambda text: terminal.try_(text, TYPED_S)


@pytest.fixture
def values(tmp_path, type_in):
    """Return `values(spec, suspend=True)`, which writes the page's chart with these values."""
    type_in(TYPED.rpartition("helm upgrade")[0])

    def write(spec, **changeable):
        content = yaml.safe_dump({"job": spec, "changeable": changeable})
        (tmp_path / "corridor" / "values.yaml").write_text(content)

    return write


def only_job(place):
    """Wait for the only TrainingJob of a namespace, and return its name."""
    [job] = eventually(lambda: place.all(TRAINING_JOBS))
    return job["metadata"]["name"]


def test_helm_waits_until_the_job_trains(place, start, type_in):
    """A reader runs the page's commands unchanged, and the test starts the pod as a kubelet does."""
    start()
    with ThreadPoolExecutor(1) as threads:
        typed = threads.submit(type_in, TYPED)
        name = only_job(place)
        [pod] = place.pods(name)

        assert not typed.done()

        place.run(pod)
        code, output = typed.result(DEADLINE_S)

    assert (code, place.status(name)["phase"]) == (0, "Running"), output
    assert name.startswith("corridor-")


def test_helm_fails_at_once_for_a_job_that_lacks_its_world(place, start, type_in, values):
    """If Helm did not fail, it would report the release as deployed, although the job cannot start."""
    start()
    values(world_of("nowhere"))

    code, output = type_in(UPGRADE)

    assert code == 1
    assert "status: Failed" in output
    assert "ConfigMap nowhere does not exist in this namespace; create it with the label" in output

    place.create(CONFIG_MAPS, {**world_map(), "metadata": {**world_map()["metadata"], "name": "nowhere"}})
    place.run(place.pods(only_job(place))[0])
    place.until("Running", only_job(place))

    assert type_in(UPGRADE)[0] == 0


def test_helm_waits_for_a_job_that_no_operator_has_seen(type_in, values):
    """If Helm did not wait, every release would succeed in a cluster without an operator."""
    values({"trainer": {"steps": 100}})

    code, output = type_in(UPGRADE.replace("15m", "3s"))

    assert code == 1
    assert (
        "status: InProgress, message: TrainingJob generation is 1, but latest observed generation is 0"
        in output
    )


def test_helm_replaces_a_job_whose_spec_changed_and_keeps_one_that_is_resumed(place, start, type_in, values):
    """The spec is immutable, so the chart adds a hash of it to the job's name.

    The hash excludes the mutable fields, so that a change of them keeps the job.
    """
    start()
    values({"trainer": {"steps": 100}}, suspend=True)
    assert type_in(UPGRADE)[0] == 0
    first = only_job(place)

    values({"trainer": {"steps": 200}}, suspend=True)
    code, output = type_in(UPGRADE)

    assert code == 0, output
    eventually(lambda: len(place.all(TRAINING_JOBS)) == 1)
    second = only_job(place)
    assert second != first
    assert place.status(second)["phase"] == "Suspended"

    values({"trainer": {"steps": 200}}, suspend=False)
    with ThreadPoolExecutor(1) as threads:
        typed = threads.submit(type_in, UPGRADE)
        place.run(place.pods(second)[0])
        code, output = typed.result(DEADLINE_S)

    assert (code, place.status(second)["phase"]) == (0, "Running"), output
    assert only_job(place) == second
