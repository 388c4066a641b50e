"""Decide a job's status, actions and events from the job and an observation of the cluster.

This package is pure: the clocks are arguments. A decision is an ordered list of small named checks. `HOLDS`
in `preconditions` lists the checks that can keep a job from starting. `replica_policy` lists the checks of a
replica.

    job = accept(raw)                                  # JobRefused: decision = reject(raw, refused, now)
    observed = observe(job, objects)
    # add the verdicts of worlds_to_check(job, observed, layout) to the observation
    planned = prepare(job, observed, layout)           # plans only what is still missing
    decision = decide(job, observed, planned, Times(now=..., clock_s=..., record=...))
    # do decision.actions, write fitted(raw, as_data(decision.status)) if write_in_s(...) is 0, then
    # emit decision.events;
    # decision.record is for the next reconcile

Objects are created only after the status that accepts the job was written. That status stores the release's
images, so that an upgraded operator makes the same plan. Terminal replicas are never planned again.
"""

from palaestra.decide.clocks import ReconcileRecord, Times
from palaestra.decide.decision import (
    Action,
    Create,
    Decision,
    Delete,
    Discard,
    EmittedEvent,
    EventType,
    Replace,
    SetSuspend,
    Stop,
)
from palaestra.decide.job_decision import decide
from palaestra.decide.preconditions import (
    Prepared,
    complete,
    lacking_claims,
    prepare,
    resuming,
    wants_whole,
    worlds_to_check,
)
from palaestra.decide.status_write import as_data, fitted, write_in_s
from palaestra.decide.validation import JobRefused, accept, managed_here, reject

__all__ = [
    "Action",
    "Create",
    "Decision",
    "Delete",
    "Discard",
    "EmittedEvent",
    "EventType",
    "JobRefused",
    "Prepared",
    "ReconcileRecord",
    "Replace",
    "SetSuspend",
    "Stop",
    "Times",
    "accept",
    "as_data",
    "complete",
    "decide",
    "fitted",
    "lacking_claims",
    "managed_here",
    "prepare",
    "reject",
    "resuming",
    "wants_whole",
    "worlds_to_check",
    "write_in_s",
]
