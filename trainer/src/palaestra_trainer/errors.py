"""What can go wrong in a trainer, and whether trying again can help.

TrainerError
├── ConfigurationError   the configuration is wrong; retrying cannot help     exit 2
├── UnreadableAnswer     the ROS master or a node answered with no answer of ROS
├── MasterLost           the ROS master is gone; nothing re-registers         exit 75
├── FaultBudgetSpent     a simulator failed too often; don't retry            exit 80
├── Diverged             a number of the learner's is none; don't retry       exit 81
├── NoSuchSensor         this robot does not have it
├── NoReading            a robot was asked before its sensors have told anything
├── Paused               a step was asked for while the simulation is paused
└── SimulatorFault       one simulator broke; restart it and go on
    ├── SimulatorDead    its connections are refused or were closed
    ├── SimulatorHung    it is connected and does not answer in time
    └── WrongData        it answered, with something that cannot be right
        └── WorldMisfit  its world lacks a device or node that the program needs
"""

from __future__ import annotations

from typing import ClassVar, Literal

FaultKind = Literal["dead", "hung", "wrong_data"]


class TrainerError(Exception):
    """Everything this package raises on purpose."""


class ConfigurationError(TrainerError, ValueError):
    """The configuration is wrong, so retrying cannot help."""


class MasterLost(TrainerError, ConnectionError):
    """The ROS master does not answer: names are lost and nothing registers again."""


class UnreadableAnswer(TrainerError, ValueError):
    """The ROS master or a node answered with something that is no answer of ROS.

    Services and topics raise it as a fault of the simulator that they belong to.
    """


class FaultBudgetSpent(TrainerError, RuntimeError):
    """A simulator failed more often than its restart limit allows."""


class Diverged(TrainerError, ArithmeticError):
    """A number of the environment, a loss or a weight is NaN or infinite; retrying from here cannot help."""


class NoSuchSensor(TrainerError, NotImplementedError):
    """The robot has no such sensor, e.g. no camera."""


class NoReading(TrainerError, RuntimeError):
    """A sensor has told nothing yet; the first readings come with the first period."""


class Paused(TrainerError, RuntimeError):
    """The simulation is paused, and a step would block its controller for ever.

    A mistake of the caller: the simulator is well, and restarting it cannot help.
    """


class SimulatorFault(TrainerError):
    """One simulator broke; it alone is to be restarted.

    Attributes:
        simulator: the ROS name or group name of the simulator.
    """

    kind: ClassVar[FaultKind]

    def __init__(self, simulator: str, fact: str) -> None:
        super().__init__(f"{simulator}: {fact}")
        self.simulator = simulator


class SimulatorDead(SimulatorFault, ConnectionError):
    """Its connections are refused or were closed."""

    kind = "dead"


class SimulatorHung(SimulatorFault, TimeoutError):
    """It is connected and does not answer within the deadline."""

    kind = "hung"


class WrongData(SimulatorFault, ValueError):
    """It answered with data that cannot be right."""

    kind = "wrong_data"


class WorldMisfit(WrongData):
    """Its world lacks a device or node that the program needs, by a complete list or a definite answer.

    A fault like others where the world was right before. Where the second process in a row says so before a
    run's first step, the configuration is wrong.
    """
