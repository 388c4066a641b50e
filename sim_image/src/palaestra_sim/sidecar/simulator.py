"""One simulator of a sidecar, and the thread that owns its state.

Requests, reports of the process, the deadline of a stop, and the shutdown of the container become messages in
one queue. One thread handles the messages in order, so no lock is needed. Other threads may read `state`; it
is an immutable value, and the owner replaces the whole value.
"""

import logging
import queue
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from palaestra_protocol.control import LastExit, SidecarState, SimulatorState
from palaestra_protocol.fields import MOST_NAME
from palaestra_sim.sidecar import lifecycle
from palaestra_sim.sidecar.left_out import read_left_out
from palaestra_sim.sidecar.lifecycle import Action, LifecycleEvent
from palaestra_sim.sidecar.process import CommandLine, Ended, SimulatorProcess, Started, Usage
from palaestra_sim.sidecar.viewing import Viewing

SHUTDOWN_GRACE_S = 1.0  # time from SIGTERM to SIGKILL; the whole shutdown may take 2 s
_ANSWER_S = 5.0

FAULT_KINDS = ("code", "signal", "unknown")

log = logging.getLogger(__name__)


class NoAnswer(TimeoutError):
    """The thread that owns the state did not respond to a request in time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandResult:
    """The result of a request: whether it was allowed, and the state after it."""

    allowed: bool
    state: SimulatorState


@dataclass(frozen=True, slots=True, kw_only=True)
class _Message:
    event: LifecycleEvent
    deadline_s: float = 0.0
    ended: Ended | None = None
    answers: "queue.SimpleQueue[CommandResult] | None" = None


class SupervisedSimulator:
    """One simulator, from the first start to the end of the container.

    Attributes:
        state: the current state; may be read from any thread.
        faults: number of faults by kind; may be read from any thread.
        viewing: reads the simulator's data for viewers; may be used from any thread.

    Args:
        command: the command line that starts the simulator.
        state: the state before the first start.
        left_out: the file in which the simulator reports the nodes that it leaves out; None without such a
            file.
        viewing: see Attributes; None if the simulator has no socket for viewers.
        batch: the file to which the simulator writes the address of its copies; None without such a file.
        clock: returns seconds, from any origin.
    """

    def __init__(
        self,
        command: CommandLine,
        state: SimulatorState,
        left_out: Path | None = None,
        viewing: Viewing | None = None,
        batch: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.state = state
        self.faults: Mapping[str, int] = dict.fromkeys(FAULT_KINDS, 0)
        self.viewing = viewing or Viewing.without("this simulator was started without a socket for viewers")
        self._command = command
        self._left_out = left_out
        self._batch = batch
        self._clock = clock
        self._inbox: queue.SimpleQueue[_Message | Started] = queue.SimpleQueue()
        self._process: SimulatorProcess | None = None
        self._kill_at: float | None = None
        self._closing = False
        self._actions: Mapping[Action, Callable[[SimulatorState, _Message], SimulatorState]] = {
            Action.NOTHING: self._nothing,
            Action.SPAWN: self._spawn,
            Action.NOTE: self._note,
            Action.WAIT: self._wait,
            Action.TERMINATE: self._terminate,
            Action.KILL: self._kill,
            Action.BLAME: self._blame,
            Action.ACCEPT: self._accept,
        }

    def ask(self, event: LifecycleEvent, deadline_s: float = 0.0) -> CommandResult:
        """Send a request to the owner of the state and return the result.

        Any thread may call this method, except the owner itself.

        Raises:
            NoAnswer: the owner hangs, or has ended.
        """
        answers: queue.SimpleQueue[CommandResult] = queue.SimpleQueue()
        self._inbox.put(_Message(event=event, deadline_s=deadline_s, answers=answers))
        try:
            return answers.get(timeout=_ANSWER_S)
        except queue.Empty:
            raise NoAnswer(f"no response to {event} within {_ANSWER_S:g} s") from None

    def shut_down(self) -> None:
        """End the simulator and make `run` return; safe from any thread."""
        self._inbox.put(_Message(event=LifecycleEvent.SHUTDOWN))

    def as_answered(self) -> SimulatorState:
        """Return the state with the address of the copies and, if the simulator is ready, its memory."""
        state = replace(self.state, batch=self._address())
        ready = state.state is SidecarState.READY
        return replace(state, rss_bytes=self.usage().rss_bytes) if ready else state

    def _address(self) -> str | None:
        """Return the address of the process's copies; None before the process serves them."""
        if self._batch is None or self._process is None:
            return None
        try:
            return self._batch.read_text(encoding="ascii")[:MOST_NAME].strip() or None
        except (OSError, ValueError):
            return None

    def usage(self) -> Usage:
        """Return the resource usage of the simulator's processes; zero if no process runs.

        Any thread may call this method.
        """
        process = self._process
        return Usage() if process is None else process.usage()

    def run(self) -> None:
        """Handle messages in order, until a shutdown has ended the simulator."""
        while not (self._closing and self._process is None):
            message = self._next()
            if isinstance(message, Started):
                self.state = replace(self.state, pid=message.pid)
            else:
                self._take(message)

    def _next(self) -> _Message | Started:
        wait_s = None if self._kill_at is None else max(0.0, self._kill_at - self._clock())
        try:
            return self._inbox.get(timeout=wait_s)
        except queue.Empty:
            return _Message(event=LifecycleEvent.DEADLINE)

    def _take(self, message: _Message) -> None:
        """Run the action that `lifecycle` lists for a message; send the result to the caller of `ask`."""
        self._closing |= message.event is LifecycleEvent.SHUTDOWN
        step = lifecycle.step(self.state.state, message.event)
        if step is not None:
            to, action = step
            entered = replace(self.state, state=to, detail="")
            self.state = self._actions[action](entered, message)
            detail = f": {self.state.detail}" if self.state.detail else ""
            log.info("%s%s%s", self._command.mark, self.state.state.value, detail)
        if message.answers is not None:
            message.answers.put(CommandResult(allowed=step is not None, state=self.state))

    def _nothing(self, state: SimulatorState, _: _Message) -> SimulatorState:
        return state

    def _spawn(self, state: SimulatorState, _: _Message) -> SimulatorState:
        start = state.starts + 1
        try:
            for report in (self._left_out, self._batch):
                if report is not None:
                    report.unlink(missing_ok=True)
            self._process = SimulatorProcess.start(self._numbered(start), self._report)
        except OSError as error:
            self._report(Ended(problem=f"it could not be run: {error.strerror}"))
        return replace(state, starts=start, left_out=())

    def _note(self, state: SimulatorState, _: _Message) -> SimulatorState:
        return state if self._left_out is None else replace(state, left_out=read_left_out(self._left_out))

    def _numbered(self, start: int) -> CommandLine:
        """Return the command with the number of this start, so that random faults differ in each start."""
        environment = {**self._command.environment, "PALAESTRA_SIMULATOR_START": str(start)}
        return replace(self._command, environment=environment)

    def _wait(self, state: SimulatorState, message: _Message) -> SimulatorState:
        return self._to_end_within(message.deadline_s, state)

    def _terminate(self, state: SimulatorState, _: _Message) -> SimulatorState:
        if self._process is not None:
            self._process.terminate()
        return self._to_end_within(SHUTDOWN_GRACE_S, state)

    def _kill(self, state: SimulatorState, _: _Message) -> SimulatorState:
        self._kill_at = None
        if self._process is not None:
            self._process.kill()
        return replace(state, detail="killed at its deadline")

    def _blame(self, state: SimulatorState, message: _Message) -> SimulatorState:
        ended = message.ended or Ended()
        kind, how = _described(ended)
        self.faults = {**self.faults, kind: self.faults[kind] + 1}
        return replace(self._after(ended, state, expected=False), faults=state.faults + 1, detail=how)

    def _accept(self, state: SimulatorState, message: _Message) -> SimulatorState:
        return self._after(message.ended or Ended(), state, expected=True)

    def _after(self, ended: Ended, state: SimulatorState, *, expected: bool) -> SimulatorState:
        """Close the pipe to the reaper of the ended process; return the state with the last exit."""
        if self._process is not None:
            self._process.close()
        self._process = None
        self._kill_at = None
        last = LastExit(code=ended.code, signal=ended.signal, expected=expected)
        return replace(state, pid=None, last_exit=last)

    def _to_end_within(self, deadline_s: float, state: SimulatorState) -> SimulatorState:
        """Set the time of the kill, unless an earlier time is set already; return the new state."""
        kill_at = self._clock() + deadline_s
        self._kill_at = kill_at if self._kill_at is None else min(self._kill_at, kill_at)
        return replace(state, detail=f"will be killed in {self._kill_at - self._clock():.1f} s")

    def _report(self, report: Started | Ended) -> None:
        """Put a report from a thread of the process into the queue."""
        if isinstance(report, Ended):
            self._inbox.put(_Message(event=LifecycleEvent.EXITED, ended=report))
        else:
            self._inbox.put(report)


def _described(ended: Ended) -> tuple[str, str]:
    """Return the kind of an unexpected end, and a sentence that describes it."""
    said = f"; its last line: {ended.last_line}" if ended.last_line else ""
    if ended.code is not None:
        return "code", f"the simulator ended with code {ended.code}{said}"
    if ended.signal is not None:
        return "signal", f"the simulator was ended by {ended.signal}{said}"
    return "unknown", f"the simulator ended: {ended.problem}{said}"
