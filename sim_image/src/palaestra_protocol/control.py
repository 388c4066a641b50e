"""The requests of a trainer to a sidecar, and the sidecar's reports about its simulator.

    POST /start   {}                    start the simulator; the response does not wait for the start
    POST /ready   {}                    the trainer has completed a real round trip with the simulator
    POST /stop    {"deadline_s": 5.0}   the simulator will end; the sidecar kills it after that many seconds
    GET  /state                         return the simulator's state

A sidecar with a standby has the same requests for its second simulator at /standby/start, /standby/ready,
/standby/stop and /standby/state. The trainer decides which of the two simulators it uses.

The response is a `SimulatorState`. Its status is 200, or 409 if the simulator's state does not allow the
request. If the body of the request is wrong, the status is 400 and the response is
{"error": "<field>: <fact>"}.

A user may allow a simulator to leave out the nodes of its world that it cannot simulate. Such a simulator
writes a report before it becomes ready. The environment variable `LEFT_OUT_FILE` names the file. The report
is UTF-8 text with one line for each kind of node. Example: "the stub simulates no Drone: 1 node left out
(collect-0.wbt, line 12)".
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from palaestra_protocol.fields import MOST_NAME, ProtocolError, decoded
from palaestra_protocol.messages import (
    AddedLater,
    Choice,
    Flag,
    JsonMessage,
    JsonRequest,
    Lines,
    Maybe,
    Number,
    Part,
    PartList,
    Text,
    Whole,
)

__all__ = [
    "LastExit",
    "ProtocolError",
    "RobotName",
    "SidecarState",
    "SimulatorState",
    "StopRequest",
    "decoded",
]

STANDBY = "/standby"  # prefix of the paths for the second simulator
LEFT_OUT_FILE = "PALAESTRA_SIMULATOR_LEFT_OUT"
VIEW_SOCKET = "PALAESTRA_SIMULATOR_VIEW"
VIEW_SCENE, VIEW_STATE, VIEW_CAMERA = b"scene", b"state", b"camera"
BATCH_FILE = "PALAESTRA_SIMULATOR_BATCH"  # names the file to which a simulator writes the address `batch`
MOST_LEFT_OUT = 16  # maximum number of lines in a report
LONGEST_LEFT_OUT = 200  # maximum number of characters in a line of a report
MOST_DEADLINE_S = 3600.0
MOST_PATH = 4096
MOST_ROBOTS = 32
MOST_PID = 2**22  # Source: PID_MAX_LIMIT of Linux


class SidecarState(StrEnum):
    """The states of a simulator."""

    IDLE = "idle"
    STARTING = "starting"
    READY = "ready"
    STOPPING = "stopping"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotName(JsonMessage):
    """The names of a robot in the world.

    Attributes:
        robot: the field `name` of the robot.
        ros_name: the name of the robot's ROS node.
        supervisor: whether the robot may change the scene.
        definition: the DEF name of the robot; "" if the world gives it no DEF name.
    """

    robot: Annotated[str, Text(MOST_NAME)]
    ros_name: Annotated[str, Text(MOST_NAME, least=1)]
    supervisor: Annotated[bool, Flag()]
    definition: Annotated[str, Text(MOST_NAME)] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LastExit(JsonMessage):
    """The last end of the simulator: its exit code, or the signal that ended it, such as "SIGBUS".

    If neither is set, the simulator could not be started, or the sidecar did not observe its end. `expected`
    is true if a stop request announced the end. Any other end is a fault.
    """

    code: Annotated[int | None, Maybe(Whole(0, 255))] = None
    signal: Annotated[str | None, Maybe(Text(32, least=1))] = None
    expected: Annotated[bool, Flag()]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorState(JsonMessage):
    """A sidecar's report on its simulator.

    Attributes:
        state: the state of the simulator.
        driver: stub, mujoco, webots or command.
        world: the path of the simulator's world.
        robots: the robots of that world that have a ROS node.
        pid: the process ID of the simulator's first process; None while the simulator does not run.
        starts: number of starts of the simulator since the sidecar started.
        faults: number of times that the simulator ended without a stop request.
        last_exit: the simulator's last end; None if it has not ended yet.
        detail: the reason for this state, in a sentence for people; "" if the state needs no explanation.
        rss_bytes: the memory of the simulator's processes. It is set only in responses to GET while the
            simulator is ready; otherwise None.
        left_out: the nodes that the simulator left out of its world at its last start, in lines for people.
        batch: the address on which the simulator serves many copies of its world; None if the simulator has
            only one copy, or does not listen yet. See `palaestra_protocol.batch`.
    """

    state: Annotated[SidecarState, Choice(SidecarState)]
    driver: Annotated[str, Text(MOST_NAME)]
    world: Annotated[str, Text(MOST_PATH)]
    robots: Annotated[tuple[RobotName, ...], PartList(RobotName, MOST_ROBOTS)] = ()
    pid: Annotated[int | None, Maybe(Whole(1, MOST_PID))] = None
    starts: Annotated[int, Whole()] = 0
    faults: Annotated[int, Whole()] = 0
    last_exit: Annotated[LastExit | None, Maybe(Part(LastExit))] = None
    detail: Annotated[str, Text()] = ""
    rss_bytes: Annotated[int | None, Maybe(Whole())] = None
    left_out: Annotated[tuple[str, ...], Maybe(Lines(LONGEST_LEFT_OUT, MOST_LEFT_OUT))] = ()
    batch: Annotated[str | None, AddedLater(Text(MOST_NAME))] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StopRequest(JsonRequest):
    """Announces that the simulator will end within `deadline_s` seconds; 0 means that it is killed now."""

    deadline_s: Annotated[float, Number(0.0, MOST_DEADLINE_S)]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainRequest(JsonRequest):
    """A request without parameters: `/start` or `/ready`."""
