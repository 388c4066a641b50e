"""Run plans on a control plane, and compare each run with the undisturbed runs of its workload."""

import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from palaestra.cluster import Api
from tests.control_plane.plane import ControlPlane
from tests.faults.attended import AttendedOperator
from tests.faults.course import Course
from tests.faults.masks import Leaves, differences, leaves, mask
from tests.faults.oracle import PodWatch, doubles, end_state, orphans
from tests.faults.plans import Fault, Plan
from tests.faults.proxy import Proxy
from tests.faults.workloads import WORKLOADS, Stage
from tests.integration.operator.installed import USER
from tests.waiting import TooLate

CALL_S = 60.0  # the timeout of one request of the tests, on a busy machine
QUIET_S = 3.0
SETTLES_S = 90.0  # the operator retries a failed action after a minute at most
PACE_S = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """The result of one run of a workload.

    Attributes:
        state: the end state, as leaves.
        counts: the number of the operator's requests by kind.
        met: the request that got the fault, or "" if none did.
        lives: the number of times that the operator was started.
        wrong: a sentence for each violated condition.
        seconds: the duration of the run.
    """

    state: Leaves = field(default_factory=dict)
    counts: Mapping[str, int] = field(default_factory=dict)
    met: str = ""
    lives: int = 1
    wrong: tuple[str, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Undisturbed:
    """The result of a workload without a fault, from two runs.

    Attributes:
        state: the end state of the first run.
        masked: the paths at which the second run differs.
        counts: the operator's requests by kind: the smaller number of both runs.
    """

    state: Leaves
    masked: frozenset[str]
    counts: Mapping[str, int]


class Rig:
    """Runs workloads on a control plane with Palaestra installed; each run has its own namespace.

    Args:
        plane: the control plane.
        api: an administrator's client.
    """

    def __init__(self, plane: ControlPlane, api: Api) -> None:
        self._operators = plane.kubeconfig_of(USER, "system:serviceaccounts")
        self._api = api.within(CALL_S)
        self._undisturbed: dict[str, Undisturbed] = {}
        self._locks = {workload: threading.Lock() for workload in WORKLOADS}

    def undisturbed(self, workload: str) -> Undisturbed:
        """Return the result of a workload without a fault; the first call runs it twice.

        Raises:
                AssertionError: a condition is violated even though no fault occurs.
        """
        with self._locks[workload]:
            if workload not in self._undisturbed:
                first, second = self._run(workload, None, None), self._run(workload, None, None)
                assert not first.wrong + second.wrong, f"{workload}: {first.wrong + second.wrong}"
                self._undisturbed[workload] = Undisturbed(
                    state=first.state,
                    masked=mask(first.state, second.state),
                    counts=Counter(first.counts) & Counter(second.counts),
                )
            return self._undisturbed[workload]

    def run(self, plan: Plan) -> Run:
        """Run a plan and return the result; `wrong` is empty if the end state equals the undisturbed one."""
        return self._run(plan.workload, plan.fault, self.undisturbed(plan.workload))

    def _run(self, workload: str, fault: Fault | None, wanted: Undisturbed | None) -> Run:
        began = time.monotonic()
        course = Course(fault)
        with tempfile.TemporaryDirectory(prefix="faults-") as folder, ExitStack() as stack:
            place = stack.enter_context(Stage(self._api, course))
            operator = stack.enter_context(self._operator(place, course, Path(folder)))
            pods = stack.enter_context(PodWatch(self._api, place.name))
            wrong = _played(place, workload)
            state, unsettled = _settled(place, course, pods, wanted)
            wrong += unsettled + doubles(pods.changes())
            wrong += [f"unforeseen: {line}" for line in operator.unforeseen()]
        return Run(
            state=state,
            counts=course.counts,
            met=course.met,
            lives=operator.lives,
            wrong=tuple(wrong),
            seconds=round(time.monotonic() - began, 1),
        )

    @contextmanager
    def _operator(self, place: Stage, course: Course, folder: Path) -> Iterator[AttendedOperator]:
        """Run an operator behind a proxy until the block ends."""
        proxy = Proxy(self._operators, course)
        options = (f"--namespace={place.name}", "--no-leader-elect")
        attended = AttendedOperator(proxy.kubeconfig(folder / "kubeconfig"), folder, *options)
        proxy.kill = attended.kill
        try:
            with attended:
                yield attended
        finally:
            proxy.close()


def _played(place: Stage, workload: str) -> list[str]:
    """Run a workload's script; return the condition that it did not reach, or an empty list."""
    try:
        WORKLOADS[workload](place)
    except TooLate as late:
        return [f"the script waits in vain: {late}"]
    return []


def _settled(
    place: Stage, course: Course, pods: PodWatch, wanted: Undisturbed | None
) -> tuple[Leaves, list[str]]:
    """Wait until the end state is as wanted and the operator is idle.

    Return the end state, and the conditions that are still violated after the timeout.
    """
    ends = time.monotonic() + SETTLES_S
    while True:
        found = end_state(place, pods.changes())
        state = leaves(found)
        wrong = orphans(found)
        if wanted is not None:
            wrong += differences(wanted.state, state, wanted.masked)
        if course.quiet_s() < QUIET_S:
            wrong.append(f"still asks: {course.last(5)}")
        if not wrong or time.monotonic() > ends:
            return state, wrong
        time.sleep(PACE_S)  # a shorter pace would load the API server
