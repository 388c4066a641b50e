"""In each namespace the worlds of one job at a time are checked, and no worker waits for a check."""

import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import pytest

from palaestra.operator.fair_queue import FairQueue
from palaestra.operator.world_verdicts import MOST_BYTES_HERE, WorldChecker
from palaestra.plan import GivenWorld, WorldVerdict
from tests.waiting import eventually

HEADER = b"#VRML_SIM R2023b utf8\n"
ROBOT = b'Robot{controller "ros"}'
EVIL, GOOD = ("evil", "a"), ("good", "a")


def world(text: bytes = ROBOT, size: int = 0) -> GivenWorld:
    """Return a world with a comment of the given size."""
    return GivenWorld(field="spec.simulators[0].world.inline", source=HEADER + text + b"\n#" + b"-" * size)


def large(number: int = 0) -> GivenWorld:
    """Return a world that is too large to be checked in a worker's thread."""
    return world(ROBOT + b"# %d" % number, MOST_BYTES_HERE)


class Begin(Protocol):
    """The type of the function that starts a checker."""

    def __call__(self, apart: "Slow") -> WorldChecker:
        """Return the checker."""


class Slow:
    """A fake process that finishes each check only when the test allows it."""

    def __init__(self) -> None:
        self.may_end = threading.Semaphore(0)
        self.asked: list[bytes] = []
        self.woken: list[tuple[str, str]] = []
        self.comes_to_nothing = False

    def check(self, worlds: Sequence[GivenWorld]) -> Mapping[str, WorldVerdict]:
        """Return the verdict that all worlds are valid, or no verdict."""
        self.asked += [each.source for each in worlds]
        assert self.may_end.acquire(timeout=60)
        return {} if self.comes_to_nothing else {each.digest: WorldVerdict() for each in worlds}


@pytest.fixture
def slow() -> Iterator[Slow]:
    """Yield a fake process whose checks end with the test at the latest."""
    process = Slow()
    yield process
    process.may_end.release(100)


@pytest.fixture
def begin(monkeypatch: pytest.MonkeyPatch) -> Iterator[Begin]:
    """Return a function that starts a checker.

    The checker ends with the test; a long limit keeps a turn from ending early on a busy machine.
    """
    monkeypatch.setattr("palaestra.operator.world_verdicts.HANDED_S", 60.0)
    begun: list[WorldChecker] = []

    def start(apart: Slow) -> WorldChecker:
        begun.append(WorldChecker(apart.check, apart.woken.append))
        begun[-1].start()
        return begun[-1]

    yield start
    for checking in begun:
        checking.stop()


def hand_over(checking: WorldChecker, slow: Slow, key: tuple[str, str], worlds: Sequence[GivenWorld]) -> None:
    """Request the verdicts of a job, and request them again when the checker has queued the job."""
    woken = slow.woken.count(key)
    assert checking.verdicts(key, worlds) == {}
    eventually(lambda: slow.woken.count(key) > woken)
    assert checking.verdicts(key, worlds) == {}


def test_a_small_world_is_checked_at_once(begin: Begin, slow: Slow) -> None:
    """To start a process takes longer than the check of a small world."""
    checking = begin(slow)
    fine, wrong = world(), world(b"A{}")

    found = checking.verdicts(EVIL, [fine, wrong])

    assert found[fine.digest] == WorldVerdict()
    assert found[wrong.digest].problem.startswith("spec.simulators[0].world.inline:1:1: ")
    assert slow.asked == []


def test_many_small_worlds_of_a_job_are_not(begin: Begin, slow: Slow) -> None:
    """The size limit applies to the sum of a job's worlds, and a job may have 32."""
    worlds = [world(ROBOT + b"# %d" % number, MOST_BYTES_HERE // 2) for number in range(3)]

    assert begin(slow).verdicts(EVIL, worlds) == {}


def test_a_verdict_queues_the_job_and_is_remembered(begin: Begin, slow: Slow) -> None:
    """The next reconcile plans the job, and later reconciles need no check."""
    checking, given = begin(slow), large()
    hand_over(checking, slow, EVIL, [given])
    assert checking.waits(EVIL)

    slow.may_end.release()

    eventually(lambda: slow.woken == [EVIL, EVIL])
    assert not checking.waits(EVIL)
    assert checking.verdicts(EVIL, [given]) == {given.digest: WorldVerdict()}
    assert slow.asked == [given.source]


def test_one_namespace_does_not_keep_another_waiting(begin: Begin, slow: Slow) -> None:
    """Thirty jobs of one namespace wait for each other, and the other namespace gets its turn."""
    checking = begin(slow)
    hand_over(checking, slow, EVIL, [large(0)])
    for number in range(1, 30):
        checking.verdicts(("evil", f"job-{number}"), [large(number)])

    hand_over(checking, slow, GOOD, [large(100)])

    eventually(lambda: len(slow.asked) == 2)
    assert slow.asked[1] == large(100).source
    assert checking.waits(("evil", "job-1"))


def test_namespaces_take_turns() -> None:
    """With more namespaces than parallel checks, each must get its first turn before any gets a second."""
    turns = FairQueue()
    for key in [("a", "1"), ("a", "2"), ("b", "1"), ("b", "2"), ("c", "1")]:
        turns.hand_over(key, [large()])

    keys = []
    for _ in range(5):
        turn = turns.next()
        assert turn is not None
        keys.append(turn.key)
        turns.end(turn)

    assert keys == [("a", "1"), ("b", "1"), ("c", "1"), ("a", "2"), ("b", "2")]


def test_a_job_that_is_gone_gives_its_turn_up(begin: Begin, slow: Slow) -> None:
    """A deleted job never hands its worlds over, so the next job of its namespace would wait for ever."""
    checking = begin(slow)
    checking.verdicts(EVIL, [large()])
    eventually(lambda: slow.woken == [EVIL])
    checking.verdicts(("evil", "b"), [large(1)])

    checking.forget(EVIL)

    eventually(lambda: slow.woken == [EVIL, ("evil", "b")])


def test_a_job_that_is_gone_leaves_the_line(begin: Begin, slow: Slow) -> None:
    """The checker must not keep data of a deleted job."""
    checking = begin(slow)
    hand_over(checking, slow, EVIL, [large()])
    checking.verdicts(("evil", "b"), [large(1)])

    checking.forget(("evil", "b"))

    assert not checking.waits(("evil", "b"))


def test_a_check_without_a_verdict_is_tried_again(
    begin: Begin, slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A check may fail because the node lacks time or memory, although the world is valid."""
    monkeypatch.setattr("palaestra.operator.world_verdicts.PAUSE_S", 0.0)
    checking, slow.comes_to_nothing = begin(slow), True
    hand_over(checking, slow, EVIL, [large()])

    slow.may_end.release()

    eventually(lambda: slow.woken == [EVIL, EVIL])
    slow.comes_to_nothing = False
    hand_over(checking, slow, EVIL, [large()])
    slow.may_end.release()
    eventually(lambda: checking.verdicts(EVIL, [large()]))


def test_so_many_verdicts_are_remembered_and_no_more(
    begin: Begin, slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A user may change a ConfigMap any number of times, and the verdicts must not fill the memory."""
    monkeypatch.setattr("palaestra.operator.world_verdicts.REMEMBERED", 1)
    checking = begin(slow)
    for given in (large(0), large(1)):
        hand_over(checking, slow, EVIL, [given])
        slow.may_end.release()
        eventually(lambda given=given: checking.verdicts(EVIL, [given]))

    assert checking.verdicts(EVIL, [large(1)])
    assert checking.verdicts(EVIL, [large(0)]) == {}
