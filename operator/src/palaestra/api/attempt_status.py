"""The history of a replica in the status: last evaluation and attempt, faults, and time by activity.

Kubernetes deletes logs with their pod, so the status keeps the last lines. Every list and text has a maximum
length, because etcd limits the size of an object and people read the status.
"""

from datetime import datetime
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import Count, Fraction, Listed, Sentence, Word
from palaestra.api.model import StatusModel
from palaestra_protocol.pod.status import MOST_FAULTS, MOST_LINE, MOST_LINES

Line = Annotated[str, Field(max_length=MOST_LINE)]
Seconds = Annotated[int, Field(ge=0, le=2_000_000_000)]


class Fault(StatusModel):
    """One fault of one simulator."""

    time: datetime = Field(strict=False)
    """Time at which the trainer detected the fault."""

    simulator: Word
    """Group and number: `collect-0`."""

    kind: Word
    """`dead`, `hung` or `wrong_data`."""

    fact: Line = ""
    """Description of the fault, in a sentence."""

    step: Count
    """Environment steps trained when the trainer detected the fault."""


class LastAttempt(StatusModel):
    """End of the newest attempt that has ended; kept after its pod is deleted."""

    attempt: Count
    """Number of the attempt, from 1."""

    exit_code: Count | None = None
    """Exit code of the trainer; absent: unknown, for example because the pod's node was lost."""

    reason: Word
    """Reason for the end of the attempt, in one word: `Disrupted`, `SimulatorBudgetSpent`, `Succeeded`,
    ..."""

    message: Sentence
    """Reason for the end of the attempt, in a sentence for people."""

    log: Annotated[Listed[Line], Field(max_length=MOST_LINES)] = ()
    """Last lines of the trainer's log, the newest last, each truncated to 200 characters."""

    faults: Annotated[Listed[Fault], Field(max_length=MOST_FAULTS)] = ()
    """Last faults of the attempt's simulators, the newest last."""

    restarts: Count = 0
    """Number of restarts of simulators after faults in this attempt."""


class LastEvaluation(StatusModel):
    """The newest evaluation during training; a confirmation is not an evaluation."""

    step: Count
    """Environment steps trained when the policy was evaluated."""

    success_rate: Fraction | None = None
    """Share of successful episodes, 0 to 1; absent: the environment reports no success."""

    mean_return: float | None = None
    """Mean return of the evaluation's episodes; absent: the trainer reports no returns."""


class Faults(StatusModel):
    """Number of simulator faults by kind, and of slow steps, over all attempts."""

    dead: Count = 0
    """Faults in which a simulator refused or closed a connection."""

    hung: Count = 0
    """Faults in which a simulator did not respond in time."""

    slow: Count = 0
    """Steps that took more than ten times as long as usual and more than 50 ms. Slow steps are not faults and
    cause no restart."""

    wrong_data: Count = 0
    """Faults in which a simulator sent wrong data."""


class Goodput(StatusModel):
    """Time of the trainer by activity, over all attempts, in whole seconds."""

    stepping: Seconds = 0
    """Seconds in which the training thread waited for simulators to compute a step."""

    transport: Seconds = 0
    """Seconds that the same steps took beyond `stepping`: for requests, responses and the environment's
    code."""

    learning: Seconds = 0
    """Seconds spent in the algorithm."""

    evaluating: Seconds = 0
    """Seconds spent on evaluations."""

    checkpointing: Seconds = 0
    """Seconds spent on saving checkpoints."""

    starting: Seconds = 0
    """Seconds before the first step of each attempt."""

    recovering: Seconds = 0
    """Seconds in which training waited because no simulator could step, seconds of steps that ended with a
    fault, and seconds in which a resumed run restored its simulators to their state at the checkpoint."""

    recycling: Seconds = 0
    """Seconds in which training waited for the restart of a healthy simulator that had reached a limit of
    `recycle`, or, with `reset: Reload`, until simulators had loaded their worlds again."""


class MemoryKills(StatusModel):
    """How many times one container was killed because it ran out of memory."""

    container: Word
    """Name of the container: `sim-collect-0` or `trainer`."""

    times: Count
    """Number of kills that the operator observed, over all attempts."""

    limit: Word | None = None
    """Memory limit of the container, as `512Mi`; absent: the container has no limit, so its node ran out of
    memory."""

    last: datetime = Field(strict=False)
    """Time of the last kill, by the node's clock."""

    pod: Word | None = None
    """UID of the pod of the last kill; absent: the status had no room for it."""

    run: Count | None = None
    """Number of restarts that the container had in that pod before the last kill; absent if `pod` is
    absent."""
