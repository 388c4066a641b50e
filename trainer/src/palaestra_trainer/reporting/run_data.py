"""The data of a report. A text may contain any characters, and every number is finite."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palaestra_protocol.scene import PoseNumbers, VisibleScene

Points = tuple[tuple[float, float], ...]  # step and value


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluated:
    """One evaluation or confirmation.

    Attributes:
        step: the step of the run at which the policy was evaluated.
        success_rate: share of successful episodes, 0 to 1; None: the environment does not report success.
        low: lower bound of the rate's 95 % interval; None if the rate is None.
        high: upper bound of the rate's 95 % interval; None if the rate is None.
        returns: return of each episode: the sum of its rewards.
        mean_length: mean number of steps of an episode.
    """

    step: float
    success_rate: float | None = None
    low: float | None = None
    high: float | None = None
    returns: tuple[float, ...] = ()
    mean_length: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedFault:
    """One fault of a simulator.

    Attributes:
        time: time at which the trainer detected the fault.
        step: step of the run at that time.
        simulator: name of the simulator.
        kind: kind of the fault, `dead`, `hung` or `wrong_data`.
        fact: message of the fault.
        steps_lost: steps of the episode that the fault truncated.
        seconds: seconds from the fault until the simulator was up again; None: the simulator was not up again
            in that attempt.
    """

    time: str
    step: float
    simulator: str
    kind: str
    fact: str
    steps_lost: float = 0
    seconds: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceReplay:
    """A recorded episode in three dimensions.

    Attributes:
        scene: the visible shapes of the world.
        nodes: the numbers of the scene's nodes that move in the episode.
        frames: for each frame, the pose of each of these nodes, at equal intervals of simulated time.
    """

    scene: VisibleScene
    nodes: tuple[int, ...]
    frames: tuple[tuple[PoseNumbers, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """One recorded episode of an evaluation.

    Attributes:
        title: the reason for choosing the episode, such as the best or the median return.
        facts: return, length, outcome and seed of the episode, as one text.
        poses: x and y in meters and heading in radians, for each frame.
        frame_s: seconds of simulated time from one frame to the next.
        targets: positions of the target, each as the number of the first frame with this position, and x and
            y in meters.
        low: smallest x and y of the floor in meters; None: unknown.
        high: greatest x and y of the floor in meters; None: unknown.
        outlines: obstacles, each as x, y, half length, half width and radius of the rounding in meters, and
            heading in radians.
        radius_m: radius of the circle that stands for the robot.
        space: the episode in three dimensions; None: it was not recorded.
        not_in_space: the reason for which the episode was not recorded in three dimensions; "" if unknown.
    """

    title: str
    facts: str
    poses: tuple[tuple[float, float, float], ...]
    frame_s: float
    targets: tuple[tuple[int, float, float], ...] = ()
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    outlines: tuple[tuple[float, float, float, float, float, float], ...] = ()
    radius_m: float = 0.1
    space: SpaceReplay | None = None
    not_in_space: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunData:
    """The data of one run, or of one deployment on a real robot.

    Attributes:
        name: name of the job and number of the replica.
        ended: `good`, `interrupted`, `failed`, or `open` if the end is not known.
        end: the end of the run in words.
        figures: name and value of each main result, in the order of the page.
        asked: name and value of each setting of the job, in the order of the page.
        versions: name and version of the programs and the machine.
        evaluations: the regular evaluations of the policy, in the order of steps.
        confirmations: the evaluations of chosen policies with other seeds (`confirmEpisodes`), in the order
            of steps.
        curves: step and value of each point of each curve, by the name of the curve.
        faults: faults of simulators, in the order of time.
        fault_count: number of all faults of the run; `faults` may have fewer.
        decisions: time and text of each decision of a deployment, which has no simulators and so no faults.
        goodput: seconds of the run under each cause of `GoodputLedger`.
        checkpoints: step, size and time of each checkpoint, as texts.
        attempts: start and reason of each attempt, as texts.
        replays: recorded episodes of one evaluation.
        replayed: the evaluation that recorded the episodes, in words.
        repeat: sentences and commands to repeat the run.
        files: name and text of the files in the report.
    """

    name: str
    ended: str = "open"
    end: str = ""
    figures: Mapping[str, str] = field(default_factory=dict)
    asked: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    evaluations: tuple[Evaluated, ...] = ()
    confirmations: tuple[Evaluated, ...] = ()
    curves: Mapping[str, Points] = field(default_factory=dict)
    faults: tuple[ReportedFault, ...] = ()
    fault_count: int = 0
    decisions: tuple[tuple[str, str], ...] = ()
    goodput: Mapping[str, float] = field(default_factory=dict)
    checkpoints: tuple[tuple[str, str, str], ...] = ()
    attempts: tuple[tuple[str, str], ...] = ()
    replays: tuple[Replay, ...] = ()
    replayed: str = ""
    repeat: tuple[tuple[str, str], ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)


FromJson = Mapping[str, Any]
