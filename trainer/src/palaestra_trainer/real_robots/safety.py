"""The rules that decide, for each command, whether a real robot may move: a pure function of the situation.

A rule either holds the robot back until its cause has ended, or stops the robot until a person begins a new
episode. The order of `CHECKS` is the order of importance. These rules are not a safety function; only the
robot's own emergency stop is a safety function.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import OUTLINE_M
from palaestra_trainer.robots.geometry import TURN_RAD_S, Point, Pose, Twist

BUMPER: Final = "bumper"
SILENCE: Final = "silent policy"
STANDING: Final[Twist] = (0.0, 0.0, 0.0)

# A robot may drive this long before a stop takes effect: one period of commands, a delayed request, braking.
_REACTION_S: Final = 0.25
_SETTLED_S: Final = 1.0  # within this time, a robot obeys a command to move or to stand
_ASLEEP_S: Final = 2.0  # after a longer suspension of program or computer, the robot must not drive on
# Source: ~min_linear_vel and ~min_angular_vel of robotino_node, which raises slower commands to these values.
_LEAST_M_S, _LEAST_RAD_S = 0.05, 0.1
# The odometry of a standing robot may have noise up to _STANDING. A robot that is faster than _MOVING counts
# as moving.
_STANDING: Final = (0.01, 0.01, 0.02)
_MOVING: Final = (0.02, 0.02, 0.05)


@dataclass(frozen=True, slots=True)
class Fence:
    """The rectangle that the robot's outline must not leave, in meters of the task's frame."""

    low: Point
    high: Point

    def __post_init__(self) -> None:
        """Refuse a rectangle in which the robot has no place."""
        sides = [high - low for low, high in zip(self.low, self.high, strict=True)]
        if not all(2.0 * OUTLINE_M < side < math.inf for side in sides):
            raise ConfigurationError(
                f"fence: from {self.low} to {self.high} has no place for a robot of {2 * OUTLINE_M:.2f} m; "
                "give the smallest x and y, then the greatest"
            )

    def admits(self, point: Point) -> bool:
        """Return whether a robot at this point is within the fence."""
        return self.gap_m(Pose(*point, 0.0)) > 0.0

    def gap_m(self, pose: Pose) -> float:
        """Return the meters between the robot's outline and the fence; negative beyond the fence."""
        x_m, y_m = pose.x_m, pose.y_m
        return min(x_m - self.low[0], self.high[0] - x_m, y_m - self.low[1], self.high[1] - y_m) - OUTLINE_M


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyRules:
    """The limits of a deployment.

    Attributes:
        speed_m_s: greatest speed along the floor; a faster command is scaled, its direction stays.
        turn_rad_s: greatest rate of turning.
        fence: the rectangle for the robot; None: no fence.
        odometry_error: largest error of odometry, as a share of the driven distance. The robot keeps this
            error as a distance from the fence.
        silence_s: seconds without a call of the policy's program, after which the robot is held back.
        stale_s: age of the oldest reading, above which the robot is held back.
        lost_s: age of the oldest reading, or of the last confirmation, above which the robot is stopped.
    """

    speed_m_s: float = 0.2
    turn_rad_s: float = TURN_RAD_S
    fence: Fence | None = None
    odometry_error: float = 0.05
    silence_s: float = 0.2
    stale_s: float = 0.3
    lost_s: float = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """The values on which a decision depends.

    Attributes:
        command: the newest command of the policy; None: the policy has sent none.
        silent_s: seconds since the policy's program last called the robot; while it waits, it calls often.
        permitted: whether the person allows motion now, for example by holding a key.
        readings_age_s: age of the oldest of the newest readings; infinite without readings.
        unconfirmed_s: seconds since the robot last confirmed a command.
        asleep_s: seconds of real time since the previous decision.
        bumped: whether the bumper touches something.
        pose: the pose by odometry, in the task's frame; None before the first reading.
        velocity: the velocity by odometry, in the robot's frame.
        driven_m: meters driven since a person confirmed the pose.
        rested_s: seconds for which only zero has been commanded.
        pushing_s: seconds for which motion has been commanded while odometry reports no motion.
    """

    command: Twist | None
    silent_s: float
    permitted: bool
    readings_age_s: float
    unconfirmed_s: float
    asleep_s: float
    bumped: bool
    pose: Pose | None
    velocity: Twist
    driven_m: float
    rested_s: float
    pushing_s: float


class StopCause(NamedTuple):
    """The reason why a robot may not move.

    Attributes:
        name: a short name, for logs.
        message: fact and remedy.
        stops: whether the robot stays stopped after the cause has ended.
    """

    name: str
    message: str
    stops: bool


class SafetyDecision(NamedTuple):
    """The velocity to send to the robot, and the cause if the robot is held back or stopped."""

    twist: Twist
    cause: StopCause | None = None


Check = Callable[[Situation, SafetyRules], StopCause | None]


def decide(situation: Situation, rules: SafetyRules) -> SafetyDecision:
    """Return the velocity to send: that of the policy within the limits, or zero and the first cause."""
    for check in CHECKS:
        if cause := check(situation, rules):
            return SafetyDecision(STANDING, cause)
    return SafetyDecision(limited(situation.command or STANDING, rules))


def limited(twist: Twist, rules: SafetyRules) -> Twist:
    """Return a velocity within the limits, in the same direction along the floor."""
    forward, left, turning = twist
    speed = math.hypot(forward, left)
    share = min(rules.speed_m_s / speed, 1.0) if speed else 1.0
    return forward * share, left * share, min(max(turning, -rules.turn_rad_s), rules.turn_rad_s)


def stands(velocity: Twist) -> bool:
    """Return whether a velocity by odometry is that of a standing robot."""
    return all(abs(part) <= most for part, most in zip(velocity, _STANDING, strict=True))


def is_motion(twist: Twist) -> bool:
    """Return whether a velocity is fast enough for a Robotino to move at all."""
    return math.hypot(twist[0], twist[1]) >= _LEAST_M_S or abs(twist[2]) >= _LEAST_RAD_S


def is_finite(twist: Twist) -> bool:
    """Return whether all numbers of a velocity are finite."""
    return all(map(math.isfinite, twist))


def _bumper(situation: Situation, rules: SafetyRules) -> StopCause | None:
    del rules
    if not situation.bumped:
        return None
    return StopCause(BUMPER, "the bumper touches something; free the robot", stops=True)


def _lost(situation: Situation, rules: SafetyRules) -> StopCause | None:
    if situation.readings_age_s > rules.lost_s:
        fact = f"no readings for {rules.lost_s:g} s"
    elif situation.unconfirmed_s > rules.lost_s and situation.readings_age_s > rules.stale_s:
        # After a cut, the confirmations can end shortly before the readings. Such a robot refuses nothing.
        fact = f"no confirmed command for {rules.lost_s:g} s, and no readings for {rules.stale_s:g} s"
    else:
        return None
    remedy = "check the network between this computer and the robot"
    return StopCause("connection lost", f"{fact}; {remedy}", stops=True)


def _fence(situation: Situation, rules: SafetyRules) -> StopCause | None:
    if rules.fence is None or situation.pose is None:
        return None
    # Since the reading, the robot has driven on, perhaps at the speed of a newer command.
    speeds = (limited(situation.command or STANDING, rules), situation.velocity)
    speed = max(math.hypot(forward, left) for forward, left, _ in speeds)
    margin_m = rules.odometry_error * situation.driven_m
    margin_m += (_REACTION_S + min(situation.readings_age_s, rules.lost_s)) * speed
    if rules.fence.gap_m(situation.pose) > margin_m:
        return None
    at = f"({situation.pose.x_m:.2f}, {situation.pose.y_m:.2f})"
    fact = f"the robot at {at} is within {margin_m:.2f} m of the fence; move it back, or widen the fence"
    return StopCause("fence", fact, stops=True)


def _foreign(situation: Situation, rules: SafetyRules) -> StopCause | None:
    del rules
    moving = any(abs(part) > most for part, most in zip(situation.velocity, _MOVING, strict=True))
    if not moving or situation.rested_s <= _SETTLED_S:
        return None
    fact = "the robot moves without a command of this program; end the other client"
    return StopCause("another client", fact, stops=True)


def _unconfirmed(situation: Situation, rules: SafetyRules) -> StopCause | None:
    if situation.unconfirmed_s <= rules.lost_s:
        return None
    fact = f"the robot has confirmed no command for {rules.lost_s:g} s; check that it accepts commands"
    return StopCause("commands refused", fact, stops=True)


def _asleep(situation: Situation, rules: SafetyRules) -> StopCause | None:
    del rules
    if situation.asleep_s <= _ASLEEP_S:
        return None
    fact = f"this program did not run for {situation.asleep_s:.0f} s; begin the episode again"
    return StopCause("suspended", fact, stops=True)


def _without_effect(situation: Situation, rules: SafetyRules) -> StopCause | None:
    del rules
    if situation.pushing_s <= _SETTLED_S:
        return None
    fact = (
        "the robot does not move; release its emergency stop, look at its motors, and begin the episode again"
    )
    return StopCause("no effect", fact, stops=True)


def _not_permitted(situation: Situation, rules: SafetyRules) -> StopCause | None:
    del rules
    return None if situation.permitted else StopCause("released", "hold the key to drive", stops=False)


def _stale(situation: Situation, rules: SafetyRules) -> StopCause | None:
    if situation.readings_age_s <= rules.stale_s:
        return None
    return StopCause("stale readings", f"the readings are older than {rules.stale_s:g} s", stops=False)


def _silent(situation: Situation, rules: SafetyRules) -> StopCause | None:
    if situation.command is None or situation.silent_s <= rules.silence_s:
        return None
    return StopCause(SILENCE, f"the policy computes for more than {rules.silence_s:g} s", stops=False)


CHECKS: Final[tuple[Check, ...]] = (
    _bumper,
    _asleep,
    _lost,
    _unconfirmed,
    _fence,
    _foreign,
    _without_effect,
    _not_permitted,
    _stale,
    _silent,
)
