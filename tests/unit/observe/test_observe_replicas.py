"""The objects that belong to a replica, and objects of others with the same name."""

from copy import deepcopy
from datetime import UTC, datetime

import pytest

from palaestra.api.status import PodReference, ReplicaStatus
from palaestra.observe import JobEnd, Objects, Polled, last_blocking_event, observe, trimmed
from palaestra_protocol.pod.status import TrainerStatus

NOW = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)


def test_every_replica_of_the_spec_is_there(valid_job):
    """A replica without objects must also be observed, so that the operator creates them."""
    seen = observe(valid_job(replicas=3), Objects())

    assert [each.index for each in seen.replicas] == [0, 1, 2]
    assert all(each.job is None and each.pod is None for each in seen.replicas)


def test_a_job_is_ours_by_the_uid_of_its_owner(look, raw_job):
    """Another object may get an old name again, but never an old uid."""
    other = deepcopy(raw_job)
    other["metadata"]["ownerReferences"][0]["uid"] = "another"

    ours, theirs = look(jobs=[raw_job]).replicas[0], look(jobs=[other]).replicas[0]

    assert (ours.job.name, ours.obstacle) == ("job-0", None)
    assert (theirs.job, theirs.obstacle.name, theirs.obstacle.deleting) == (None, "job-0", False)


def test_pods_of_a_job_of_the_same_name_are_not_ours(look, raw_pod):
    """An earlier TrainingJob had the same name, and its pods may still terminate."""
    raw_pod["metadata"]["labels"]["palaestra.dev/job-uid"] = "another"

    assert look(pods=[raw_pod]).replicas[0].pod is None


def test_the_newest_pod_is_the_last(look, raw_pod):
    """An API server lists pods in any order."""
    newer = deepcopy(raw_pod)
    newer["metadata"] |= {"name": "a", "uid": "pod-2", "creationTimestamp": "2026-01-31T12:00:09Z"}

    replica = look(pods=[newer, raw_pod]).replicas[0]

    assert [each.uid for each in replica.pods] == ["pod-1", "pod-2"]
    assert replica.pod.uid == "pod-2"


def test_of_two_pods_of_one_second_the_one_that_goes_on_is_newer(look, raw_pod):
    """A Job runs one pod at a time, so the ended pod is the older one."""
    ended = deepcopy(raw_pod)
    ended["metadata"] |= {"name": "zzz", "uid": "pod-2"}
    ended["status"] = {"phase": "Failed"}

    assert look(pods=[raw_pod, ended]).replicas[0].pod.uid == "pod-1"


def test_an_answer_belongs_to_the_pod_that_gave_it(look, raw_pod):
    """For a pod that has ended, the termination message is newer than the polled status."""
    answer = Polled(status=TrainerStatus(step=1, target=2, episodes=0, phase="training"), at_s=5.0)
    other = look(pods=[raw_pod], polled={"another": answer}).replicas[0]
    alive = look(pods=[raw_pod], polled={"pod-1": answer}).replicas[0]
    raw_pod["status"]["phase"] = "Succeeded"
    ended = look(pods=[raw_pod], polled={"pod-1": answer}).replicas[0]

    assert (other.polled, alive.polled, ended.polled) == (None, answer, None)


@pytest.mark.parametrize(
    ("conditions", "end"),
    [
        ([], None),
        ([{"type": "Failed", "status": "False"}], None),
        ([{"type": "Complete", "status": "True"}], JobEnd.COMPLETE),
        ([{"type": "SuccessCriteriaMet", "status": "True"}], JobEnd.COMPLETE),
        ([{"type": "FailureTarget", "status": "True"}], JobEnd.FAILED),
        ([{"type": "FailureTarget", "status": "True"}, {"type": "Failed", "status": "True"}], JobEnd.FAILED),
    ],
)
def test_the_end_of_a_job_is_in_its_conditions(look, raw_job, conditions, end):
    """A Job has one of the conditions before its last pod has ended.

    On a lost node that pod never ends, so the operator must not wait for the later condition.
    """
    raw_job["status"] = {"conditions": conditions}

    assert look(jobs=[raw_job]).replicas[0].job.end is end


def test_failures_that_are_about_to_be_booked_count(look, raw_job):
    """The Job controller first lists an ended pod as uncounted, and then raises its count."""
    raw_job["status"] = {"failed": 2, "uncountedTerminatedPods": {"failed": ["uid-3"]}}

    assert look(jobs=[raw_job]).replicas[0].job.failures == 3


def test_the_last_refusal_of_a_pod_is_kept(look, raw_job):
    """An earlier Job may have had the same name, so only the uid in the event decides."""

    def event(words, second, uid="job-uid"):
        return {
            "reason": "FailedCreate",
            "message": words,
            "involvedObject": {"uid": uid},
            "lastTimestamp": f"2026-01-31T12:00:0{second}Z",
        }

    events = [event("first", 1), event("last", 3), event("of another", 5, "other")]

    assert look(jobs=[raw_job], events=events).replicas[0].refused.message == "last"


def test_an_event_in_series_is_as_late_as_its_last(look, raw_job):
    """In the newer events API, a repeated event is one object with a series."""
    event = {
        "reason": "FailedCreate",
        "message": "quota",
        "involvedObject": {"uid": "job-uid"},
        "eventTime": "2026-01-31T12:00:00.123456Z",
        "series": {"lastObservedTime": "2026-01-31T13:00:00.000000Z"},
    }

    assert look(jobs=[raw_job], events=[event]).replicas[0].refused.at.hour == 13


def test_what_is_there_is_known_by_kind_and_name(valid_job):
    """A claim and a NetworkPolicy may have the same name."""
    job = valid_job()
    named = {"metadata": {"name": "x", "ownerReferences": [{"uid": job.metadata.uid}]}}

    seen = observe(job, Objects(claims=[named], policies=[named]))

    assert seen.present == {("PersistentVolumeClaim", "x"), ("NetworkPolicy", "x")}


def test_a_config_map_or_policy_of_somebody_else_is_not_there(valid_job):
    """Any user can set the operator's label, so only the owner reference counts.

    By default a claim has no owner, because it must outlive its job.
    """
    named = {"metadata": {"name": "x"}}

    seen = observe(valid_job(), Objects(claims=[named], policies=[named], config_maps=[named]))

    assert seen.present == {("PersistentVolumeClaim", "x")}


def test_of_other_kinds_only_who_wrote_them_is_forgotten():
    """From an object of an unlisted kind, such as an Event, only `managedFields` is removed."""
    event = {"kind": "Event", "reason": "FailedCreate", "metadata": {"name": "x", "managedFields": [1]}}

    assert trimmed(event) == {"kind": "Event", "reason": "FailedCreate", "metadata": {"name": "x"}}


def test_what_is_kept_in_memory_shows_the_same(look, raw_job, raw_pod):
    """The cache drops only fields that the operator never reads. They make up most of an object."""
    raw_job |= {"status": {"failed": 1}}
    raw_job["metadata"] |= {
        "annotations": {
            "palaestra.dev/stopped": "Stalled: it",
            "palaestra.dev/suspend-set": "true",
            "palaestra.dev/suspended": "pod-0 lived",
            "other": "x",
        },
        "managedFields": [{"manager": "palaestra-operator"}],
        "resourceVersion": "20",
    }
    raw_pod["metadata"]["resourceVersion"] = "30"
    raw_pod["status"] = {
        "phase": "Running",
        "containerStatuses": [
            {"name": "trainer", "state": {"running": {"startedAt": "2026-01-31T12:00:05Z"}}}
        ],
    }
    config_map = {"kind": "ConfigMap", "metadata": {"name": "x"}, "data": {"training.yaml": "x" * 1000}}
    whole = {"jobs": [raw_job], "pods": [raw_pod], "config_maps": [config_map]}
    small = {name: [trimmed(each) for each in objects] for name, objects in whole.items()}

    assert look(**small) == look(**whole)
    assert len(str(small)) < len(str(whole)) / 2


def test_a_pod_is_the_replicas_by_the_uid_of_its_job(look, raw_pod):
    """Any user who may create pods can give them the operator's labels."""
    raw_pod["metadata"]["ownerReferences"] = [{"kind": "Job", "name": "job-0", "uid": "another"}]

    replica = look(pods=[raw_pod]).replicas[0]

    assert (replica.pods, replica.in_the_way) == ((), ("job-0-x",))


def test_the_pod_that_the_status_names_stays_the_replicas_when_its_job_is_gone(valid_job, raw_pod):
    """A user deleted the Job, but its pod is still saving a checkpoint."""
    named = {"name": "job-0-x", "uid": "pod-1", "created": NOW}
    job = valid_job()
    status = job.status.model_copy(
        update={"replicas": (ReplicaStatus(index=0, attempt=1, pod=PodReference(**named)),)}
    )

    replica = observe(job.model_copy(update={"status": status}), Objects(pods=[raw_pod])).replicas[0]

    assert [each.uid for each in replica.pods] == ["pod-1"]


def test_what_was_refused_is_of_the_replica_or_of_all(valid_job):
    """A refused claim affects one replica; a refused NetworkPolicy affects all of them.

    The status has space for one line.
    """
    seen = observe(valid_job(replicas=2), Objects(denied={1: "over\nquota"}))
    of_all = observe(valid_job(replicas=2), Objects(denied={None: "no policy"}))

    assert [each.denied for each in seen.replicas] == ["", "over quota"]
    assert [each.denied for each in of_all.replicas] == ["no policy"] * 2


def test_a_volume_that_does_not_come_is_read_from_the_events_of_its_pod(look, raw_pod):
    """While a pod waits for its volumes, the last event about volumes has the cause."""

    def event(reason, words, second, uid="pod-1"):
        return {
            "reason": reason,
            "message": words,
            "involvedObject": {"uid": uid},
            "lastTimestamp": f"2026-01-31T12:00:0{second}Z",
        }

    events = [
        event("FailedAttachVolume", "first", 1),
        event("FailedMount", "last", 3),
        event("FailedMount", "of another", 5, "other"),
        event("Unhealthy", "of a probe", 7),
    ]
    waits = look(pods=[raw_pod], events=events).replicas[0]
    raw_pod["status"]["phase"] = "Running"
    runs = look(pods=[raw_pod], events=events).replicas[0]

    assert (waits.unmounted, runs.unmounted) == ("last", "")


def test_the_event_about_the_probe_is_read_and_not_one_about_another_container():
    """After the trainer the kubelet also ends the other containers, and emits events about them."""
    probe = {"reason": "Killing", "message": "Container trainer failed startup probe, will be restarted"}
    other = {"reason": "Killing", "message": "Stopping container sim-collect-0"}
    events = [
        {**probe, "lastTimestamp": "2026-01-31T12:00:00Z"},
        {**other, "lastTimestamp": "2026-01-31T12:00:09Z"},
    ]

    assert last_blocking_event(events, "u")["message"] == probe["message"]
