"""From a job and what was seen of it to its status and what is to be done.

Pure: the clocks are passed in. Decisions are lists of small named checks, in order: what keeps a job from
starting (`holds`), and in `judging` how a replica is judged: how it ended, what ends it, what gets it a new
pod, and what it waits for.

    job = accept(raw)                                  # Refused: decision = reject(raw, refused, now)
    observed = observe(job, objects)
    planned = prepare(job, observed, layout)           # plans only what is still missing
    decision = decide(job, observed, planned, Times(now=..., clock_s=..., record=...))
    # do decision.actions, write fitted(raw, as_data(decision.status)) if write_in_s(...) is 0, then
    # decision.events;
    # decision.record is for the next look

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
    Discard,
    Happening,
    HappeningType,
    Replace,
    SetSuspend,
    Stop,
)
from palaestra.decide.fitting import fitted
from palaestra.decide.preparing import Prepared, complete, prepare, resuming, wants_whole
from palaestra.decide.times import Record, Times
from palaestra.decide.writing import as_data, write_in_s

__all__ = [
    "Action",
    "Create",
    "Decision",
    "Delete",
    "Discard",
    "Happening",
    "HappeningType",
    "Prepared",
    "Record",
    "Refused",
    "Replace",
    "SetSuspend",
    "Stop",
    "Times",
    "accept",
    "as_data",
    "complete",
    "decide",
    "fitted",
    "managed_here",
    "prepare",
    "reject",
    "resuming",
    "wants_whole",
    "write_in_s",
]
