"""The batched form of `MoveToTargetEnv`: the same task, with arrays.

The arithmetic operations have the same order as in the single environment, so the numbers of each row are
equal bit by bit. If a function of NumPy rounds differently from that of Python, this module uses Python's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.environments import observation
from palaestra_trainer.environments.actions import SCALE, action_space
from palaestra_trainer.environments.batched import BatchedEnv, BatchedStep, Rows, generator
from palaestra_trainer.environments.move_to_target import REACHED_M, STANDING_M_S
from palaestra_trainer.environments.options import MoveToTargetOptions, time_up_terminates
from palaestra_trainer.environments.placement import FreePlaces
from palaestra_trainer.environments.rewards import MARGIN_M, WEIGHTS, EpisodeOutcome
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import SENSOR_RANGE_M
from palaestra_trainer.robots.batched_base import BatchedRobotinoAbc, BatchedSceneAbc
from palaestra_trainer.robots.geometry import SPEED_M_S, TURN_RAD_S

Floats = NDArray[np.float64]
_RUNNING, _REACHED, _COLLIDED, _TIME_UP = range(4)
_OUTCOMES: Final = np.array(
    [
        outcome.value
        for outcome in (
            EpisodeOutcome.RUNNING,
            EpisodeOutcome.REACHED,
            EpisodeOutcome.COLLIDED,
            EpisodeOutcome.TIME_UP,
        )
    ]
)
_TURN: Final = 2.0 * math.pi


@dataclass(slots=True, kw_only=True, eq=False)
class BatchedState:
    """The complete state of all rows after a step: `StepState`, with an array for each number."""

    distances_m: NDArray[np.float32]
    bumped: NDArray[np.bool_]
    poses: Floats
    forward: Floats
    left: Floats
    turning: Floats
    ahead_m: Floats
    beside_m: Floats
    distance_m: Floats
    time_left: Floats


class BatchedMoveToTargetEnv(BatchedEnv):
    """Many Robotinos, each alone in its own copy of the world: drive to the target and stand there.

    Spaces, rewards, start and end of an episode are those of `MoveToTargetEnv`.

    Args:
        robot: the robots.
        scene: places the robots for each episode.
        options: the options for observation, actions and rewards.
    """

    needs = (BatchedRobotinoAbc,)

    def __init__(
        self, robot: BatchedRobotinoAbc, scene: BatchedSceneAbc, options: MoveToTargetOptions | None = None
    ) -> None:
        self.options = options or MoveToTargetOptions()
        self._numbers = observation.space(self.options.observe)
        super().__init__(robot.rows, self._numbers, action_space(self.options))
        self._robot, self._scene = robot, scene
        rows = robot.rows
        self._targets, self._steps = np.zeros((rows, 2)), np.zeros(rows)
        self._seen: BatchedState | None = None
        self._twists = np.array([movement.twist for movement in self.options.movements])

    def begin(self, rows: Rows, seeds: Sequence[int], options: dict[str, Any]) -> NDArray[np.float32]:
        """Begin an episode in rows; return the observations of all rows."""
        if unknown := sorted(set(options) - {"training_progress", "episode"}):
            raise ConfigurationError(
                f"reset option {unknown[0]!r} is not known to the batched form; remove it"
            )
        places = FreePlaces(layout=self._scene.layout(), radius_m=self._robot.radius_m)
        generators = [generator(seed) for seed in seeds]
        noise = [int(random.integers(2**31)) for random in generators]
        tasks = [places.draw_task(random) for random in generators]
        self._scene.begin(rows, noise, starts=[task.start for task in tasks])
        self._targets[rows] = [task.target for task in tasks]
        self._steps[rows] = 0.0
        before = self._seen
        speeds = np.zeros((3, self.num_envs))
        if before is not None:
            speeds[:] = before.forward, before.left, before.turning
            speeds[:, rows] = 0.0
        self._seen = self._look(speeds)
        return self._observed(self._seen)

    def step(self, actions: Any) -> BatchedStep:
        """Drive all robots for one control period; return the results of all rows."""
        before = self._seen
        if before is None:
            raise ConfigurationError("no episode has begun; call reset() first")
        self._robot.drive(*self._driven(np.asarray(actions)).T)
        self._robot.advance()
        self._steps += 1.0
        speeds = _velocities(before.poses, self._robot.poses(), self._robot.period_s)
        self._seen = after = self._look(speeds)
        outcome = self._outcomes(after)
        time_up = outcome == _TIME_UP
        terminates = time_up_terminates(self.options)
        terminated = (outcome == _REACHED) | (outcome == _COLLIDED) | (time_up & terminates)
        terms = _reward_terms(self.options.reward, before, after, outcome)
        rewards = np.zeros(self.num_envs)
        for term in terms.values():
            rewards = rewards + term
        info = {"is_success": outcome == _REACHED, "outcome": _OUTCOMES[outcome], "reward_terms": terms}
        return self._observed(after), rewards, terminated, time_up & (not terminates), info

    def _driven(self, actions: Any) -> Floats:
        driven: Floats = self._twists
        if self.options.actions == "continuous":
            driven = np.clip(actions, -1.0, 1.0).astype(np.float64) * SCALE
        else:
            driven = driven[actions.astype(np.int64)]
        return driven

    def _look(self, speeds: Any) -> BatchedState:
        poses = self._robot.poses()
        away = self._targets - poses[:, :2]
        ahead, beside = _in_frame(poses[:, 2], away[:, 0], away[:, 1])
        return BatchedState(
            distances_m=self._robot.distances(),
            bumped=self._robot.bumped(),
            poses=poses,
            forward=speeds[0],
            left=speeds[1],
            turning=speeds[2],
            ahead_m=ahead,
            beside_m=beside,
            distance_m=_lengths(ahead, beside),
            time_left=1.0 - self._steps / self.options.max_steps,
        )

    def _outcomes(self, seen: BatchedState) -> NDArray[np.int64]:
        standing = _lengths(seen.forward, seen.left) < STANDING_M_S
        outcome = np.where(self._steps >= self.options.max_steps, _TIME_UP, _RUNNING)
        outcome = np.where((seen.distance_m < REACHED_M) & standing, _REACHED, outcome)
        return np.where(seen.bumped, _COLLIDED, outcome)

    def _observed(self, seen: BatchedState) -> NDArray[np.float32]:
        columns = [column for name in self.options.observe for column in _PARTS[name](seen)]
        numbers = np.stack(columns, axis=1).astype(np.float32)
        within = self._numbers
        cut_off: NDArray[np.float32] = np.minimum(np.maximum(numbers, within.low), within.high)
        return cut_off


def _sensors(seen: BatchedState) -> Sequence[Any]:
    least, most = SENSOR_RANGE_M
    nearness = (most - seen.distances_m) / (most - least)
    return [*nearness.T, seen.bumped]


def _position(seen: BatchedState) -> Sequence[Any]:
    x, y, heading = seen.poses.T
    return (
        x / observation.UNIT_M,
        y / observation.UNIT_M,
        _of_each(math.cos, heading),
        _of_each(math.sin, heading),
    )


_PARTS: Final[dict[str, Callable[[BatchedState], Sequence[Any]]]] = {
    "sensors": _sensors,
    "velocity": lambda seen: (
        seen.forward / SPEED_M_S,
        seen.left / SPEED_M_S,
        seen.turning / TURN_RAD_S,
    ),
    "position": _position,
    "target": lambda seen: (seen.ahead_m / observation.UNIT_M, seen.beside_m / observation.UNIT_M),
    "time_left": lambda seen: (seen.time_left,),
    "to_reach": lambda seen: (np.ones(len(seen.bumped)),),
}


def _reward_terms(
    reward: str, before: BatchedState, after: BatchedState, outcome: NDArray[np.int64]
) -> dict[str, Floats]:
    """Return the weighted terms of `Dense` or `Sparse` by name, (rows,) each; see `rewards`."""
    nearest = after.distances_m.min(axis=1).astype(np.float64)
    used = MARGIN_M - nearest
    terms = {
        "progress": before.distance_m - after.distance_m,
        "success": (outcome == _REACHED).astype(np.float64),
        "collision": (outcome == _COLLIDED).astype(np.float64),
        "proximity": np.maximum(0.0, used) / (MARGIN_M - SENSOR_RANGE_M[0]),
        "time_up": (outcome == _TIME_UP).astype(np.float64),
        "duration": np.ones(len(outcome)),
    }
    return {name: weight * terms[name] for name, weight in WEIGHTS[reward].items()}


def _velocities(before: Floats, after: Floats, elapsed_s: float) -> tuple[Floats, Floats, Floats]:
    """Return the mean velocities between poses, as `observation.velocity` does for one robot."""
    turned = _within_half_turn(after[:, 2] - before[:, 2])
    way = after - before
    forward, left = _in_frame(before[:, 2] + 0.5 * turned, way[:, 0], way[:, 1])
    return forward / elapsed_s, left / elapsed_s, turned / elapsed_s


def _in_frame(headings: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    c, s = _of_each(math.cos, headings), _of_each(math.sin, headings)
    return x * c + y * s, y * c - x * s


def _within_half_turn(angles: Floats) -> Floats:
    """Return each angle in [-pi, pi], as `math.remainder(angle, 2 * pi)` does, without rounding errors."""
    rest = np.fmod(angles, _TURN)
    return np.where(np.abs(rest) > math.pi, rest - np.copysign(_TURN, rest), rest)


def _of_each(function: Callable[[float], float], values: Floats) -> Floats:
    return np.fromiter(map(function, values.tolist()), np.float64, len(values))


def _lengths(x: Floats, y: Floats) -> Floats:
    return np.fromiter(map(math.hypot, x.tolist(), y.tolist()), np.float64, len(x))
