"""The enumerations that trainer and operator share: exit codes, kinds of faults, causes of time, roles."""

from enum import IntEnum, StrEnum

# Reason of the failure if a trainer exits with 0 but its training is not complete.
SILENT = "the trainer ended with exit code 0, and did not report that it was complete"


class ExitCode(IntEnum):
    """The exit codes of a trainer; after any other code a retry may help.

    DONE: the run has ended. CONFIGURATION: it is wrong; do not retry. INTERRUPTED: a signal ended it after a
    checkpoint. FAULT_BUDGET: a simulator failed too often; do not retry. DIVERGED: the learner diverged; do
    not retry. STALLED: no environment step for too long; retry.
    """

    DONE = 0
    CONFIGURATION = 2
    INTERRUPTED = 75
    FAULT_BUDGET = 80
    DIVERGED = 81
    STALLED = 82


class FaultKind(StrEnum):
    """The kinds of a simulator's faults; SLOW is only counted, without a restart."""

    DEAD = "dead"
    HUNG = "hung"
    SLOW = "slow"
    WRONG_DATA = "wrong_data"


class Cause(StrEnum):
    """The use of a trainer's time; every second of an attempt has exactly one cause.

    STEPPING: training waited for a step of the simulators. TRANSPORT: the rest of a step: requests, reading,
    the environment. LEARNING: the rest of the algorithm. EVALUATING, CHECKPOINTING: as named. STARTING: until
    the first step. RECOVERING: every simulator was broken, or a resumed run was restored to its last state.
    RECYCLING: a planned restart of a healthy simulator.
    """

    STEPPING = "stepping"
    TRANSPORT = "transport"
    LEARNING = "learning"
    EVALUATING = "evaluating"
    CHECKPOINTING = "checkpointing"
    STARTING = "starting"
    RECOVERING = "recovering"
    RECYCLING = "recycling"


class StandbyState(StrEnum):
    """The states of a simulator's standby."""

    STARTING = "starting"
    READY = "ready"


class Role(StrEnum):
    """The purpose of a simulator's episodes: to learn from, or to evaluate the policy."""

    COLLECT = "Collect"
    EVALUATE = "Evaluate"
