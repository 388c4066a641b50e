"""The lifecycle of a simulator, as a table.

    idle     --start-->    starting   spawn
    idle     --shutdown--> idle       nothing
    starting --ready-->    ready      note
    starting --stop-->     stopping   wait
    starting --exited-->   failed     blame
    starting --shutdown--> stopping   terminate
    ready    --stop-->     stopping   wait
    ready    --exited-->   failed     blame
    ready    --shutdown--> stopping   terminate
    stopping --stop-->     stopping   wait
    stopping --deadline--> stopping   kill
    stopping --exited-->   idle       accept
    stopping --shutdown--> stopping   terminate
    failed   --start-->    starting   spawn
    failed   --shutdown--> failed     nothing

Rules:

1. The sidecar starts the simulator only in the states `idle` and `failed`, in which no process runs.
2. The sidecar cannot detect that the simulator is ready. The trainer reports this after a real request.
3. After a stop request, an exit is expected, with any exit code. Without such a request, an exit is a fault,
   even with code 0, because a simulator does not exit by itself.
4. After a stop request, the trainer's supervisor robot ends the simulation. If the process still runs at the
   deadline, the sidecar kills it. A second stop request can only make the deadline earlier.
5. At a shutdown, the sidecar itself ends the simulator: it sends SIGTERM, and after a deadline it kills the
   process.
6. An event that is not in the table is refused, and the state does not change.

This file has all decisions about states. The module `simulator` runs the actions.
"""

from enum import StrEnum
from types import MappingProxyType

from palaestra_protocol.control import SidecarState


class LifecycleEvent(StrEnum):
    """An event: a request of the trainer, an exit of the process, a deadline, a shutdown of the container."""

    START = "start"
    READY = "ready"
    STOP = "stop"
    EXITED = "exited"
    DEADLINE = "deadline"
    SHUTDOWN = "shutdown"


class Action(StrEnum):
    """The action of a transition from one state to the next.

    - nothing: do nothing.
    - spawn: start the process.
    - note: read the simulator's report on left-out nodes.
    - wait: wait until the process ends, or until the deadline of the request.
    - terminate: send SIGTERM to the process group, and set a deadline.
    - kill: kill all processes of the simulator.
    - blame: count a fault.
    - accept: record an expected exit.
    """

    NOTHING = "nothing"
    SPAWN = "spawn"
    NOTE = "note"
    WAIT = "wait"
    TERMINATE = "terminate"
    KILL = "kill"
    BLAME = "blame"
    ACCEPT = "accept"


Step = tuple[SidecarState, Action]

_IDLE, _STARTING, _READY = SidecarState.IDLE, SidecarState.STARTING, SidecarState.READY
_STOPPING, _FAILED = SidecarState.STOPPING, SidecarState.FAILED

TABLE: MappingProxyType[tuple[SidecarState, LifecycleEvent], Step] = MappingProxyType(
    {
        (_IDLE, LifecycleEvent.START): (_STARTING, Action.SPAWN),
        (_IDLE, LifecycleEvent.SHUTDOWN): (_IDLE, Action.NOTHING),
        (_STARTING, LifecycleEvent.READY): (_READY, Action.NOTE),
        (_STARTING, LifecycleEvent.STOP): (_STOPPING, Action.WAIT),
        (_STARTING, LifecycleEvent.EXITED): (_FAILED, Action.BLAME),
        (_STARTING, LifecycleEvent.SHUTDOWN): (_STOPPING, Action.TERMINATE),
        (_READY, LifecycleEvent.STOP): (_STOPPING, Action.WAIT),
        (_READY, LifecycleEvent.EXITED): (_FAILED, Action.BLAME),
        (_READY, LifecycleEvent.SHUTDOWN): (_STOPPING, Action.TERMINATE),
        (_STOPPING, LifecycleEvent.STOP): (_STOPPING, Action.WAIT),
        (_STOPPING, LifecycleEvent.DEADLINE): (_STOPPING, Action.KILL),
        (_STOPPING, LifecycleEvent.EXITED): (_IDLE, Action.ACCEPT),
        (_STOPPING, LifecycleEvent.SHUTDOWN): (_STOPPING, Action.TERMINATE),
        (_FAILED, LifecycleEvent.START): (_STARTING, Action.SPAWN),
        (_FAILED, LifecycleEvent.SHUTDOWN): (_FAILED, Action.NOTHING),
    }
)


def step(state: SidecarState, event: LifecycleEvent) -> Step | None:
    """Return the next state and the action; None if `state` does not allow `event`."""
    return TABLE.get((state, event))
