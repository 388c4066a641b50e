"""The loop that sends the command of a policy to a robot, 20 times a second, as far as the rules allow.

The loop runs in its own thread, so that it notices a policy that hangs. If the whole process hangs or dies,
no command is sent, and the robot's own timeout stops the robot.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final

import structlog

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.frames import OdometryFrame
from palaestra_trainer.real_robots.link import RobotLink
from palaestra_trainer.real_robots.readings import Readings, ReadingStore
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.safety import (
    SILENCE,
    STANDING,
    SafetyDecision,
    SafetyRules,
    Situation,
    StopCause,
    decide,
    is_motion,
    stands,
)
from palaestra_trainer.robots.geometry import Pose, Twist
from palaestra_trainer.waiting.check import Check, go_on

log = structlog.get_logger(__name__)

PERIOD_S: Final = 0.05
_END_S: Final = 0.5  # at the end, zero is sent until the robot has confirmed it for this long
_MOST_END_S: Final = 2.0  # if the robot does not confirm it, zero is sent for this long
_STUCK_S: Final = 2.0  # of real time; a request normally ends by its timeout of 0.1 s


def _always() -> bool:
    return True


def _unheard(situation: Situation, decision: SafetyDecision) -> None:
    del situation, decision


@dataclass(frozen=True, slots=True, kw_only=True)
class Hooks:
    """Functions that a robot calls.

    Attributes:
        permitted: called before each command; returns whether the person allows motion now.
        decided: called after each decision, for logs; it must not wait.
        check: called often during waits; it may raise to end a wait.
    """

    permitted: Callable[[], bool] = _always
    decided: Callable[[Situation, SafetyDecision], None] = _unheard
    check: Check = go_on


class CommandLoop:
    """Sends commands in a thread of its own, from `start` to `close`.

    Args:
        link: the connection to the robot.
        store: the readings of that connection.
        rules: the safety rules.
        clock: the robot's clock.
        hooks: functions that the loop calls, in its thread.

    Attributes:
        muted: whether the loop decides without sending, for a dry run.
    """

    def __init__(
        self,
        link: RobotLink,
        store: ReadingStore,
        rules: SafetyRules,
        clock: RobotClock,
        hooks: Hooks,
    ) -> None:
        self.muted = False
        self._link = link
        self._store = store
        self._rules = rules
        self._clock = clock
        self._hooks = hooks
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="robot-commands", daemon=True)
        self._command: Twist | None = None
        self._alive_s = 0.0
        self._begun_s = self._turn_s = self._confirmed_s = clock.now_s()
        self._sent = STANDING
        self._rested_s = self._pushing_s = self._driven_m = 0.0
        self._frame = OdometryFrame(Pose(0.0, 0.0, 0.0))
        self._cause: StopCause | None = None
        self._failed: StopCause | None = None

    @property
    def cause(self) -> StopCause | None:
        """The cause that holds the robot back or stops it now; None while the robot may move."""
        with self._lock:
            turned_s = self._clock.real_s(self._clock.now_s() - self._turn_s)
            if self._failed is None and self._thread.is_alive() and turned_s > _STUCK_S:
                fact = f"no command was sent for {_STUCK_S:g} s, because a request does not return"
                return StopCause("commands hang", f"{fact}; check the network", stops=True)
            return self._failed or self._cause

    @property
    def frame(self) -> OdometryFrame:
        """The frame of the task."""
        with self._lock:
            return self._frame

    def start(self) -> None:
        """Begin to send commands; without a command of the policy, the robot stands."""
        self._begun_s = self._turn_s = self._confirmed_s = self._clock.now_s()
        self._thread.start()

    def command(self, twist: Twist) -> None:
        """Set the velocity to send from now on, until the next command."""
        with self._lock:
            self._command, self._alive_s = twist, self._clock.now_s()

    def show_life(self) -> None:
        """Store the time of a call from the policy's program, as a sign that the program runs."""
        with self._lock:
            self._alive_s = self._clock.now_s()

    def begin(self, frame: OdometryFrame | None = None, *, placed: bool = False) -> None:
        """Begin an episode: the robot stands until the next command, and is no longer stopped.

        Args:
            frame: the frame of the task; None: the frame stays.
            placed: whether a person has confirmed the pose, so that odometry has no error yet.
        """
        with self._lock:
            self._frame = frame or self._frame
            self._driven_m = 0.0 if placed else self._driven_m
            self._command, self._cause = None, None

    def close(self) -> None:
        """Stop the robot, and end the thread; further calls have no effect."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join(_MOST_END_S + 1.0)

    def _run(self) -> None:
        due_s = self._clock.now_s()
        with ExitStack() as ending:
            ending.callback(self._stand)
            try:
                while not self._clock.wait(self._over, due_s):
                    self._send(self._decided())
                    due_s = max(due_s + PERIOD_S, self._clock.now_s())
            except Exception as error:  # a hook or a connection may raise anything; then the robot must stand
                with self._lock:
                    fact = f"{type(error).__name__}: {error}; report this error"
                    self._failed = StopCause("internal error", fact, stops=True)
                ending.close()  # zero is sent before the log, because a log may wait for a disk or a terminal
                log.exception("no more commands are sent")

    def _decided(self) -> SafetyDecision:
        """Return the velocity to send now, and the cause if the robot is held back or stopped."""
        permitted = self._hooks.permitted()
        seen = self._store.newest
        with self._lock:
            situation = self._situation(seen, permitted=permitted)
            decision = decide(situation, self._rules)
            if self._cause is not None and self._cause.stops:
                decision = SafetyDecision(STANDING, self._cause)
            self._cause = decision.cause
            if decision.cause is not None and decision.cause.name != SILENCE:
                self._command = None  # the robot moves again only after a command from newer readings
        if self.muted:
            decision = SafetyDecision(STANDING, decision.cause)
        self._hooks.decided(situation, decision)
        return decision

    def _situation(self, seen: Readings, *, permitted: bool) -> Situation:
        now_s = self._clock.now_s()
        elapsed_s, self._turn_s = now_s - self._turn_s, now_s
        odometry = seen.odometry
        velocity = STANDING if odometry is None else odometry.velocity
        self._driven_m += min(elapsed_s, 1.0) * math.hypot(velocity[0], velocity[1])
        pushes = is_motion(self._sent) and stands(velocity)
        self._pushing_s = self._pushing_s + PERIOD_S if pushes else 0.0
        return Situation(
            command=self._command,
            silent_s=now_s - self._alive_s,
            permitted=permitted,
            readings_age_s=now_s - max(seen.oldest_s, self._begun_s),
            unconfirmed_s=0.0 if self.muted else now_s - self._confirmed_s,
            asleep_s=self._clock.real_s(elapsed_s),
            bumped=bool(seen.bumped),
            pose=None if odometry is None else self._frame.of_task(odometry.pose),
            velocity=velocity,
            driven_m=self._driven_m,
            rested_s=self._rested_s,
            pushing_s=self._pushing_s,
        )

    def _send(self, decision: SafetyDecision) -> None:
        if self.muted:
            self._confirmed_s = self._clock.now_s()
            return
        # The time is counted in commands, because a clock would also count time in which this thread did not
        # run.
        self._rested_s = self._rested_s + PERIOD_S if decision.twist == STANDING else 0.0
        self._sent = decision.twist
        try:
            self._link.send(decision.twist)
            self._confirmed_s = self._clock.now_s()
        except LinkError as error:
            log.debug("no command", error=str(error))

    def _stand(self) -> None:
        """Send zero until the robot has confirmed it for `_END_S`, but for at most `_MOST_END_S`."""
        end_s = self._clock.now_s() + (0.0 if self.muted else _MOST_END_S)
        confirmed_s = 0.0
        pause = threading.Event()
        while self._clock.now_s() < end_s and confirmed_s < _END_S:
            try:
                self._link.send(STANDING)
                confirmed_s += PERIOD_S
            except LinkError as error:
                log.debug("no command", error=str(error))
            except Exception:  # whatever fails, the next attempt may succeed
                log.exception("no command")
            self._clock.wait(pause, self._clock.now_s() + PERIOD_S)
