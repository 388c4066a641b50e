"""The enumerations that trainer and operator share: exit codes, kinds of faults, uses of time, roles."""

from enum import IntEnum, StrEnum

# The failure reason for a trainer that exits with code 0 before its training is complete.
SILENT = "the trainer ended with exit code 0, and did not report that it was complete"


class ExitCode(IntEnum):
    """The exit codes of a trainer; after a code that is not listed here, a retry may help.

    - DONE: the run is complete.
    - CONFIGURATION: the configuration is wrong; do not retry.
    - INTERRUPTED: a signal ended the trainer, or no ROS master responded; retry.
    - FAULT_BUDGET: a simulator failed too often; do not retry.
    - DIVERGED: the learner diverged; do not retry.
    - STALLED: no environment step completed for too long; retry.
    """

    DONE = 0
    CONFIGURATION = 2
    INTERRUPTED = 75
    FAULT_BUDGET = 80
    DIVERGED = 81
    STALLED = 82


class FaultKind(StrEnum):
    """The kinds of a simulator's faults; after the fault SLOW, the trainer does not restart the simulator."""

    DEAD = "dead"
    HUNG = "hung"
    SLOW = "slow"
    WRONG_DATA = "wrong_data"


class Cause(StrEnum):
    """The uses of a trainer's time; every second of an attempt belongs to exactly one use.

    - STEPPING: training waited for a step of the simulators.
    - TRANSPORT: the other parts of a step: requests, reading of messages, the environment.
    - LEARNING: all other work of the algorithm.
    - EVALUATING: the trainer evaluated the policy.
    - CHECKPOINTING: the trainer wrote a checkpoint.
    - STARTING: the time before the first step.
    - RECOVERING: every simulator was broken, or the trainer restored the last state of a resumed run.
    - RECYCLING: a planned restart of a healthy simulator, or a planned reload of its world.
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
    """The purpose of a simulator's episodes: to train the policy, or to evaluate it."""

    COLLECT = "Collect"
    EVALUATE = "Evaluate"
