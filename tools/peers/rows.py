"""The comparisons of docs/explain/peers.md: their rows, limits, and reasons for a loss."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Figures = Mapping[str, Any]
Get = Callable[[Figures], float]
STEP_PROFILE = "[where a step's time goes](speed.md#the-floor)"
RESTARTS = "[the measured figures](reliability.md#figures)"
RUN_PROFILE = "[a whole run](speed.md#a-whole-run)"
AFTER_A_FAULT = (
    "After a fault, the trainer waits until the sidecar has started a new simulator, and connects to it: "
    f"{RESTARTS}."
)
LOOP = "the same run without restarts, in a loop"
SUBPROC = "Stable-Baselines3 with `SubprocVecEnv`"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One comparison: a figure of Palaestra's, and the same figure of another program.

    Attributes:
        what: the compared figure, and the other program.
        ours: returns Palaestra's figure.
        theirs: returns the other program's figure.
        unit: the unit of both figures.
        more_is_better: whether the larger figure is the better one.
    """

    what: str
    ours: Get
    theirs: Get
    unit: str
    more_is_better: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Chapter:
    """The comparisons of one part of the benchmark.

    Attributes:
        part: the name of the part, which is its key in the file of figures.
        title: the heading.
        text: sentences before the table.
        rows: returns the rows of the table for the recorded figures.
        limit: a sentence about the limits of the comparison.
        reason: the reason for the rows in which Palaestra's figure is worse, with a link to a profile.
    """

    part: str
    title: str
    text: str
    rows: Callable[[Figures], Sequence[Row]]
    limit: str
    reason: str


def at(*path: str) -> Get:
    """Return a function that reads a figure at a path of names."""

    def get(figures: Figures) -> float:
        found: Any = figures
        for name in path:
            found = found[name]
        return float(found)

    return get


def _of_steps(ours: str, theirs: str, peer: str) -> Sequence[Row]:
    """Return the rows of the median and of the 99th percentile of two clients' steps."""
    names = {"median_us": "median", "p99_us": "99th percentile"}
    return [
        Row(
            what=f"{peer}: {name}",
            ours=at(ours, figure),
            theirs=at(theirs, figure),
            unit="us",
        )
        for figure, name in names.items()
    ]


def _of_collection(figures: Figures) -> Sequence[Row]:
    """Return a row for each number of simulators and duration of their steps."""
    return [
        Row(
            what=f"{SUBPROC}; simulators: {each} a step",
            ours=at("steps_per_second", each, "synchronous"),
            theirs=at("steps_per_second", each, "subproc"),
            unit="steps/s",
            more_is_better=True,
        )
        for each in figures["steps_per_second"]
    ]


def _of_goodput(figures: Figures) -> Sequence[Row]:
    """Return a row for each other way of training and each number of faults above 0."""
    return [
        Row(
            what=f"{name}; faults in a scaled hour: {faults}",
            ours=at("share", "palaestra", faults),
            theirs=at("share", way, faults),
            unit="of the steps without faults",
            more_is_better=True,
        )
        for way, name in (("without_restarts", LOOP), ("subproc", f"{SUBPROC}, in a loop"))
        for faults in figures["share"][way]
        if faults != "0"
    ]


def always(*rows: Row) -> Callable[[Figures], Sequence[Row]]:
    """Return a function that returns these rows for any figures."""
    return lambda _: rows


CHAPTERS = (
    Chapter(
        part="clients",
        title="A step over ROS",
        text=(
            "Each client takes the same step in the same simulator, in turns: three wheel commands, one "
            "`time_step`, two requests for the pose, ten sensors. "
            "The robot's facade decodes and checks all values. The vector environment of a training also "
            "computes observation and reward."
        ),
        rows=always(
            *_of_steps("robot", "raw", "the facade and raw sockets"),
            *_of_steps("robot", "rospy_persistent", "the facade and rospy with persistent connections"),
            *_of_steps("robot", "rospy", "the facade and rospy with a connection for each call"),
            *_of_steps("environment", "raw", "the vector environment and raw sockets"),
        ),
        limit=(
            "The raw sockets decode nothing and rospy decodes no sensor, so both do less than Palaestra's "
            "clients; the simulator is the stub on the same machine."
        ),
        reason=f"Raw sockets are a floor that no client reaches which also decodes messages: {STEP_PROFILE}.",
    ),
    Chapter(
        part="collection",
        title="Steps of several simulators",
        text="Both step the same facades of the same stubs, with a policy that costs nothing.",
        rows=_of_collection,
        limit=(
            "Each stub sleeps in a step instead of computing, so the table shows how well waits overlap, and "
            "not how simulators share processors."
        ),
        reason=(
            "Palaestra steps all simulators in one thread, and `SubprocVecEnv` has a process for each; on "
            "many processors these processes compute at the same time: [decision 0006]"
            f"(../decisions/0006-turns-instead-of-threads.md) and {STEP_PROFILE}."
        ),
    ),
    Chapter(
        part="plain",
        title="A whole run",
        text=(
            "All programs train `move-to-target.yaml` with the same algorithm, steps, evaluations and "
            "confirmation. Plain Stable-Baselines3 computes the task in its own process, without a "
            "simulator. With `SubprocVecEnv` it steps the same two stubs over the same facade."
        ),
        rows=always(
            Row(
                what="plain Stable-Baselines3",
                ours=at("seconds"),
                theirs=at("plain_seconds"),
                unit="s",
            ),
            Row(what=SUBPROC, ours=at("seconds"), theirs=at("subproc_seconds"), unit="s"),
        ),
        limit=(
            "The other programs write no replays and no report, and cannot resume exactly; one run of each, "
            "one after the other."
        ),
        reason=f"The parts of the difference are in {RUN_PROFILE}.",
    ),
    Chapter(
        part="startup",
        title="From a command to the first step",
        text=(
            "`palaestra run` plans the job and starts ROS master, sidecar and trainer (runner). The trainer "
            "imports its libraries and reads its files (trainer). Then it waits for the simulator, connects "
            "and steps (first step). The other program is Stable-Baselines3 with `SubprocVecEnv` over one "
            "stub."
        ),
        rows=always(Row(what=SUBPROC, ours=at("palaestra_s"), theirs=at("subproc_s"), unit="s")),
        limit=(
            "All files are in the cache of the file system, and both use one stub, which starts in half a "
            "second; a large simulator takes much longer in both."
        ),
        reason=(
            "The runner is a program of its own, which checks and plans the job before the trainer's imports "
            f"begin: {RUN_PROFILE}."
        ),
    ),
    Chapter(
        part="recoveries",
        title="After a crash of the simulator",
        text=(
            "The only simulator of a training is killed. The table has the seconds until the training steps "
            "again. `palaestra run` restarts the simulator. The loops start a program again as soon as it "
            "ends: the same run with a `restart.limit` of 0, and Stable-Baselines3, whose `SubprocVecEnv` "
            "raises an EOFError."
        ),
        rows=always(
            Row(
                what=f"{LOOP}: median",
                ours=at("palaestra", "median"),
                theirs=at("without_restarts", "median"),
                unit="s",
            ),
            Row(
                what=f"{SUBPROC}, in a loop: median",
                ours=at("palaestra", "median"),
                theirs=at("subproc", "median"),
                unit="s",
            ),
            Row(
                what=f"{SUBPROC}, in a loop; here with a standby: median",
                ours=at("standby", "median"),
                theirs=at("subproc", "median"),
                unit="s",
            ),
            Row(
                what=f"{SUBPROC}, in a loop: longest",
                ours=at("palaestra", "most"),
                theirs=at("subproc", "most"),
                unit="s",
            ),
        ),
        limit=(
            "The loops start a program at once; a Job of Kubernetes waits 10 s before the first restart of a "
            "pod, and up to 5 minutes before a later one."
        ),
        reason=AFTER_A_FAULT,
    ),
    Chapter(
        part="goodput",
        title="Goodput with faults",
        text=(
            "The only simulator is killed at equal distances. The table has the steps that remain after a "
            "scaled hour, as a share of the same program's steps without faults. Steps that are lost and "
            "made again count once. 40 s stand for an hour, so a restart costs a 90 times larger share than "
            "in a real hour."
        ),
        rows=_of_goodput,
        limit=(
            "With the same checkpoint interval of 500 steps; at ten faults in a scaled hour, a program that "
            "starts for some seconds hardly trains, which a real hour would not show."
        ),
        reason=AFTER_A_FAULT,
    ),
)
