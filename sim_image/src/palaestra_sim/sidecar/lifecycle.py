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

1. A simulator is started only when none runs: in `idle` and `failed`.
2. The sidecar cannot see whether the simulator is ready; the trainer reports it, after a real round trip.
3. After an announced stop, an exit is expected, with any exit code. Before that it is a fault, even with
   code 0, because a simulator does not exit by itself.
4. After a stop request, the trainer's supervisor ends the simulator; at the deadline, the sidecar kills it.
   A second stop request can only bring the deadline forward.
5. A shutdown of the sidecar stops the simulator without a trainer: it sends SIGTERM, then kills.
6. An event that is not in the table is refused and changes nothing.

All decisions about states are in this file; `simulator` runs the actions.
"""

from enum import StrEnum
from types import MappingProxyType

from palaestra_protocol.control import SidecarState


class LifecycleEvent(StrEnum):
    """An event: a trainer's request, an exit of the process, a deadline, or the shutdown of the container."""

    START = "start"
    READY = "ready"
    STOP = "stop"
    EXITED = "exited"
    DEADLINE = "deadline"
    SHUTDOWN = "shutdown"


class Action(StrEnum):
    """The action of a transition from one state to the next.

    spawn: start the process. wait: let it end by itself, until the deadline of the request.
    terminate: send SIGTERM to its process group, with a deadline. kill: kill all of its processes.
    note: read its report on left-out nodes. blame: count a fault. accept: record an expected exit.
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
