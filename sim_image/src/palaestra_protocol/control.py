"""The requests of a trainer to a sidecar, and the sidecar's reports about its simulator.

    POST /start   {}                    start it; the response does not wait for it
    POST /ready   {}                    it has completed a real round trip
    POST /stop    {"deadline_s": 5.0}   it will end; it is killed after that many seconds
    GET  /state

A sidecar with a standby has the same requests for its second simulator at /standby/start, /standby/ready,
/standby/stop and /standby/state. The trainer decides which of the two it uses.

The response is a `SimulatorState` with status 200, or 409 if the state does not allow the request. If the
body is wrong, the status is 400 and the body is {"error": "<field>: <fact>"}.

A simulator may leave out nodes of its world that it cannot simulate, if its user allowed that. Before it
becomes ready, it then writes the whole file that the environment variable `LEFT_OUT_FILE` names: UTF-8, with
one line for each kind of node. Example: "the stub simulates no Drone: 1 node left out (collect-0.wbt, line
12)".
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

from palaestra_protocol.fields import (
    MOST_NAME,
    Fields,
    ProtocolError,
    clipped,
    decoded,
    enumerated,
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
MOST_LEFT_OUT = 16  # lines
LONGEST_LEFT_OUT = 200  # characters of such a line
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
class RobotName:
    """The names of a robot in the world.

    `robot` is its Robot.name, `ros_name` the name of its ROS node, `supervisor` whether it may change
    the scene. `definition` is its DEF name; "": it has none.
    """

    robot: str
    ros_name: str
    supervisor: bool
    definition: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {
            "robot": clipped(self.robot, MOST_NAME),
            "ros_name": clipped(self.ros_name, MOST_NAME),
            "supervisor": self.supervisor,
            "definition": clipped(self.definition, MOST_NAME),
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            robot=fields.text("robot", MOST_NAME),
            ros_name=fields.text("ros_name", MOST_NAME, least=1),
            supervisor=fields.flag("supervisor"),
            definition=fields.text("definition", MOST_NAME),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LastExit:
    """The last end of the simulator: its exit code, or its signal such as "SIGBUS".

    If neither is set, it could not be started, or its end was not observed. `expected` is true if the end was
    announced; otherwise it was a fault.
    """

    code: int | None
    signal: str | None
    expected: bool

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {"code": self.code, "signal": self.signal, "expected": self.expected}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            code=fields.whole("code", 0, 255) if fields.has("code") else None,
            signal=fields.text("signal", 32, least=1) if fields.has("signal") else None,
            expected=fields.flag("expected"),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorState:
    """A sidecar's report on its simulator.

    Attributes:
        state: of the simulator.
        driver: stub, webots or command.
        world: the path of its world.
        robots: the robots of that world that have a ROS node.
        pid: of the simulator's first process; None while it does not run.
        starts: number of starts since the sidecar started.
        faults: number of ends without an announcement.
        last_exit: its last end; None if it has not ended yet.
        detail: the reason for this state, in a sentence for people; "" if there is nothing to add.
        rss_bytes: the memory of its processes, in responses to GET while it is ready; else None.
        left_out: the nodes that the simulator left out of its world at its last start, in lines for people.
    """

    state: SidecarState
    driver: str
    world: str
    robots: tuple[RobotName, ...] = ()
    pid: int | None = None
    starts: int = 0
    faults: int = 0
    last_exit: LastExit | None = None
    detail: str = ""
    rss_bytes: int | None = None
    left_out: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data, with texts cut to the lengths that a reader accepts."""
        return {
            "state": self.state.value,
            "driver": clipped(self.driver, MOST_NAME),
            "world": clipped(self.world, MOST_PATH),
            "robots": [robot.to_json() for robot in self.robots[:MOST_ROBOTS]],
            "pid": self.pid,
            "starts": self.starts,
            "faults": self.faults,
            "last_exit": None if self.last_exit is None else self.last_exit.to_json(),
            "detail": clipped(self.detail),
            "rss_bytes": self.rss_bytes,
            "left_out": enumerated(self.left_out, LONGEST_LEFT_OUT, MOST_LEFT_OUT),
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            state=fields.choice("state", SidecarState),
            driver=fields.text("driver", MOST_NAME),
            world=fields.text("world", MOST_PATH),
            robots=fields.parts("robots", RobotName.from_json, MOST_ROBOTS),
            pid=fields.whole("pid", 1, MOST_PID) if fields.has("pid") else None,
            starts=fields.whole("starts"),
            faults=fields.whole("faults"),
            last_exit=fields.part("last_exit", LastExit.from_json) if fields.has("last_exit") else None,
            detail=fields.text("detail"),
            rss_bytes=fields.whole("rss_bytes") if fields.has("rss_bytes") else None,
            left_out=left_out(fields, LONGEST_LEFT_OUT),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class StopRequest:
    """An announcement that the simulator will end, within `deadline_s` seconds (0: kill it now)."""

    deadline_s: float

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {"deadline_s": self.deadline_s}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else, or has an additional field.
        """
        fields = Fields(content, path)
        fields.only("deadline_s")
        return cls(deadline_s=fields.number("deadline_s", 0.0, MOST_DEADLINE_S))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainRequest:
    """A request without parameters: start, ready."""

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the request.

        Raises:
            ProtocolError: `content` is anything but an empty object.
        """
        Fields(content, path).only()
        return cls()


def left_out(fields: Fields, most: int) -> tuple[str, ...]:
    """Return the lines in the field `left_out`, of at most `most` characters each; () if it is absent.

    Raises:
        ProtocolError: it is anything else.
    """
    return fields.texts("left_out", most, MOST_LEFT_OUT) if fields.has("left_out") else ()
