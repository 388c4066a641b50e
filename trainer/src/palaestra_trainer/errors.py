"""The errors of a trainer, and whether a retry can help.

TrainerError
├── ConfigurationError   the configuration is wrong; retrying cannot help     exit 2
├── UnreadableAnswer     the ROS master or a node sent an invalid ROS response
├── MasterLost           the ROS master is gone; nothing re-registers         exit 75
├── Interrupted          a signal asked the run to end (run.signals)          exit 75
├── Enough               the wanted success rate is reached (run.best_model)  exit 0
├── CallbackFailed       a callback of the job raised an error               exit 1
├── FaultBudgetSpent     a simulator failed too often; don't retry            exit 80
├── Diverged             a loss, weight or reward is not finite; don't retry  exit 81
├── ExportError          an exported policy would act differently; nothing is written
├── NoSuchSensor         this robot does not have it
│   └── MissingCapability  a ConfigurationError too: the task needs it        exit 2
├── NoReading            a sensor was read before its first message arrived
├── NotConforming        a robot breaks a rule of the interface (testing.conformance)
├── Paused               a step was requested while the simulation is paused
└── SimulatorFault       one simulator failed; restart it and continue
    ├── SimulatorDead    its connections are refused or were closed
    │   └── SimulatorRefused  its process ended with the exit code of a wrong input
    ├── SimulatorHung    it is connected and does not respond in time
    └── WrongData        it sent invalid data
        └── WorldMisfit  its world lacks a device or node that the program needs
"""

from __future__ import annotations

import traceback
from typing import ClassVar, Literal

FaultKind = Literal["dead", "hung", "wrong_data"]
# Lines of these libraries do not show the mistake of a job's author: they only call the author's code, or
# are called by it.
_LIBRARIES = {
    "gymnasium",
    "importlib",
    "numpy",
    "palaestra_trainer",
    "sb3_contrib",
    "stable_baselines3",
    "torch",
}


def fact_of(error: BaseException) -> str:
    """Return class, text, file and line of an error that the code of a job's author raised."""
    fact = f"{type(error).__name__}: {error}"
    frames = (
        (frame.f_globals.get("__name__", "").partition(".")[0], frame.f_code.co_filename, line)
        for frame, line in traceback.walk_tb(error.__traceback__)
    )
    lines = [f"{file} line {line}" for package, file, line in frames if package not in _LIBRARIES]
    return f"{fact}, in {lines[-1]}" if lines else fact


class TrainerError(Exception):
    """The base of all errors that this package raises on purpose."""


class ConfigurationError(TrainerError, ValueError):
    """The configuration is wrong, so retrying cannot help."""


class MasterLost(TrainerError, ConnectionError):
    """The ROS master does not respond; its names are lost and nodes do not register again."""


class UnreadableAnswer(TrainerError, ValueError):
    """The ROS master or a node sent an invalid ROS response.

    Services and topics convert it to `WrongData`, a fault of the simulator that they belong to.
    """


class CallbackFailed(TrainerError, RuntimeError):
    """A callback of the job raised an error, which is the `__cause__` of this one."""


class FaultBudgetSpent(TrainerError, RuntimeError):
    """A simulator failed more often than its restart budget allows."""


class Diverged(TrainerError, ArithmeticError):
    """A number of the environment, a loss or a weight is NaN or infinite; retrying from here cannot help."""


class ExportError(TrainerError, RuntimeError):
    """The exported policy acts differently from the policy in model.zip; nothing was written."""


class NoSuchSensor(TrainerError, NotImplementedError):
    """The robot has no such sensor, e.g. no camera."""


class MissingCapability(ConfigurationError, NoSuchSensor):
    """The robot lacks a capability that the task needs."""


class NoReading(TrainerError, RuntimeError):
    """A sensor has sent no reading yet; the first readings arrive with its first sampling period."""


class Paused(TrainerError, RuntimeError):
    """The simulation is paused; a step would block its controller forever.

    This is a mistake of the caller: the simulator is healthy, and a restart cannot help.
    """


class SimulatorFault(TrainerError):
    """One simulator failed; restart only that one.

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


class SimulatorRefused(SimulatorDead):
    """Its process ended with the exit code by which a program refuses its input.

    If two processes in a row fail with the same message before the run's first step, the job is wrong.
    """


class SimulatorHung(SimulatorFault, TimeoutError):
    """It is connected and does not respond within the deadline."""

    kind = "hung"


class WrongData(SimulatorFault, ValueError):
    """It sent invalid data."""

    kind = "wrong_data"


class WorldMisfit(WrongData):
    """Its world lacks a device or node that the program needs, as a complete list or a clear response shows.

    If an earlier process had a right world, this is a fault like others. If two processes in a row report it
    before the run's first step, the configuration is wrong.
    """
