"""Properties that hold for every job, for any objects in the cluster and any order of their appearance."""

from copy import deepcopy
from datetime import UTC, datetime, timedelta

from hypothesis import given, settings
from hypothesis import strategies as st

from palaestra.api.reason_texts import ROWS
from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.status import Phase
from palaestra.decide import Create, Times, accept, as_data, decide, prepare
from palaestra.observe import Objects, Polled, observe, trimmed
from palaestra.plan import ClusterLayout, Images
from palaestra_protocol.pod.status import (
    Cause,
    FaultKind,
    FaultRecord,
    SimulatorStatus,
    Termination,
    TrainerStatus,
)
from tests.unit.decide.conftest import GROUPS

LAYOUT = ClusterLayout(
    images=Images(trainer="trainer:1", stub="stub:1", mujoco="mujoco:1", webots="webots:1")
)
CLOCK_S = 1000.0
START = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)
TERMINAL = {Phase.SUCCEEDED, Phase.FAILED}

texts = st.text(max_size=40) | st.sampled_from(["", "x" * 700, "\ud800", "a\nb", "2026-01-31T12:00:00Z"])
scalars = st.none() | st.booleans() | st.integers() | st.floats() | texts
garbage = st.recursive(
    scalars, lambda it: st.lists(it, max_size=2) | st.dictionaries(texts, it, max_size=2), max_leaves=4
)
moments = st.integers(-600, 600).map(
    lambda seconds: (START + timedelta(seconds=seconds)).strftime("%Y-%m-%dT%H:%M:%SZ")
)
counts = st.integers(0, 2**53)


def maybe(strategy):
    """Return a strategy of values that are mostly valid and sometimes arbitrary."""
    return st.one_of(strategy, strategy, strategy, garbage)


WAITING = ["ErrImagePull", "CrashLoopBackOff", "CreateContainerError", "PodInitializing"]
MARKS = [
    {},
    {"annotations": {"palaestra.dev/stopped": "Stalled: it"}},
    {"annotations": {"palaestra.dev/stopped": 3}},
]
faults = st.builds(
    FaultRecord,
    time=moments | st.just("0001-01-01T00:00:00+23:59"),
    simulator=st.text(min_size=1, max_size=300),
    kind=st.sampled_from(FaultKind),
    fact=st.text(max_size=300),
    step=counts,
)
words = st.builds(
    Termination,
    step=counts,
    reason=st.text(max_size=20),
    attempt=st.none() | st.integers(1, 5),
    restarts=st.none() | counts,
    success_rate=st.none() | st.floats(0, 1),
    log=st.lists(st.text(max_size=300), max_size=12).map(tuple),
    faults=st.lists(faults, max_size=12).map(tuple),
).map(Termination.to_message)
exits = st.fixed_dictionaries(
    {
        "exitCode": maybe(st.sampled_from([0, 1, 2, 70, 75, 80, 81, 82, 137])),
        "reason": maybe(st.sampled_from(["Completed", "Error", "OOMKilled"])),
        "message": maybe(words),
        "finishedAt": maybe(moments),
    }
)
running = st.fixed_dictionaries({"startedAt": maybe(moments)})
waiting = st.fixed_dictionaries({"reason": st.sampled_from(WAITING), "message": maybe(texts)})
states = st.one_of(
    st.fixed_dictionaries({"running": running}),
    st.fixed_dictionaries({"terminated": exits}),
    st.fixed_dictionaries({"waiting": waiting}),
)


def container_status(name):
    """Return a container status as a kubelet may write it."""
    return st.fixed_dictionaries(
        {
            "name": st.just(name),
            "state": maybe(states),
            "lastState": maybe(st.fixed_dictionaries({"terminated": exits})),
            "restartCount": maybe(st.integers(0, 5)),
            "started": maybe(st.booleans()),
        }
    )


def conditions(*kinds):
    """Return a strategy of conditions of these types."""
    each = st.fixed_dictionaries(
        {
            "type": st.sampled_from(kinds),
            "status": st.sampled_from(["True", "False"]),
            "reason": maybe(st.sampled_from(["PodFailurePolicy", "BackoffLimitExceeded", "Unschedulable"])),
            "message": maybe(texts),
            "lastTransitionTime": maybe(moments),
        }
    )
    return maybe(st.lists(each, max_size=3))


@st.composite
def pods(draw, planned):
    """Return a pod of a replica, which may have invalid fields."""
    template = planned["spec"]["template"]
    number = draw(st.integers(0, 3))
    spec = trimmed({"kind": "Pod", **deepcopy(template)})["spec"]
    names = [each["name"] for each in spec["initContainers"]]
    if draw(st.booleans()):
        del spec["initContainers"][0]["restartPolicy"]
    return {
        "metadata": {
            "name": f"pod-{number}",
            "uid": f"uid-{number}",
            "labels": template["metadata"]["labels"],
            "creationTimestamp": draw(maybe(moments)),
            "ownerReferences": draw(maybe(st.just([{"uid": "job-uid"}]))),
        }
        | draw(st.sampled_from([{}, {}, {"deletionTimestamp": "2026-01-31T12:00:00Z"}])),
        "spec": draw(maybe(st.just(spec))),
        "status": draw(
            maybe(
                st.fixed_dictionaries(
                    {
                        "phase": maybe(st.sampled_from(["Pending", "Running", "Succeeded", "Failed"])),
                        "startTime": maybe(moments),
                        "conditions": conditions("PodScheduled", "Ready", "DisruptionTarget"),
                        "initContainerStatuses": maybe(st.tuples(*map(container_status, names)).map(list)),
                        "containerStatuses": maybe(container_status("trainer").map(lambda it: [it])),
                    }
                )
            )
        ),
    }


simulators = st.builds(
    SimulatorStatus,
    name=st.sampled_from(["collect-0", "evaluate-0", "other"]),
    role=st.sampled_from(["Collect", "Evaluate"]),
    state=st.sampled_from(["idle", "starting", "ready", "stopping", "failed"]),
    restarts=counts,
    last_fault=st.none() | st.text(max_size=20),
)
answers = st.builds(
    TrainerStatus,
    step=counts,
    target=counts,
    episodes=counts,
    phase=st.sampled_from(["starting", "training"]),
    mean_return=st.none() | st.floats(allow_nan=False, allow_infinity=False),
    success_rate=st.none() | st.floats(0, 1),
    steps_per_second=st.none() | st.floats(0, 1e6),
    simulators=st.lists(simulators, max_size=3).map(tuple),
    last_progress=st.none() | moments,
    attempt=st.none() | st.integers(1, 2**53),
    goodput=st.dictionaries(st.sampled_from(Cause), st.floats(0, 2**53), max_size=3),
    faults=st.dictionaries(st.sampled_from(FaultKind), counts, max_size=3),
    steps_lost=counts,
)


events = st.fixed_dictionaries(
    {
        "reason": st.sampled_from(["FailedCreate", "FailedMount"]),
        "message": maybe(texts),
        "involvedObject": st.sampled_from([{"uid": "job-uid"}, {"uid": "uid-0"}]),
        "lastTimestamp": maybe(moments),
    }
)


@st.composite
def clusters(draw, planned):
    """Return objects of a job that a cluster may have."""
    jobs = []
    for each in planned.replicas.values():
        if draw(st.booleans()):
            job = trimmed(deepcopy(each.job))
            job["metadata"] |= {"uid": "job-uid"} | draw(st.sampled_from(MARKS))
            job["spec"]["suspend"] = draw(st.booleans())
            job["status"] = draw(
                maybe(
                    st.fixed_dictionaries(
                        {
                            "failed": maybe(st.integers(0, 5)),
                            "conditions": conditions("Complete", "Failed", "FailureTarget", "Suspended"),
                        }
                    )
                )
            )
            jobs.append(job)
    one_pod = st.sampled_from(tuple(planned.replicas.values())).flatmap(lambda it: pods(it.job))
    found = draw(st.lists(one_pod, max_size=3, unique_by=lambda it: it["metadata"]["uid"]))
    uids = [each["metadata"]["uid"] for each in found if draw(st.booleans())]
    return Objects(
        jobs=jobs,
        pods=found,
        claims=[trimmed(each.claim) for each in planned.replicas.values() if draw(st.booleans())],
        config_maps=[trimmed(each.config_map) for each in planned.replicas.values() if draw(st.booleans())],
        policies=[trimmed(planned.network_policy)] if draw(st.booleans()) else [],
        events=draw(st.lists(events, max_size=2)),
        polled={uid: Polled(status=draw(answers), at_s=CLOCK_S) for uid in uids},
    )


SPEC = {
    "replicas": 2,
    "simulators": list(GROUPS),
    "activeDeadlineSeconds": 900,
    "ttlSecondsAfterFinished": 600,
}


def raw(status=None):
    """Return the job that all these tests use, with a given status."""
    metadata = {"name": "job", "uid": "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e", "generation": 1}
    head = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": metadata}
    return head | {"spec": SPEC} | ({"status": status} if status is not None else {})


def one(obj, objects, times=None):
    """Return the decision on an object."""
    job = accept(obj)
    observed = observe(job, objects)
    times = times or Times(now=START, clock_s=CLOCK_S)
    return decide(job, observed, prepare(job, observed, LAYOUT), times)


PLANNED = prepare(accept(raw()), observe(accept(raw()), Objects()), LAYOUT).plan
histories = st.lists(st.tuples(clusters(PLANNED), st.integers(0, 700)), min_size=1, max_size=3)


def decisions(history):
    """Yield each decision of a history, with the status before it, the objects and the times."""
    first = one(raw(), Objects())
    status, times = as_data(first.status), Times(now=START, clock_s=CLOCK_S, record=first.record)
    for objects, seconds in history:
        now, clock_s = times.now + timedelta(seconds=seconds), times.clock_s + seconds
        times = Times(now=now, clock_s=clock_s, record=times.record)
        decision = one(raw(status), objects, times)
        times = Times(now=now, clock_s=clock_s, record=decision.record)
        yield accept(raw(status)).status, objects, times, decision
        status = as_data(decision.status)


@settings(max_examples=30)
@given(histories)
def test_deciding_again_says_nothing_new(history):
    """The operator is level-triggered: a second decision on the same objects changes no status."""
    for _, objects, times, decision in decisions(history):
        again = one(raw(as_data(decision.status)), objects, times)

        assert as_data(again.status) == as_data(decision.status)
        done = {(each.reason, each.message, each.replica) for each in decision.events}
        assert {(each.reason, each.message, each.replica) for each in again.events} <= done


@settings(max_examples=30)
@given(histories)
def test_an_end_is_an_end(history):
    """Programs act on a terminal phase, so it must never change. An ended replica must not train again."""
    for before, _, _, decision in decisions(history):
        ended = {each.index for each in before.replicas if each.phase in TERMINAL}
        now_ended = {each.index for each in decision.status.replicas if each.phase in TERMINAL}
        created = {each.replica for each in decision.actions if isinstance(each, Create)}

        assert before.phase not in TERMINAL or decision.status.phase is before.phase
        assert ended <= now_ended
        assert not created & now_ended
        assert before.release == decision.status.release


@settings(max_examples=30)
@given(histories)
def test_counts_never_fall_and_always_add_up(history):
    """Users and metrics rely on the counts.

    The attempt number is one more than the sum of the restarts of all causes.
    """
    for before, _, _, decision in decisions(history):
        for old, new in zip(before.replicas, decision.status.replicas, strict=False):
            was, now = old.restarts, new.restarts
            assert new.attempt >= old.attempt
            assert (now.trainer, now.disruption) >= (was.trainer, was.disruption)
            assert now.simulator >= was.simulator
            assert now.suspension >= was.suspension
            assert new.attempt in {0, 1 + now.trainer + now.disruption + now.suspension}
            assert (new.furthest_step or 0) >= (old.furthest_step or 0)
            assert kept(new) >= kept(old)
            assert sum(it.times for it in new.memory_kills) >= sum(it.times for it in old.memory_kills)


def kept(replica):
    """Return the number of the attempt in `lastAttempt`, or 0."""
    return replica.last_attempt.attempt if replica.last_attempt else 0


@settings(max_examples=30)
@given(histories)
def test_phase_and_conditions_tell_the_same(history):
    """Some programs read the phase, and others the conditions.

    At most one condition of a phase is true, and it belongs to the current phase. At most one of Reconciling
    and Stalled is true.
    """
    for _, _, _, decision in decisions(history):
        status = decision.status
        held = {each.type.value for each in status.conditions if each.status == "True"}

        gaps = held & {"Reconciling", "Stalled"}
        assert held - gaps - {"Accepted"} == ({status.phase.value} - {"Pending"})
        assert len(gaps) <= 1
        assert gaps or status.phase in {"Running", "Suspended", "Succeeded"}
        assert (status.completion_time is not None) == (status.phase in TERMINAL)
        assert (status.active_since is None) or status.phase not in TERMINAL
        assert all(Reason(each.reason) in ROWS for each in status.conditions)


@settings(max_examples=30)
@given(histories)
def test_what_is_written_is_within_the_bounds_of_the_definition(history):
    """An API server refuses the whole status if one text is too long or one number too large."""
    for _, _, _, decision in decisions(history):
        assert accept(raw(as_data(decision.status))).status == decision.status
        for event in decision.events:
            assert event.message.isprintable()
            assert len(event.message) <= LONGEST_MESSAGE


@settings(max_examples=30)
@given(st.lists(garbage, max_size=3), st.lists(garbage, max_size=3))
def test_garbage_is_as_good_as_nothing(things, others):
    """One invalid object must not keep the operator from reconciling the others."""
    objects = Objects(jobs=things, pods=others, claims=things, events=others, config_maps=things)

    assert one(raw(), objects).status.phase is Phase.PENDING
