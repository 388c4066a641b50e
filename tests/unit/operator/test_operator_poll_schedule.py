"""The schedule of polls: pods that respond slowly do not delay the others."""

import heapq
from collections import defaultdict
from itertools import pairwise

from palaestra.operator.poll_schedule import PLACES, PollSchedule, PollTarget

PERIOD_S, PROMPT_S, DEADLINE_S = 10.0, 1.0, 3.0


def targets(count, *, namespace="robots", name="answers"):
    """Return poll targets that are trainers of one job."""
    return [
        PollTarget(key=(namespace, name), uid=f"{namespace}-{name}-{index}", host="10.0.0.1", port=1)
        for index in range(count)
    ]


def simulated(followed, *, until_s, seconds=0.01):
    """Return the times of the polls, by uid.

    A pod of the job `silent` does not respond before the deadline.
    """
    schedule, asked, under_way = PollSchedule(PERIOD_S, PROMPT_S, lambda: 0.5), defaultdict(list), []
    schedule.follow(followed, 0.0)
    now_s, met = 0.0, set()
    while now_s < until_s:
        for entry in schedule.due(now_s):
            uid = entry.target.uid
            silent_s = DEADLINE_S if uid in met else PROMPT_S  # the first poll has a shorter deadline
            took_s = silent_s if entry.target.key[1] == "silent" else seconds
            met.add(uid)
            asked[uid].append(now_s)
            heapq.heappush(under_way, (now_s + took_s, len(under_way), id(entry), entry))
        times = [each for each in (schedule.next_s(), under_way[0][0] if under_way else None) if each]
        now_s = min(times)
        while under_way and under_way[0][0] <= now_s:
            schedule.done(heapq.heappop(under_way)[-1], now_s)
    return asked


def test_each_trainer_is_asked_every_period():
    """The period must hold for a thousand trainers, from the start on."""
    asked = simulated(targets(1000), until_s=60.0)

    assert len(asked) == 1000
    assert max(times[0] for times in asked.values()) < 2.0
    assert all(b - a <= PERIOD_S + 0.5 for times in asked.values() for a, b in pairwise(times))


def test_silent_pods_do_not_delay_the_trainers_that_answer():
    """A job has 640 silent pods in the same namespace.

    After their first poll, these pods must delay no other pod.
    """
    ten = targets(10)

    asked = simulated([*targets(640, name="silent"), *ten], until_s=200.0)

    later = [[at for at in asked[each.uid] if at > 60.0] for each in ten]
    assert all(len(times) >= 13 for times in later)
    assert all(b - a <= PERIOD_S + 0.5 for times in later for a, b in pairwise(times))


def test_a_namespace_full_of_silent_pods_does_not_delay_the_first_question_to_others():
    """After a restart the operator does not know yet which pods are silent, so namespaces take turns."""
    ten = targets(10)

    asked = simulated([*targets(640, namespace="theirs", name="silent"), *ten], until_s=5.0)

    assert all(asked[each.uid][0] < 2.5 for each in ten)


def test_a_silent_pod_is_asked_again():
    """The network of a node may fail for an hour and then work again."""
    silent = targets(1, name="silent")

    asked = simulated(silent, until_s=60.0)

    assert len(asked[silent[0].uid]) >= 4


def test_no_more_are_asked_at_once_than_there_are_places():
    """Each response may have 64 KiB, so the number of parallel polls must be limited."""
    schedule = PollSchedule(PERIOD_S, PROMPT_S, lambda: 0.0)
    schedule.follow(targets(1000), 0.0)

    first, second = list(schedule.due(0.0)), list(schedule.due(0.5))

    assert 0 < len(first) <= sum(PLACES.values()) <= 64
    assert second == []


def test_the_answer_of_a_pod_that_went_meanwhile_is_not_used():
    """The pod is deleted during its poll. Its slot must become free, and its response must be ignored."""
    schedule = PollSchedule(PERIOD_S, PROMPT_S, lambda: 0.0)
    schedule.follow(targets(1), 0.0)
    (entry,) = schedule.due(0.0)

    gone = schedule.follow([], 0.5)

    assert gone == [entry.target]
    assert not schedule.done(entry, 1.0)
    assert schedule.next_s() is None


def test_what_is_kept_of_pods_that_went_is_bounded():
    """An operator sees a hundred thousand pods come and go, and must not keep memory for each."""
    schedule = PollSchedule(PERIOD_S, PROMPT_S, lambda: 1.0)

    for second in range(100):
        schedule.follow(targets(50, name=f"job-{second}"), float(second))
        list(schedule.due(float(second)))

    schedule.follow([], 100.0)
    list(schedule.due(200.0))
    assert schedule.next_s() is None
