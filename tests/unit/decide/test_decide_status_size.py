"""etcd limits the size of an object, and the status and the spec of a job are one object."""

import json
from datetime import UTC, datetime

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from palaestra.api.status import Status
from palaestra.decide import as_data, fitted
from palaestra.observe import trimmed

MOST = 1_400_000
TIME = datetime(2026, 1, 31, 12, 0, tzinfo=UTC).isoformat()
PHASES = ("Running", "Succeeded", "Failed", "Pending", "Suspended")
KEPT = ("index", "phase", "reason", "attempt", "pod", "restarts", "furthestStep", "fruitless")


def replica(index, phase="Running", *, simulators=32, text="x", long=200, kills=0):
    """Return a replica in which every text has its longest allowed value."""
    fault = {"time": TIME, "simulator": "collect-0", "kind": "dead", "fact": text * long, "step": 3}
    kill = {"times": 2, "limit": "512Mi", "last": TIME, "pod": "u" * 36, "run": 1}
    return {
        "index": index,
        "phase": phase,
        "reason": "Training",
        "message": text * 1024,
        "attempt": 2,
        "pod": {"name": f"job-{index}-abcde", "uid": "u" * 36, "created": TIME},
        "furthestStep": 10,
        "simulators": [
            {"name": f"collect-{i}", "role": "Collect", "state": "ready", "lastFault": text * 600}
            for i in range(simulators)
        ],
        "lastAttempt": {
            "attempt": 1,
            "reason": "Disrupted",
            "message": text * 1024,
            "log": [text * long] * 10,
            "faults": [fault] * 10,
        },
        "memoryKills": [{"container": f"sim-{'g' * 20}-{i}", **kill} for i in range(kills)],
    }


def whole(replicas):
    """Return a status in the form in which the operator writes it."""
    told = {"type": "Running", "status": "True", "reason": "Training", "message": "x" * 1024}
    status = {
        "phase": "Running",
        "conditions": [told | {"lastTransitionTime": TIME}],
        "leftOut": ["\U0001f600" * 230] * 16,
        "replicas": replicas,
    }
    return as_data(Status.model_validate(status, by_alias=True, by_name=False))


def counted(replica):
    """Return the count and the time of the last memory kill of each container."""
    return [(each["container"], each["times"], each["last"]) for each in replica.get("memoryKills", ())]


def job(size=0, **annotations):
    """Return a TrainingJob whose spec had `size` bytes, from a cache that does not keep the spec."""
    metadata = {"name": "job", "namespace": "default", "annotations": annotations}
    raw = {"kind": "TrainingJob", "metadata": metadata, "spec": {"world": "w" * size}}
    kept = trimmed(raw)
    del kept["spec"]  # a cache may drop parts of the spec; here it drops all of it
    return kept


def size(data):
    """Return the number of bytes of the data as JSON."""
    return len(json.dumps(data).encode())


def test_a_hundred_replicas_of_32_simulators_fit_with_the_largest_world():
    """The full status has 3 MiB. The API server refused it, and the operator sent it again for ever."""
    status = whole([replica(i) for i in range(100)])
    assert size(status) > MOST

    cut = fitted(job(900_000), status)

    assert size(cut) + 900_000 <= MOST


def test_a_status_that_fits_is_left_alone():
    """Almost every status fits, and must not lose details."""
    status = whole([replica(i) for i in range(10)])

    assert fitted(job(), status) is status


def test_what_others_have_written_into_the_object_takes_room_too():
    """`kubectl apply` stores the whole spec a second time in an annotation, which the cache does not keep."""
    status = whole([replica(i) for i in range(40)])

    alone, beside = fitted(job(), status), fitted(job(**{"example.com/last": "x" * 250_000}), status)

    assert size(beside) <= MOST - 250_000 < size(alone) <= MOST


def test_a_replica_that_failed_keeps_its_log_longest():
    """A person reads this log to find the cause of the failure. A running replica sends its log again."""
    status = whole([replica(i, "Failed" if i == 7 else "Running") for i in range(100)])

    cut = fitted(job(1_000_000), status)

    assert cut["replicas"][7]["lastAttempt"]["log"] == status["replicas"][7]["lastAttempt"]["log"]
    assert "log" not in cut["replicas"][8]["lastAttempt"]


@settings(deadline=None, max_examples=60)
@given(
    phases=st.lists(st.sampled_from(PHASES), min_size=1, max_size=100),
    simulators=st.integers(0, 32),
    text=st.sampled_from("xé\u3042\U0001f600"),
    kills=st.integers(0, 34),
    taken=st.integers(0, 950_000),
)
@example(phases=["Failed"] * 100, simulators=32, text="\U0001f600", kills=34, taken=950_000)
def test_every_status_fits_beside_its_spec_and_keeps_what_is_decided_by(
    phases, simulators, text, kills, taken
):
    """The schema allows any of these statuses.

    If a second shortening changed the status again, each reconcile would write it.
    """
    status = whole(
        [replica(i, each, simulators=simulators, text=text, kills=kills) for i, each in enumerate(phases)]
    )

    cut = fitted(job(taken), status)

    assert size(cut) + taken <= MOST
    assert fitted(job(taken), cut) == cut == fitted(job(taken), status)
    assert [{name: it.get(name) for name in KEPT} for it in cut["replicas"]] == [
        {name: it.get(name) for name in KEPT} for it in status["replicas"]
    ]
    assert [counted(it) for it in cut["replicas"]] == [counted(it) for it in status["replicas"]]
    assert as_data(Status.model_validate(cut, by_alias=True, by_name=False))["phase"] == status["phase"]


@pytest.mark.parametrize("phase", ["Running", "Succeeded"])
@pytest.mark.parametrize("detail", ["simulators", "log", "faults"])
def test_no_detail_of_a_failed_replica_goes_while_one_of_a_healthy_one_is_there(phase, detail):
    """The operator first removes the details that are least useful to a reader."""
    status = whole([replica(i, phase if i % 2 else "Failed") for i in range(100)])

    for taken in range(0, 1_000_000, 50_000):
        failed, healthy = (it | it["lastAttempt"] for it in fitted(job(taken), status)["replicas"][:2])
        lost = [name for name in ("simulators", "log", "faults") if not failed.get(name)]
        assert not lost or not healthy.get(detail)
