"""The life of a simulator, as a table.

    idle     --start-->    starting   spawn
    idle     --shutdown--> idle       nothing
    starting --ready-->    ready      nothing
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
2. Whether it is ready is not seen from here; the trainer says so, after a real round trip.
3. An exit is wanted from the moment that a stop was announced, whatever its code. Before that it is
   a fault, even with code 0: a simulator has no reason of its own to end.
4. A stop waits for the trainer's supervisor to end the simulator; its deadline kills. A second stop
   can only bring the deadline forward.
5. A shutdown of the sidecar is a stop that nobody else will see to: it asks by signal, then kills.
6. What the table does not have is refused, and changes nothing.

Everything that decides about states is in this file; what an action does is in `simulator`.
"""

from enum import StrEnum
from types import MappingProxyType

from palaestra_sim.protocol.control import SidecarState


class Event(StrEnum):
    """What can happen: the trainer's requests, the process, the clock, the container's end."""

    START = "start"
    READY = "ready"
    STOP = "stop"
    EXITED = "exited"
    DEADLINE = "deadline"
    SHUTDOWN = "shutdown"


class Action(StrEnum):
    """What is to be done on the way from one state to the next.

    spawn: start the process. wait: let it end by itself, until the deadline of the request.
    terminate: send SIGTERM to its process group, with a deadline. kill: end every process of it.
    blame: count a fault. accept: note an exit that was wanted.
    """

    NOTHING = "nothing"
    SPAWN = "spawn"
    WAIT = "wait"
    TERMINATE = "terminate"
    KILL = "kill"
    BLAME = "blame"
    ACCEPT = "accept"


Step = tuple[SidecarState, Action]

_IDLE, _STARTING, _READY = SidecarState.IDLE, SidecarState.STARTING, SidecarState.READY
_STOPPING, _FAILED = SidecarState.STOPPING, SidecarState.FAILED

TABLE: MappingProxyType[tuple[SidecarState, Event], Step] = MappingProxyType(
    {
        (_IDLE, Event.START): (_STARTING, Action.SPAWN),
        (_IDLE, Event.SHUTDOWN): (_IDLE, Action.NOTHING),
        (_STARTING, Event.READY): (_READY, Action.NOTHING),
        (_STARTING, Event.STOP): (_STOPPING, Action.WAIT),
        (_STARTING, Event.EXITED): (_FAILED, Action.BLAME),
        (_STARTING, Event.SHUTDOWN): (_STOPPING, Action.TERMINATE),
        (_READY, Event.STOP): (_STOPPING, Action.WAIT),
        (_READY, Event.EXITED): (_FAILED, Action.BLAME),
        (_READY, Event.SHUTDOWN): (_STOPPING, Action.TERMINATE),
        (_STOPPING, Event.STOP): (_STOPPING, Action.WAIT),
        (_STOPPING, Event.DEADLINE): (_STOPPING, Action.KILL),
        (_STOPPING, Event.EXITED): (_IDLE, Action.ACCEPT),
        (_STOPPING, Event.SHUTDOWN): (_STOPPING, Action.TERMINATE),
        (_FAILED, Event.START): (_STARTING, Action.SPAWN),
        (_FAILED, Event.SHUTDOWN): (_FAILED, Action.NOTHING),
    }
)


def step(state: SidecarState, event: Event) -> Step | None:
    """Return the next state and what to do on the way; None when `state` does not allow `event`."""
    return TABLE.get((state, event))
