"""Every kind of request to a real API server, whose responses must be those that our client expects."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from palaestra.cluster import (
    AlreadyExists,
    Conflict,
    Forbidden,
    Invalid,
    NotFound,
    Recorder,
    Reflector,
    connect,
)
from palaestra.cluster.resources import CONFIG_MAPS, EVENTS, JOBS, NODES, PODS, TRAINING_JOBS
from palaestra.cluster.store import JOB_LABEL


def config_map(namespace, name="c", data=None, **labels):
    """Return a small object."""
    metadata = {"name": name, "namespace": namespace, "labels": labels}
    return {"apiVersion": "v1", "kind": "ConfigMap", "metadata": metadata, "data": data or {}}


def child(namespace, name):
    """Return a Job that never runs."""
    container = {"name": "c", "image": "none"}
    template = {"spec": {"restartPolicy": "Never", "containers": [container]}}
    metadata = {"name": name, "namespace": namespace}
    return {"apiVersion": "batch/v1", "kind": "Job", "metadata": metadata, "spec": {"template": template}}


def test_the_version_of_the_api_server_is_returned(real):
    """A successful response shows that credentials and certificates work."""
    assert real.version().startswith("v1.")


def test_a_group_that_is_not_served_is_no_error(real):
    """Many clusters have no Kueue, and the operator must work there too."""
    assert real.serves("batch/v1")
    assert not real.serves("kueue.x-k8s.io/v1beta1")


def test_what_was_created_is_read_back(real, namespace):
    """The API server adds uid and version, which the operator needs for later requests."""
    made = real.create(CONFIG_MAPS, config_map(namespace, data={"k": "v"}))

    assert real.get(CONFIG_MAPS, namespace, "c") == made
    assert made["metadata"]["uid"]


def test_a_name_is_given_once(real, namespace):
    """If two operators create the same object, the unique name makes one of the requests fail."""
    with ThreadPoolExecutor(8) as pool:
        attempts = [pool.submit(real.create, CONFIG_MAPS, config_map(namespace)) for _ in range(8)]
    errors = [attempt.exception() for attempt in attempts]

    assert errors.count(None) == 1
    assert {type(error) for error in errors if error} == {AlreadyExists}


def test_what_is_not_there_is_not_found(real, namespace):
    """The caller must get the same error for a missing object and for a missing kind."""
    with pytest.raises(NotFound):
        real.get(PODS, namespace, "none")
    with pytest.raises(NotFound):
        real.list(TRAINING_JOBS.__class__(api_version="nobody.dev/v1", kind="X", plural="xs"))


def test_a_wrong_object_is_refused_with_the_name_of_the_field(real, namespace):
    """The operator copies the message into a condition, where the author of a job reads it."""
    wrong = child(namespace, "j")
    wrong["spec"]["template"]["spec"]["restartPolicy"] = "Always"

    with pytest.raises(Invalid, match=r"spec\.template\.spec\.restartPolicy"):
        real.create(JOBS, wrong)


def test_what_rbac_does_not_allow_is_forbidden(control_plane, namespace):
    """From the message, an administrator learns which user needs which permission."""
    nobody = connect(str(control_plane.kubeconfig_of("nobody")))

    with pytest.raises(Forbidden, match=r'User "nobody" cannot list resource "pods"'):
        nobody.list(PODS, namespace)
    nobody.close()


def test_a_merge_changes_what_it_names_and_removes_what_is_null(real, namespace):
    """The operator removes a field with null, as RFC 7386 defines for merge patches."""
    real.create(CONFIG_MAPS, config_map(namespace, data={"a": "1", "b": "2"}))

    merged = real.merge(CONFIG_MAPS, namespace, "c", {"data": {"a": None, "c": "3"}})

    assert merged["data"] == {"b": "2", "c": "3"}


def test_a_merge_into_another_version_is_a_conflict(real, namespace):
    """If another client has written first, the operator must read the object again."""
    made = real.create(CONFIG_MAPS, config_map(namespace))
    version = made["metadata"]["resourceVersion"]
    real.merge(CONFIG_MAPS, namespace, "c", {"data": {"a": "1"}}, resource_version=version)

    with pytest.raises(Conflict):
        real.merge(CONFIG_MAPS, namespace, "c", {"data": {"a": "2"}}, resource_version=version)


def test_a_status_is_merged_through_its_subresource(real, namespace):
    """A patch of the status must not change other fields by accident."""
    real.create(NODES, {"apiVersion": "v1", "kind": "Node", "metadata": {"name": namespace}})
    patch = {"spec": {"unschedulable": True}, "status": {"phase": "Running"}}

    merged = real.merge(NODES, None, namespace, patch, subresource="status")
    real.delete(NODES, None, namespace)

    assert merged["status"]["phase"] == "Running"
    assert "unschedulable" not in merged["spec"]


def test_applying_makes_it_so_and_applying_less_takes_it_back(real, namespace):
    """Server-side apply removes omitted fields, and for this reason the operator never applies Jobs."""
    real.apply(config_map(namespace, data={"a": "1", "b": "2"}))
    applied = real.apply(config_map(namespace, data={"a": "1"}))

    assert applied["data"] == {"a": "1"}


def test_a_field_of_another_manager_is_taken_by_force_only(real, namespace):
    """Without force, a client must not overwrite the value of another manager.

    With force, it must be able to do so.
    """
    real.apply(config_map(namespace, data={"a": "1"}), manager="another")

    with pytest.raises(Conflict, match="another"):
        real.apply(config_map(namespace, data={"a": "2"}), force=False)

    assert real.apply(config_map(namespace, data={"a": "2"}))["data"] == {"a": "2"}


def test_a_deletion_that_names_a_uid_spares_a_later_object_of_the_same_name(real, namespace):
    """With an old cache, the operator would otherwise delete a new object of the same name."""
    first = real.create(CONFIG_MAPS, config_map(namespace))
    real.delete(CONFIG_MAPS, namespace, "c", uid=first["metadata"]["uid"])
    real.create(CONFIG_MAPS, config_map(namespace))

    with pytest.raises(Conflict):
        real.delete(CONFIG_MAPS, namespace, "c", uid=first["metadata"]["uid"])

    assert real.get(CONFIG_MAPS, namespace, "c")


def test_six_hundred_objects_are_listed_in_pages_and_all_of_one_moment(real, namespace):
    """Each of the six pages must contain the next objects, without a gap or a repetition."""
    with ThreadPoolExecutor(8) as pool:
        made = pool.map(
            lambda number: real.create(CONFIG_MAPS, config_map(namespace, f"c{number}", kind="many")),
            range(600),
        )
        assert len(list(made)) == 600
    asked = []
    real.on_request = lambda *request: asked.append(request[0])

    found = real.list(CONFIG_MAPS, namespace, labels="kind=many", limit=100)

    assert sorted(item["metadata"]["name"] for item in found) == sorted(f"c{n}" for n in range(600))
    assert {(item["apiVersion"], item["kind"]) for item in found} == {("v1", "ConfigMap")}
    assert asked == ["list"] * 6


def test_a_reflector_follows_what_happens_and_looks_up_by_label(real, namespace):
    """The reflector must report objects that exist before it starts, and all later changes."""
    reports, more = [], threading.Condition()

    def changed(obj):
        with more:
            reports.append((obj["metadata"]["name"], obj.get("data")))
            more.notify_all()

    def reported(*report, times=1):
        with more:
            assert more.wait_for(lambda: reports.count(report) == times, timeout=10), reports

    real.create(CONFIG_MAPS, config_map(namespace, "before", **{JOB_LABEL: "x"}))
    reflector = Reflector(real, CONFIG_MAPS, labels=JOB_LABEL, keep=lambda obj: obj, changed=changed)
    reflector.start()
    assert reflector.wait_synced(10)
    real.create(CONFIG_MAPS, config_map(namespace, "unlabelled"))
    real.create(CONFIG_MAPS, config_map(namespace, "after", {"a": "1"}, **{JOB_LABEL: "x"}))
    reported("after", {"a": "1"})
    real.merge(CONFIG_MAPS, namespace, "after", {"data": {"a": "2"}})
    reported("after", {"a": "2"})
    both = reflector.store.select(namespace, {JOB_LABEL: "x"})
    real.delete(CONFIG_MAPS, namespace, "before")
    reported("before", None, times=2)  # the first report was its creation
    started = time.monotonic()
    reflector.stop(5)

    assert time.monotonic() - started < 1

    assert [obj["metadata"]["name"] for obj in both] == ["after", "before"]
    assert both[0]["kind"] == "ConfigMap"
    assert reflector.store.get(namespace, "before") is None
    assert reflector.store.get(namespace, "unlabelled") is None


def test_contents_of_objects_can_stay_with_the_api_server(real, namespace):
    """With their contents, a list of a thousand jobs would hold a thousand worlds in memory."""
    real.create(CONFIG_MAPS, config_map(namespace, data={"world": "x" * 1000}, mine="yes"))

    found = real.list(CONFIG_MAPS.only_metadata(), namespace, labels="mine=yes")

    assert [(item["kind"], item.get("data")) for item in found] == [("ConfigMap", None)]
    assert real.get(CONFIG_MAPS.only_metadata(), namespace, "c")["kind"] == "ConfigMap"


def test_a_happening_that_repeats_is_one_event_with_a_count(real, namespace):
    """A person must not see hundreds of equal events, even if the operator restarted in between."""
    made = real.create(JOBS, child(namespace, "j"))
    recorder = Recorder(real)
    recorder.record(made, "Warning", "Stalled", "no step for 600 s")
    recorder.record(made, "Warning", "Stalled", "no step for 600 s")
    Recorder(real).record(made, "Warning", "Stalled", "no step for 600 s")
    recorder.record(made, "Normal", "Training", "again")

    uid = made["metadata"]["uid"]
    events = real.list(EVENTS, namespace, fields=f"involvedObject.uid={uid}")

    ours = [event for event in events if event["source"]["component"] == "palaestra-operator"]
    assert {(event["reason"], event["type"], event["count"]) for event in ours} == {
        ("Stalled", "Warning", 3),
        ("Training", "Normal", 1),
    }


def test_an_event_that_the_api_server_forgot_is_written_again(real, namespace):
    """The API server keeps events for an hour, so a later repetition must create a new event."""
    made = real.create(JOBS, child(namespace, "j"))
    recorder = Recorder(real)
    recorder.record(made, "Normal", "Planned", "one replica")
    for event in real.list(EVENTS, namespace, fields="reason=Planned"):
        real.delete(EVENTS, namespace, event["metadata"]["name"])

    recorder.record(made, "Normal", "Planned", "one replica")

    assert [event["count"] for event in real.list(EVENTS, namespace, fields="reason=Planned")] == [1]


def test_an_event_that_cannot_be_written_stops_nobody(control_plane, real, namespace):
    """A missing permission or a long message must not stop the operator."""
    made = real.create(JOBS, child(namespace, "j"))
    nobody = connect(str(control_plane.kubeconfig_of("nobody")))

    Recorder(nobody).record(made, "Normal", "Planned", "x")
    Recorder(real).record(made, "Normal", "Planned", "y" * 5000)
    nobody.close()

    messages = [event["message"] for event in real.list(EVENTS, namespace, fields="reason=Planned")]
    assert [len(message) for message in messages] == [1024]
