"""What is kept of a replica's past: how its last attempt ended, what broke, and where the time went.

A pod's logs die with it, so what it said last is kept here, and all of it is bounded: a status is one
object of an API server, which people read.
"""

from datetime import datetime
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import Count, Listed, Sentence, Word
from palaestra.api.model import Reported
from palaestra_sim.protocol.status import MOST_FAULTS, MOST_LINE, MOST_LINES

Line = Annotated[str, Field(max_length=MOST_LINE)]
Seconds = Annotated[int, Field(ge=0, le=2_000_000_000)]


class Fault(Reported):
    """One fault of one simulator."""

    time: datetime = Field(strict=False)
    """When the trainer noticed it."""

    simulator: Word
    """Group and number: `collect-0`."""

    kind: Word
    """`dead`, `hung` or `wrong_data`."""

    fact: Line = ""
    """What happened, in a sentence."""

    step: Count
    """Environment steps learned from by then."""


class LastAttempt(Reported):
    """How the newest attempt that has ended did so; it stays when the pod is gone."""

    attempt: Count
    """Its number, from 1."""

    exit_code: Count | None = None
    """Exit code of the trainer; absent: nobody knows, as when its node was lost."""

    reason: Word
    """Why it ended, in one word: `Disrupted`, `SimulatorBudgetSpent`, `Succeeded`, ..."""

    message: Sentence
    """Why, in a sentence for people."""

    log: Annotated[Listed[Line], Field(max_length=MOST_LINES)] = ()
    """The last lines of the trainer's log, the newest last, each cut to 200 characters."""

    faults: Annotated[Listed[Fault], Field(max_length=MOST_FAULTS)] = ()
    """The last faults of its simulators, the newest last."""

    restarts: Count = 0
    """Simulators that were started again after a fault."""


class Faults(Reported):
    """How often simulators broke, and were slow without breaking, over all attempts."""

    dead: Count = 0
    """Connections were refused or closed."""

    hung: Count = 0
    """No answer in time."""

    slow: Count = 0
    """Steps that took more than ten times as long as usual; they are no faults, and nothing was restarted."""

    wrong_data: Count = 0
    """Answers that cannot be right."""


class Goodput(Reported):
    """What the trainer's time was spent on, over all attempts, in whole seconds."""

    stepping: Seconds = 0
    """Seconds in which simulators computed a step that training waited for."""

    transport: Seconds = 0
    """Seconds of steps that were spent on asking, reading and the environment."""

    learning: Seconds = 0
    """Seconds of the algorithm."""

    evaluating: Seconds = 0
    """Seconds of evaluations."""

    checkpointing: Seconds = 0
    """Seconds of saving."""

    starting: Seconds = 0
    """Seconds until the first step of each attempt."""

    recovering: Seconds = 0
    """Seconds in which every simulator was broken, or a resumed run was brought back to where it was;
    in releases that report no `recycling`, also those of recycling."""

    recycling: Seconds | None = None
    """Seconds in which training waited for a healthy simulator that was being restarted, as `recycle` plans
    it; absent: none, or not reported."""


class MemoryKills(Reported):
    """How often one container was killed for its memory."""

    container: Word
    """Its name: `sim-collect-0` or `trainer`."""

    times: Count
    """How often, over all attempts, as far as it was seen."""

    limit: Word | None = None
    """Its memory limit, as `512Mi`; absent: it has none, so its node ran short."""

    last: datetime = Field(strict=False)
    """When it was killed last, by its node's clock."""

    pod: Word | None = None
    """UID of the pod in which it was killed last; absent: an older release has counted."""

    run: Count | None = None
    """Which run of the container in that pod was killed last, from 0; absent as `pod` is."""
