"""From a job and what was seen of it to its status and what is to be done.

Pure: the clock is passed in. Decisions are lists of small named checks, in order: what keeps a job from
starting (`holds`), how a replica ended (`outcomes`), what is wrong with one (`troubles`) and until when
it has time (`deadlines`).

    job = accept(raw)                                  # Refused: decision = reject(raw, refused, now)
    observed = observe(job, objects)
    planned = prepare(job, observed, layout)           # plans only what is still missing
    decision = decide(job, observed, planned, now)
    # do decision.actions, write as_data(decision.status) if worth_writing(...), then decision.events

Objects are created only after the status that accepts the job was written: it holds the release's
images, so that an upgraded operator plans the same. Terminal replicas are never planned again.
"""

from palaestra.decide.accepting import Refused, accept, managed_here, reject
from palaestra.decide.deciding import decide
from palaestra.decide.decision import (
    Action,
    Create,
    Decision,
    Delete,
    Happening,
    HappeningType,
    SetSuspend,
    Stop,
)
from palaestra.decide.preparing import Prepared, complete, prepare
from palaestra.decide.writing import as_data, worth_writing

__all__ = [
    "Action",
    "Create",
    "Decision",
    "Delete",
    "Happening",
    "HappeningType",
    "Prepared",
    "Refused",
    "SetSuspend",
    "Stop",
    "accept",
    "as_data",
    "complete",
    "decide",
    "managed_here",
    "prepare",
    "reject",
    "worth_writing",
]
