"""A pod that a suspension ended counts as a restart by suspension.

This holds for every program that suspends a Job, and also if the operator sees the suspension late.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.decide import Stop


def tell_suspension(scene, status):
    """Set the condition with which the Job controller reports a suspension or its end."""
    turned = {"type": "Suspended", "status": status, "lastTransitionTime": scene.stamp()}
    scene.job().setdefault("status", {})["conditions"] = [turned]


def test_a_resumption_may_be_dated_after_the_pod_that_it_made(training):
    """The Job controller creates the pod first. It writes the time of the resumption maybe a second later."""
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.pass_(15)
    scene.running_pod()
    scene.pass_(1)
    tell_suspension(scene, "False")

    scene.settle()

    assert scene.restarts() == (2, 0, 0, 1)


def test_a_suspension_by_a_queue_that_the_status_showed_is_counted_however_late_its_end_is_dated(training):
    """A busy Job controller may write a time of the resumption that is seconds after the pod's creation."""
    scene, _ = training()
    scene.job()["spec"]["suspend"] = True
    tell_suspension(scene, "True")
    scene.objects["pods"].clear()
    scene.settle(15)
    scene.job()["spec"]["suspend"] = False
    scene.pass_(15)
    scene.running_pod()
    scene.pass_(5)
    tell_suspension(scene, "False")

    scene.settle()

    assert scene.restarts() == (2, 0, 0, 1)


def test_a_pod_that_was_taken_before_a_queue_suspended_the_job_is_a_disruption(training):
    """The eviction ended the pod before the suspension, so the suspension is not the cause."""
    scene, pod = training()
    scene.take(pod)
    scene.settle(5)
    scene.job()["spec"]["suspend"] = True
    scene.settle(5)
    scene.objects["pods"].clear()
    scene.settle(5)
    scene.job()["spec"]["suspend"] = False
    scene.pass_(15)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 1, 0)


def test_a_pod_may_be_seen_before_its_job_tells_of_the_resumption(training):
    """Pods and Jobs come from two watches.

    A resumption that the operator sees late must not count again for the next pod.
    """
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.pass_(15)
    tell_suspension(scene, "True")
    scene.pass_(15)
    scene.running_pod()
    scene.settle(1)
    assert scene.restarts() == (2, 0, 0, 1)

    scene.objects["pods"].clear()
    tell_suspension(scene, "False")
    scene.pass_(15)
    scene.running_pod()
    scene.settle()

    assert scene.restarts() == (3, 0, 1, 1)


def test_a_pod_that_was_replaced_before_the_suspension_is_a_disruption(training):
    """The newest pod existed before the suspension, so something else ended its predecessor."""
    scene, _ = training()
    scene.objects["pods"].clear()
    scene.pass_(15)
    scene.running_pod()
    scene.pass_(15)
    tell_suspension(scene, "True")

    scene.settle()

    assert scene.restarts() == (2, 0, 1, 0)


def pause(scene, pod, *, resumes=True):
    """Suspend the job and delete its pod, as the Job controller does; with `resumes`, resume it at once."""
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    tell_suspension(scene, "True")
    scene.objects["pods"].remove(pod)
    if resumes:
        resume(scene)


def resume(scene):
    """Resume the job, and report the end of the suspension as the Job controller does."""
    scene.raw["spec"]["suspend"] = False
    scene.settle()
    tell_suspension(scene, "False")


def test_a_suspension_within_the_second_of_its_pod_is_counted(training):
    """The control plane writes whole seconds, so times cannot decide.

    The annotation on the Job names the pod that the suspension ended.
    """
    scene, pod = training()
    pause(scene, pod)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 0, 1)


def test_a_pod_that_is_seen_after_the_suspension_that_ended_it_is_counted_as_such(accepted):
    """The operator's cache may get the pod late, so the patch that resumes the Job names the ended pod."""
    scene = accepted()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    late = scene.running_pod()
    scene.settle()
    scene.objects["pods"].remove(late)
    resume(scene)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 0, 1)


@pytest.mark.parametrize("how", ["taken", "deleted", "gone", "interrupted"])
def test_a_pod_that_had_ended_before_the_suspension_is_a_disruption(how, training, last_word):
    """Something else had ended the pod, so the suspension is not the cause."""
    scene, pod = training()
    if how == "taken":
        scene.take(pod)
    elif how == "deleted":
        scene.delete(pod)
    elif how == "gone":
        scene.objects["pods"].clear()
    else:
        scene.end(pod, 75, last_word())
    scene.settle(15)
    scene.raw["spec"]["suspend"] = True
    scene.settle(15)
    scene.objects["pods"].clear()
    scene.pass_(15)
    resume(scene)
    scene.pass_(15)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 1, 0)


def test_a_failure_before_the_suspension_stays_a_failure(training, last_word):
    """The trainer had failed before the suspension, and the Job has counted the failure."""
    scene, pod = training()
    scene.end(pod, 70, last_word())
    scene.count_failures(1)
    pause(scene, pod)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 1, 0, 0)


def test_a_job_that_is_suspended_twice_before_the_next_pod_has_one_suspension(training):
    """The second suspension ended no pod, and must not turn the first into a disruption."""
    scene, pod = training()
    pause(scene, pod)
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    resume(scene)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (2, 0, 0, 1)


def test_a_mark_is_counted_once(training):
    """The annotation stays on the Job, but it does not name the next pod."""
    scene, pod = training()
    pause(scene, pod)
    taken = scene.running_pod()
    scene.settle()
    scene.take(taken)
    scene.pass_(15)
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (3, 0, 1, 1)


def test_a_suspension_by_somebody_else_after_one_of_ours_goes_by_its_times(training):
    """Kueue writes no annotation, and the old one names an earlier pod, so only the times decide."""
    scene, pod = training()
    pause(scene, pod)
    second = scene.running_pod()
    scene.settle(15)
    scene.objects["pods"].remove(second)
    scene.pass_(15)
    tell_suspension(scene, "False")
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (3, 0, 0, 2)


ENDS = ("failure", "taken", "deleted", "suspended")


@given(st.lists(st.tuples(st.sampled_from(ENDS), st.booleans()), max_size=6))
def test_the_counts_are_those_of_what_happened(accepted, lives):
    """Each pod of a replica ends in some way, and the operator sees only some of the ends.

    The run directory still has a record of a pod that was deleted between two reconciles.
    """
    scene = accepted(backoffLimit=100)
    truth = dict.fromkeys(ENDS, 0)
    failures = 0
    for number, (end, looks) in enumerate(lives):
        pod = scene.running_pod()
        scene.poll(pod, attempt=number + 1, step=number + 1)
        if looks or end == "suspended":
            scene.settle(5)
        failures += _end(scene, pod, end, failures)
        truth[end] += 1
        scene.pass_(15)
        if looks:
            scene.settle()
        scene.pass_(1)
    scene.poll(scene.running_pod(), attempt=len(lives) + 1, step=len(lives) + 1)

    decision = scene.settle(1)

    assert not [each for each in decision.actions if isinstance(each, Stop)]
    counts = scene.restarts()
    assert counts == (len(lives) + 1, truth["failure"], truth["taken"] + truth["deleted"], truth["suspended"])


@given(
    st.lists(
        st.tuples(st.sampled_from(("failure", "taken", "paused", "late")), st.integers(0, 2)), max_size=6
    )
)
def test_suspensions_are_counted_however_fast_they_follow(accepted, lives):
    """The counts of all causes add up to the attempts, and no count decreases."""
    scene = accepted(backoffLimit=100)
    truth, before, failures = dict.fromkeys(("failure", "taken", "paused"), 0), (0, 0, 0, 0), 0
    for end, seconds in lives:
        if end == "late":
            scene.raw["spec"]["suspend"] = True
            scene.settle()
        pod = scene.running_pod()
        scene.settle(seconds)
        if end in {"paused", "late"}:
            pause(scene, pod)
        else:
            failures += _end(scene, pod, end, failures)
            scene.pass_(10)  # the Job controller also waits before it creates the next pod
        truth["paused" if end == "late" else end] += 1
        counts = scene.restarts()
        assert counts[0] == 1 + sum(counts[1:])
        assert all(old <= new for old, new in zip(before, counts, strict=True))
        before = counts
    scene.running_pod()

    scene.settle()

    assert scene.restarts() == (len(lives) + 1, truth["failure"], truth["taken"], truth["paused"])


def _end(scene, pod, end, failures):
    """End a pod, and return the number of failures that the Job counts for it."""
    if end == "failure":
        scene.end(pod, 70)
        scene.count_failures(failures + 1)
        return 1
    if end == "taken":
        scene.take(pod)
        return 0
    scene.objects["pods"].remove(pod)
    if end == "suspended":
        scene.pass_(5)
        tell_suspension(scene, "False")
    return 0
