"""The errors of a trainer; the tree shows for each error whether a retry can help.

TrainerError
├── ConfigurationError   the configuration is wrong; retrying cannot help     exit 2
│   └── RobotUnfit       a real robot must not be driven now                  exit 2
│       └── CameraUnfit  also a NoSuchSensor: no usable image arrives         exit 2
├── UnreadableAnswer     the ROS master or a node sent an invalid ROS response
├── MasterLost           the ROS master is gone; nothing re-registers         exit 75
├── Interrupted          a signal asked the run to end (run.signals)          exit 75
├── Enough               the wanted success rate is reached (run.best_model)  exit 0
├── CallbackFailed       a callback of the job raised an error               exit 1
├── FaultBudgetSpent     a simulator failed too often; don't retry            exit 80
├── Diverged             a loss, weight or reward is not finite; don't retry  exit 81
├── ExportError          an exported policy would act differently; nothing is written
├── NoSuchSensor         this robot does not have the sensor
│   └── MissingCapability  also a ConfigurationError: the task needs it       exit 2
├── NoReading            a sensor was read before its first message arrived
├── NotConforming        a robot breaks a rule of the interface (testing.conformance)
├── Paused               a step was requested while the simulation is paused
├── RobotStopped         a safety rule stopped a real robot; a person decides
├── NewGoal              a person sent another goal (deployment.goals)
├── NotFilmed            an episode has no recording in 3D (episodes.scene_film)
├── LinkError            a real robot did not respond in time, or its response is invalid
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
# A message does not name lines of these libraries, because a mistake of a job's author is in the author's own
# code, even if a library raises the error.
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
    """Return class, text, file and line of an error in the code of a job's author."""
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
    """The ROS master does not respond. Its registrations are lost, and nodes do not register again."""


class UnreadableAnswer(TrainerError, ValueError):
    """The ROS master or a node sent an invalid ROS response.

    Services and topics convert this error to `WrongData`, a fault of their simulator.
    """


class CallbackFailed(TrainerError, RuntimeError):
    """A callback of the job raised an error; `__cause__` holds that error."""


class FaultBudgetSpent(TrainerError, RuntimeError):
    """A simulator failed more often than its restart budget allows."""


class Diverged(TrainerError, ArithmeticError):
    """A reward, an observation, a loss or a weight is NaN or infinite; a retry from this step cannot help."""


class ExportError(TrainerError, RuntimeError):
    """The exported policy acts differently from the policy in model.zip; the file was not written."""


class NoSuchSensor(TrainerError, NotImplementedError):
    """The robot has no such sensor, e.g. no camera."""


class MissingCapability(ConfigurationError, NoSuchSensor):
    """The robot lacks a capability that the task needs."""


class NoReading(TrainerError, RuntimeError):
    """A sensor has not sent a reading yet; its first reading arrives after one sampling period."""


class Paused(TrainerError, RuntimeError):
    """The simulation is paused; a step would block its controller forever.

    The caller made a mistake: the simulator is healthy, so a restart cannot help.
    """


class RobotUnfit(ConfigurationError):
    """A real robot must not be driven now: it does not respond, charges, or another client drives it."""


class CameraUnfit(RobotUnfit, NoSuchSensor):
    """The camera of a real robot sends no image, or no image that can be converted for the policy."""


class RobotStopped(TrainerError, RuntimeError):
    """A safety rule has stopped a real robot; only a person may decide to continue."""


class LinkError(TrainerError, ConnectionError):
    """A real robot did not confirm a request in time, or sent an invalid response."""


class SimulatorFault(TrainerError):
    """One simulator failed; restart only that simulator.

    Attributes:
        simulator: the ROS name or group name of the simulator.
    """

    kind: ClassVar[FaultKind]

    def __init__(self, simulator: str, fact: str) -> None:
        super().__init__(f"{simulator}: {fact}")
        self.simulator = simulator


class SimulatorDead(SimulatorFault, ConnectionError):
    """The simulator refuses connections, or its connections were closed."""

    kind = "dead"


class SimulatorRefused(SimulatorDead):
    """The simulator's process ended with the exit code of a program that refuses its input.

    If two processes in a row fail with the same message before the run's first step, the job is wrong.
    """


class SimulatorHung(SimulatorFault, TimeoutError):
    """The simulator is connected and does not respond within the deadline."""

    kind = "hung"


class WrongData(SimulatorFault, ValueError):
    """The simulator sent invalid data."""

    kind = "wrong_data"


class WorldMisfit(WrongData):
    """The simulator's world lacks a device or node that the program needs.

    The simulator's complete list of devices or its response shows that the device or node is missing. If an
    earlier process had the right world, a restart can help. If two processes in a row lack the device or node
    before the run's first step, the configuration is wrong.
    """
