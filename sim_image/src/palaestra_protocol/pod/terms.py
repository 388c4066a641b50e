"""The words that a trainer and an operator have in common: ends, faults, causes, roles."""

from enum import IntEnum, StrEnum


class ExitCode(IntEnum):
    """How a trainer ends; anything else is unexpected and may be tried again.

    DONE: the run has ended. CONFIGURATION: it is wrong, don't retry. INTERRUPTED: by a signal, and
    a checkpoint was written. FAULT_BUDGET: a simulator failed too often, don't retry. DIVERGED: the
    learner did, don't retry. STALLED: no environment step for too long, retry.
    """

    DONE = 0
    CONFIGURATION = 2
    INTERRUPTED = 75
    FAULT_BUDGET = 80
    DIVERGED = 81
    STALLED = 82


class FaultKind(StrEnum):
    """What a simulator did wrong; SLOW is counted only, and mended by nobody."""

    DEAD = "dead"
    HUNG = "hung"
    SLOW = "slow"
    WRONG_DATA = "wrong_data"


class Cause(StrEnum):
    """What a trainer's time was spent on; every second of an attempt has exactly one of these.

    STEPPING: simulators computed a step that training waited for. TRANSPORT: the rest of a step:
    asking, reading, the environment. LEARNING: all that the algorithm does besides. EVALUATING,
    CHECKPOINTING: as named. STARTING: until the first step. RECOVERING: every simulator was broken, or
    a resumed run was brought back to where it had been. RECYCLING: a healthy simulator was being
    restarted, as planned; older releases count it as recovering.
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
    """Whether a simulator's spare could take its place now."""

    STARTING = "starting"
    READY = "ready"


class Role(StrEnum):
    """What a simulator's episodes are for: to learn from, or to measure the policy."""

    COLLECT = "Collect"
    EVALUATE = "Evaluate"
