"""The Python client against a real API server; the tests write the operator's statuses."""

import json
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from palaestra.api import validate
from palaestra.client import EndedOtherwise, NoPod, NoSuchJob, QueueDecides, TookTooLong
from palaestra.cluster import Invalid
from palaestra.cluster.resources import CONFIG_MAPS, TRAINING_JOBS
from palaestra.errors import SpecErrors
from palaestra_sim.world import builtin
from tests.jobs import make_job
from tests.waiting import eventually

SOON_S = 30.0


@pytest.fixture
def later():
    """Return a function that calls another function in a thread and returns the future result."""
    with ThreadPoolExecutor(2) as pool:
        yield pool.submit


def test_what_is_applied_is_stored_in_the_clients_namespace(client, place):
    """A job that a Python program applies must be stored like a job that kubectl applies."""
    stored = client.apply(make_job("a", seed=7))

    assert stored.spec.seed == 7
    assert place.get(TRAINING_JOBS, "a")["metadata"]["uid"] == stored.metadata.uid


def test_a_file_and_a_model_are_applied_alike(client, tmp_path):
    """The API server sets the same defaults for both, so the second call changes nothing."""
    file = tmp_path / "job.yaml"
    file.write_text("apiVersion: palaestra.dev/v1alpha1\nkind: TrainingJob\nmetadata: {name: a}\nspec: {}\n")
    from_file = client.apply(file)

    from_model = client.apply(validate(make_job("a")))

    assert from_model.metadata.uid == from_file.metadata.uid
    assert from_model.metadata.generation == 1


def test_a_job_whose_name_the_api_server_made_is_listed_and_followed(client, place, tell):
    """`kubectl create` generates such a name from generateName.

    An error about one such job must not hide the other jobs of the namespace.
    """
    place.train("a")
    made = place.create(TRAINING_JOBS, {**make_job(), "metadata": {"generateName": "try-"}})
    name = made["metadata"]["name"]

    tell(name, "Succeeded")

    assert {each.metadata.name for each in client.list()} == {"a", name}
    assert [each.phase for each in client.statuses(name, deadline_s=SOON_S)] == ["Succeeded"]


def test_inline_worlds_of_more_than_256_kib_are_applied_by_the_server_only(
    client, control_plane, place, tmp_path
):
    """A plain `kubectl apply` copies the file into an annotation, which has a limit of 256 KiB."""
    world = builtin("arena").decode() + "# a comment\n" * 12_000
    groups = [
        {"name": name, "role": role, "world": {"inline": world}}
        for name, role in (("collect", "Collect"), ("evaluate", "Evaluate"))
    ]
    job = make_job("large", simulators=groups)
    file = tmp_path / "job.json"
    file.write_text(json.dumps(job))
    apply = ("-n", place.name, "apply", "-f", str(file))

    refused = control_plane.kubectl(*apply)
    stored = client.apply(job)

    assert "metadata.annotations: Too long" in refused.stderr
    assert client.apply(job).metadata.generation == stored.metadata.generation == 1
    assert control_plane.kubectl(*apply, "--server-side", "--force-conflicts").returncode == 0


def test_a_wrong_job_is_refused_before_anything_is_sent(client):
    """The error lists every mistake, as `palaestra run` does."""
    with pytest.raises(SpecErrors) as refused:
        client.apply(make_job("a", seed=-1, replica=2))

    assert len(refused.value.problems) == 2
    assert client.list() == ()


def test_what_a_job_is_fixed_on_cannot_be_applied_anew(client):
    """The API server's message names the field, which the user must put back."""
    client.apply(make_job("a", seed=1))

    with pytest.raises(Invalid, match="seed"):
        client.apply(make_job("a", seed=2))


def test_the_error_for_a_missing_job_shows_how_to_find_it(client):
    """The usual cause is a wrong namespace, so the error names a command that searches all namespaces."""
    for ask in (client.get, client.suspend, client.delete, client.events):
        with pytest.raises(
            NoSuchJob, match=f"job none: does not exist in namespace {client.namespace}; .* -A"
        ):
            ask("none")
    with pytest.raises(NoSuchJob):
        client.wait("none", deadline_s=SOON_S)


def test_a_wait_ends_with_the_job(client, tell, later):
    """By default, a wait ends with a success as well as with a failure."""
    client.apply(make_job("a"))
    waited = later(client.wait, "a", deadline_s=SOON_S)

    tell("a", "Running")
    tell("a", "Failed")

    assert waited.result(SOON_S).status.phase == "Failed"


def test_a_job_that_ended_otherwise_is_not_waited_for_any_longer(client, tell):
    """The user would ask for the reason next, so the error contains it."""
    client.apply(make_job("a"))
    tell("a", "Failed")

    with pytest.raises(EndedOtherwise, match="job a: is Failed, not Succeeded: Because: so it is"):
        client.wait("a", until="Succeeded", deadline_s=SOON_S)


def test_a_wait_has_a_deadline(client):
    """No operator works on this job, and the caller must not wait forever."""
    client.apply(make_job("a"))
    began = time.monotonic()

    with pytest.raises(TookTooLong, match="TrainingJob a"):
        client.wait("a", deadline_s=1.0)
    assert 1.0 <= time.monotonic() - began < SOON_S


def test_a_job_that_is_deleted_is_not_waited_for(client, later):
    """A deleted job never ends, so the wait must raise an error."""
    client.apply(make_job("a"))
    waited = later(client.wait, "a", deadline_s=SOON_S)

    client.delete("a")

    with pytest.raises(NoSuchJob):
        waited.result(SOON_S)


def test_a_status_of_an_older_spec_is_not_believed(client, tell, later):
    """Right after `resume`, the status is that of the older spec and still shows Suspended."""
    client.apply(make_job("a"))
    client.suspend("a")
    tell("a", "Suspended", generation=2)
    client.resume("a")
    waited = later(client.wait, "a", until="Suspended", deadline_s=SOON_S)

    tell("a", "Running", generation=3)
    client.suspend("a")
    tell("a", "Suspended", generation=4)

    assert waited.result(SOON_S).metadata.generation == 4


def test_statuses_come_until_the_end(client, tell, later):
    """The iterator yields the final status last and then ends by itself."""
    client.apply(make_job("a"))
    seen = []

    def collect():
        seen.extend(status.phase for status in client.statuses("a", deadline_s=SOON_S))

    collected = later(collect)
    for phase in ("Running", "Suspended", "Succeeded"):
        tell("a", phase)
        eventually(lambda phase=phase: phase in seen)

    collected.result(SOON_S)
    assert seen[-3:] == ["Running", "Suspended", "Succeeded"]


def test_a_job_in_a_queue_is_neither_suspended_nor_resumed_and_the_error_names_what_stops_it(client):
    """Kueue decides when such a job runs, so the error must name Kueue's means.

    The API server's message would report a wrong spec, which is not the problem.
    """
    client.apply(make_job("a", scheduling={"queueName": "robots"}))

    for call in (client.suspend, client.resume):
        with pytest.raises(QueueDecides, match=r"job a: Kueue decides .* queue robots; .*spec\.active"):
            call("a")


def test_a_delete_with_a_deadline_waits_for_what_the_job_owns(client, place):
    """After the call, a user can create a job with the same name at once."""
    job = client.apply(make_job("a"))
    owner = {
        "apiVersion": job.api_version,
        "kind": job.kind,
        "name": "a",
        "uid": job.metadata.uid,
        "blockOwnerDeletion": True,
    }
    metadata = {"name": "child", "ownerReferences": [owner]}
    place.create(CONFIG_MAPS, {"apiVersion": "v1", "kind": "ConfigMap", "metadata": metadata})

    client.delete("a", deadline_s=SOON_S)

    assert place.get(CONFIG_MAPS, "child") is None
    assert place.get(TRAINING_JOBS, "a") is None


def test_events_of_pods_are_the_jobs(client, place):
    """A kubelet's warning about a pod explains why the job makes no progress."""
    client.apply(make_job("a"))
    place.complain({"metadata": {"name": "a-0-x7k2p", "uid": "u"}}, "BackOff", "no such image")
    place.complain({"metadata": {"name": "other-0-x7k2p", "uid": "v"}}, "BackOff", "another's")

    [found] = client.events("a")

    assert (found.about, found.reason, found.warning) == ("Pod/a-0-x7k2p", "BackOff", True)


def test_a_replica_without_a_pod_has_no_log(client):
    """The error must name the command that shows why the replica has no pod."""
    client.apply(make_job("a"))

    with pytest.raises(NoPod, match=r"replica 0 has no pod; .*palaestra describe a"):
        list(client.logs("a", deadline_s=SOON_S))


def test_reading_a_log_that_went_with_its_pod_is_an_error(client, tell):
    """The log is lost with the pod, but the status still contains its last lines."""
    client.apply(make_job("a"))
    pod = {"name": "a-0-x7k2p", "uid": "u", "created": "2026-01-31T12:00:00Z"}
    tell("a", "Running", replicas=[{"index": 0, "phase": "Running", "pod": pod}])

    with pytest.raises(NoPod, match=r"pod a-0-x7k2p: does not exist any more, .*last lines"):
        list(client.logs("a", deadline_s=SOON_S))
