"""The parts of a status that people read: columns, conditions and events."""

import json

import pytest
from pydantic.alias_generators import to_camel

from palaestra.api.attempt_status import Faults, Goodput, LastEvaluation
from palaestra.api.status import ConditionStatus, Phase
from palaestra.decide import accept, prepare
from palaestra.observe import Objects, observe
from palaestra_protocol.pod.status import (
    Cause,
    CheckpointStatus,
    EvaluationStatus,
    FaultKind,
    FaultRecord,
    SuccessInterval,
    Termination,
)


def test_the_columns_are_those_of_the_replica_that_is_worst_off(accepted):
    """A job has advanced only as far as its slowest replica."""
    scene = accepted(replicas=3)
    for index, (step, rate) in enumerate([(30, 0.9), (20, 0.5)]):
        scene.poll(scene.running_pod(index), step=step, success_rate=rate)

    scene.settle()

    assert (scene.status.running, scene.status.step, scene.status.success_rate) == ("2/3", 20, 0.5)


def test_what_is_not_known_is_absent_and_never_zero(training):
    """A reader would take a success rate of 0 for a measured value."""
    scene, _ = training()

    status, replica = scene.status, scene.replica()
    assert (status.step, status.success_rate, replica.step, replica.steps_per_second) == (None,) * 4


def test_what_a_trainer_no_longer_answers_stays_but_for_its_speed(training):
    """If the trainer does not respond, its last step is still correct, but its current speed is unknown."""
    scene, pod = training()
    scene.poll(pod, step=30, steps_per_second=20.0, mean_return=1.0)
    scene.settle()
    scene.polled.clear()

    scene.settle()

    assert (scene.replica().step, scene.replica().mean_return) == (30, 1.0)
    assert scene.replica().steps_per_second is None


def test_figures_have_the_four_decimals_that_people_read(training):
    """`kubectl get` prints the stored value, and nobody wants to read 0.3333333333333333."""
    scene, pod = training()
    scene.poll(pod, step=30, success_rate=1 / 3, mean_return=-0.0770739148936, steps_per_second=251.23456)

    scene.settle()

    replica = scene.replica()
    assert (replica.success_rate, replica.mean_return) == (0.3333, -0.0771)
    assert replica.steps_per_second == 251.2346


def test_the_last_evaluation_is_kept_until_the_next_one(training):
    """A sweep compares evaluations, and an attempt of an older trainer image reports none of them."""
    scene, pod = training()
    scene.poll(pod, step=30, last_evaluation=EvaluationStatus(step=20, success_rate=1 / 3, mean_return=-1.5))
    scene.settle()
    scene.poll(pod, step=31, success_rate=0.5, mean_return=2.0)

    scene.settle()

    kept = LastEvaluation(step=20, success_rate=0.3333, mean_return=-1.5)
    assert scene.replica().last_evaluation == kept


def test_an_evaluation_without_success_is_not_a_failed_one(training):
    """The figures of two evaluations must not be mixed, so an unknown figure does not keep the old value."""
    scene, pod = training()
    scene.poll(pod, step=30, last_evaluation=EvaluationStatus(step=20, success_rate=0.5, mean_return=1.0))
    scene.settle()
    scene.poll(pod, step=60, last_evaluation=EvaluationStatus(step=40, mean_return=2.0))

    scene.settle()

    assert scene.replica().last_evaluation == LastEvaluation(step=40, mean_return=2.0)


def test_the_interval_of_the_success_rate_is_kept_as_the_rate_is(training):
    """Until its first evaluation, an attempt reports no interval, so the status keeps the last one."""
    scene, pod = training()
    scene.poll(pod, step=30, success_rate=0.9, success_interval=SuccessInterval(low=0.7, high=1, episodes=20))
    scene.settle()
    scene.poll(pod, step=31)

    scene.settle()

    interval = scene.replica().success_interval
    assert (interval.low, interval.high, interval.episodes) == (0.7, 1.0, 20)


def test_the_status_lists_simulators(training, simulator):
    """A user must find the simulator that fails. The last fault of each simulator is shown on one line."""
    scene, pod = training()
    scene.poll(pod, simulators=(simulator(state="failed", last_fault="collect-0:\ngone", restarts=2),))

    scene.settle()

    (told,) = scene.replica().simulators
    assert (told.name, told.state, told.restarts, told.last_fault) == (
        "collect-0", "failed", 2, "collect-0: gone",
    )  # fmt: skip


def test_what_simulators_leave_out_is_in_the_status_of_the_job(accepted):
    """All replicas have the same worlds, so the job has one list.

    The list stays after the pod that reported it is deleted.
    """
    scene = accepted(replicas=2)
    pods = [scene.running_pod(index) for index in range(2)]
    scene.poll(pods[0])
    scene.settle()
    assert scene.status.left_out is None
    scene.poll(pods[1], left_out=("collect: no Drone:\n1 node left out (line 7)", "x" * 250, " "))
    scene.settle()
    scene.polled.clear()

    scene.settle()

    assert scene.status.left_out == ("collect: no Drone: 1 node left out (line 7)", "x" * 227 + "...")


def test_the_status_shows_goodput_and_faults(training, simulator):
    """A user sees how much time and how many steps the faults have cost.

    The times are in whole seconds, and absent until the trainer reports them.
    """
    scene, pod = training()
    scene.poll(pod, step=1)
    scene.settle()
    assert (scene.replica().goodput, scene.replica().faults, scene.replica().steps_lost) == (None,) * 3

    flapping = simulator(flapping=True, given_up=True, standby="ready")
    spent = {"stepping": 50.9, "learning": 7.2}
    scene.poll(pod, goodput=spent, faults={"dead": 2, "wrong_data": 1}, steps_lost=9, simulators=(flapping,))
    scene.settle()

    replica = scene.replica()
    assert (replica.goodput.stepping, replica.goodput.learning, replica.goodput.starting) == (50, 7, 0)
    assert (replica.faults.dead, replica.faults.hung, replica.faults.wrong_data) == (2, 0, 1)
    assert replica.steps_lost == 9
    [told] = replica.simulators
    assert (told.flapping, told.given_up, told.standby) == (True, True, "ready")


def test_every_cause_and_every_kind_of_fault_has_a_field():
    """The operator copies a trainer's values by name, so a missing field would lose a value."""
    assert {to_camel(cause) for cause in Cause} == {to_camel(name) for name in Goodput.model_fields}
    assert {kind.value for kind in FaultKind} == set(Faults.model_fields)


def test_a_status_of_two_replicas_stays_small(accepted, simulator):
    """People read the status, and an API server stores it.

    Every text of this status has its longest value.
    """
    scene = accepted(replicas=2)
    fact = "x" * 500
    faults = tuple(
        FaultRecord(time=scene.stamp(), simulator="collect-10", kind="dead", fact=fact, step=2**31)
        for _ in range(10)
    )
    word = Termination(step=1, reason=fact, log=(fact,) * 10, faults=faults).to_message()
    broken = tuple(simulator(name=f"collect-{i}", last_fault=fact, restarts=2**31) for i in range(32))
    for index in range(2):
        first = scene.running_pod(index)
        scene.end(first, 70, word)
        scene.pass_(1)
        scene.poll(
            scene.running_pod(index),
            simulators=broken,
            goodput=dict.fromkeys(Cause, 2.0**30),
            faults=dict.fromkeys(FaultKind, 2**30),
        )

    scene.settle()

    assert scene.replica().last_attempt.log
    assert len(json.dumps(scene.raw["status"]).encode()) < 40_000


def test_the_status_has_step_and_time_of_the_last_checkpoint(training):
    """A user sees how much work a crash could cost. A checkpoint with an impossible date is ignored."""
    scene, pod = training()
    scene.poll(pod, last_checkpoint=CheckpointStatus(step=5, time="2026-01-31T11:59:00+01:00"))
    scene.settle()
    scene.poll(pod, last_checkpoint=CheckpointStatus(step=9, time="0001-01-01T00:00:00+23:59"))

    scene.settle()

    told = scene.replica().last_checkpoint
    assert (told.step, told.time.isoformat()) == (5, "2026-01-31T10:59:00+00:00")


def test_a_trainer_that_has_ended_leaves_its_replica_running_until_its_pod_has(training, last_word):
    """Kubernetes still stops the simulators of the pod.

    Until the pod has ended, its replica must not count as ended or be retried.
    """
    scene, pod = training()
    scene.container(pod, "trainer", code=0, message=last_word(step=100))

    scene.settle()

    assert scene.replica().phase is Phase.RUNNING
    assert scene.replica().message == "attempt 1 has ended; its simulators are being stopped"


def test_a_condition_keeps_the_time_at_which_it_last_changed(training):
    """A new message alone is not a transition of the condition."""
    scene, pod = training()
    before = scene.status.conditions[1]
    scene.poll(pod, step=1)
    scene.settle(60)

    assert scene.status.conditions[1].last_transition_time == before.last_transition_time
    assert scene.status.conditions[1].status is ConditionStatus.TRUE


def messages(scene):
    """Return the message of each condition."""
    return {each.type.value: each.message for each in scene.status.conditions}


def test_only_the_conditions_running_and_reconciling_say_in_full_why_a_job_waits(accepted):
    """With the same 300 characters in four conditions, `kubectl describe` hid the important lines."""
    scene = accepted()
    scene.container(scene.new_pod(), "trainer", waiting="ImagePullBackOff: no such image")

    scene.settle()

    told = {"Running", "Reconciling"}
    others = {kind: message for kind, message in messages(scene).items() if kind not in told}
    assert {kind for kind, message in messages(scene).items() if "no such image" in message} == told
    assert others == {
        "Accepted": "the spec is valid and all objects that it names exist",
        **dict.fromkeys(
            ("Suspended", "Succeeded", "Failed"), "the job is Pending; see the condition Running"
        ),
    }


def test_only_the_conditions_failed_and_stalled_say_in_full_why_a_job_failed(accepted, last_word):
    """`palaestra watch` and the event take the message from these conditions.

    The others refer to them, so that `kubectl describe` stays short.
    """
    scene = accepted()
    scene.end(scene.running_pod(), 81, last_word(reason="Diverged: NaN"))
    scene.end_job("Failed", 0, "PodFailurePolicy")

    scene.settle()

    told = [kind for kind, message in messages(scene).items() if "Diverged: NaN" in message]
    assert told == ["Failed", "Stalled"]
    assert messages(scene)["Running"] == "the job is Failed; see the condition Failed"


def test_every_condition_keeps_the_reason_in_one_word(accepted):
    """Programs that read any condition, and the column of `kubectl get`, need the reason."""
    scene = accepted()

    assert {each.reason for each in scene.status.conditions[1:]} == {"Starting"}


def test_the_start_is_that_of_the_first_pod_and_stays(training):
    """`startTime` must stay after the first pod is deleted."""
    scene, _ = training()
    first = scene.status.start_time
    scene.objects["pods"].clear()
    scene.pass_(60)
    scene.running_pod()

    scene.settle()

    assert first is not None
    assert scene.status.start_time == first


def test_an_ephemeral_run_is_named_in_a_condition(accepted):
    """A user who chose `ephemeral` by mistake must see that the run will be deleted."""
    scene = accepted(storage={"ephemeral": True})

    assert scene.status.conditions[0].message.endswith("; the run is ephemeral and is deleted with its pod")


def test_each_action_and_each_change_is_one_event(make_scene):
    """Too many events would hide the important ones.

    So the creation of all objects of a replica is one event, and no event is repeated.
    """
    scene = make_scene()

    told = [(each.reason.value, each.replica) for each in scene.settle().events]

    assert told == [("Accepted", None), ("Starting", 0), ("Planned", None), ("Planned", 0)]


def test_suspending_suspended_and_resumed_are_an_event_each(training):
    """A user who waits for the checkpoint needs both events.

    `Suspending` means that the pod saves the checkpoint, and `Suspended` means that the pod has ended.
    """
    scene, _ = training()
    scene.raw["spec"]["suspend"] = True
    suspending = [each.reason.value for each in scene.settle().events]
    scene.objects["pods"].clear()
    suspended = [each.reason.value for each in scene.settle().events]
    scene.raw["spec"]["suspend"] = False

    resumed = [each.reason.value for each in scene.settle().events]

    assert (suspending, suspended) == (["Suspending"], ["Suspended"])
    assert resumed == ["Resumed", "Starting"]


@pytest.mark.parametrize("replicas", [1, 2])
def test_a_job_whose_replicas_all_fail_alike_says_why(accepted, last_word, replicas):
    """The message must have the common reason, not only the number of failed replicas."""
    scene = accepted(replicas=replicas)
    for index in range(replicas):
        scene.end(scene.running_pod(index), 81, last_word(reason="Diverged: NaN"))
        scene.end_job("Failed", index, "PodFailurePolicy")

    scene.settle()

    failed = scene.status.conditions[-1]
    assert (scene.status.phase, failed.reason) == (Phase.FAILED, "Diverged")
    assert "the learner diverged (exit code 81): Diverged: NaN" in failed.message


def test_nothing_is_planned_where_nothing_is_missing(training):
    """With two hundred jobs, the operator must not generate their worlds again every ten seconds."""
    scene, _ = training()
    job = accept(scene.raw)
    prepared = prepare(job, observe(job, Objects(**scene.objects)), scene.layout)

    assert (prepared.plan, prepared.hold) == (None, None)
