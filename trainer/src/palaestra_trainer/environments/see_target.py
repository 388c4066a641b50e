"""The task: find the red pole in the camera's image and drive to it.

The environment is built from a robot with a color camera and a scene, and depends on
neither ROS nor Webots. It defines the episode: its observations, its end and its
rewards. A `SimulatorFault` of the robot passes through it unchanged.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from palaestra_trainer.environments.actions import action_space, twist
from palaestra_trainer.environments.arena import (
    CYLINDER_CENTER_M,
    CYLINDER_NAMES,
    CYLINDERS,
    Point,
    chosen_task,
)
from palaestra_trainer.environments.options import SeeOptions, time_up_terminates
from palaestra_trainer.environments.rewards import Outcome, Transition, reward_terms
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene

REACHED_M = 0.45
IMAGE = (48, 64, 3)  # rows, columns, colors

Observation = NDArray[np.uint8]
Info = dict[str, Any]


@runtime_checkable
class Stage(Scene, Protocol):
    """A scene in which things can be moved."""

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Put the node with DEF `name` to x, y, z (meters) with the next period; a reset undoes it."""


class SeeTargetEnv(gymnasium.Env[Observation, Any]):
    """See the red pole and drive to it, to within 0.45 m of its middle.

    A Robotino with a camera of 64 x 48 pixels in a walled floor of 4 x 4 m, and a red pole,
    0.5 m high, that is seen and never felt. Start, heading and place of the pole differ in
    every episode, so the pole is often out of sight at the start. The pole counts as reached
    at 0.45 m, where its top and its foot leave the image. A step is one control period of the
    robot (0.192 s in simulation): at 0.5 m/s it drives 0.1 m, at 1 rad/s it turns 11 degrees.

    ## Actions

    As in `MoveToTargetEnv`: with `actions="discrete"` one of the `movements`, all seven by
    default; with `actions="continuous"` forward, left and turning, `Box(-1, 1, (3,), float32)`.
    Three movements are enough: FORWARD, TURN_LEFT and TURN_RIGHT.

    ## Observation

    `Box(uint8)`, the image of the camera, and nothing else. With `frames=3` it has the newest
    three images, the oldest first; the first observation of an episode has one image three times.

    | axis | frames=1 | frames=3 | min | max | meaning                                   |
    |------|----------|----------|-----|-----|-------------------------------------------|
    | 0    | 48       | 48       | 0   | 255 | rows, from the top down                   |
    | 1    | 64       | 64       | 0   | 255 | columns, from left to right               |
    | 2    | 3        | 9        | 0   | 255 | red, green, blue of each image            |

    ## Reward

    The terms and weights of `MoveToTargetEnv`, each also in `info["reward_terms"]`.

    | term      | Dense | Sparse | min  | max | is                                                  |
    |-----------|-------|--------|------|-----|-----------------------------------------------------|
    | progress  | 1     |        | -0.1 | 0.1 | meters gained toward the pole, by one movement      |
    | success   | 1     | 1      | 0    | 1   | 1 when the robot came within 0.45 m                 |
    | collision | -1    | -1     | 0    | 1   | 1 when it ran into something                        |
    | proximity | -0.1  |        | 0    | 1   | grows in a line as things come from 0.18 to 0.03 m  |
    | time_up   |       | -0.5   | 0    | 1   | 1 when the last step was taken without that         |
    | duration  | -0.01 |        | 1    | 1   | 1 for every step                                    |

    ## Start

    `reset(seed=s)` alone decides the episode. Start and pole are drawn uniformly from the
    places where the robot has 0.1 m to spare, at least 1 m apart, and the heading from all
    directions. `options={"start": (x, y, heading), "target": (x, y)}` sets one or both.
    With `cylinders=True` the arena's four cylinders stand on the floor and hide the pole.

    ## End of an episode

    Terminated: the robot reached the pole (`info["is_success"]`), or it bumped into something.
    After `max_steps` steps, `time_up` decides, as in `MoveToTargetEnv`.

    ## Info

    `is_success`, `outcome` (running, reached, collided, time_up), `reward_terms` (by name,
    weighted), `extra_steps` (control periods that a late sensor made necessary).

    Args:
        robot: the robot to drive; its color camera has 64 x 48 pixels.
        scene: arranges episodes; with `cylinders`, it moves things too.
        options: images, actions and rewards.
        on_close: called by `close`.

    Raises:
        ConfigurationError: the scene cannot move the cylinders.
        NoSuchSensor: the robot has no color camera.
    """

    def __init__(
        self,
        robot: RobotinoAbc,
        scene: Scene,
        options: SeeOptions | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        self.options = options or SeeOptions()
        rows, columns, colors = IMAGE
        shape = (rows, columns, colors * self.options.frames)
        self.observation_space = gymnasium.spaces.Box(0, 255, shape, np.uint8)
        self.action_space = action_space(self.options)
        self._robot = robot
        self._scene = scene
        self._stage = _stage(scene) if self.options.cylinders else None
        self._on_close = on_close
        self._frames: deque[Observation] = deque(maxlen=self.options.frames)
        self._target: Point | None = None
        self._steps = 0
        robot.use_cameras(color=True)

    @property
    def target_m(self) -> float:
        """Meters from the robot's center to the pole's.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._target is None:
            raise ResetNeeded("no episode has begun; call reset() first")
        pose = self._robot.pose()
        return math.dist((pose.x_m, pose.y_m), self._target)

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Observation, Info]:
        """Begin an episode that follows from `seed` alone; return its first observation.

        Raises:
            ConfigurationError: `options` names an impossible start or target, or the image has another size.
            SimulatorFault: as the robot raised it.
        """
        super().reset(seed=seed)
        cylinders: Sequence[Point] = CYLINDERS if self._stage else ()
        task = chosen_task(self.np_random, options or {}, cylinders)
        self._scene.reset(int(self.np_random.integers(2**31)), task.start, task.target)
        if self._stage:
            for name, (x_m, y_m) in zip(CYLINDER_NAMES, CYLINDERS, strict=True):
                self._stage.put(name, (x_m, y_m, CYLINDER_CENTER_M))
            self._robot.advance()  # the cylinders are there from then on, and the sensors see them
        self._target, self._steps = task.target, 0
        self._frames.extend([self._image()] * self.options.frames)
        return self._seen(), {"start": task.start, "target": task.target}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Drive according to `action` for one control period; return the result.

        Raises:
            ResetNeeded: no episode has begun.
            SimulatorFault: as the robot raised it.
        """
        before_m = self.target_m
        self._robot.drive(*twist(action, self.options))
        extra_steps = self._robot.advance()
        self._steps += 1
        self._frames.append(self._image())
        outcome = self._outcome()
        step = Transition(
            before_m=before_m,
            after_m=self.target_m,
            nearest_m=float(self._robot.distances().min()),
            outcome=outcome,
        )
        terms = reward_terms(self.options.reward, step)
        info = {
            "is_success": outcome is Outcome.REACHED,
            "outcome": outcome.value,
            "reward_terms": terms,
            "extra_steps": extra_steps,
        }
        time_up, terminates = outcome is Outcome.TIME_UP, time_up_terminates(self.options)
        terminated = outcome.terminal or (time_up and terminates)
        return self._seen(), sum(terms.values()), terminated, time_up and not terminates, info

    def close(self) -> None:
        """Release the simulator, if this environment took it from PALAESTRA_CONFIG; safe to repeat."""
        if self._on_close is not None:
            self._on_close()

    def _outcome(self) -> Outcome:
        if self._robot.bumped():
            return Outcome.COLLIDED
        if self.target_m < REACHED_M:
            return Outcome.REACHED
        return Outcome.TIME_UP if self._steps >= self.options.max_steps else Outcome.RUNNING

    def _image(self) -> Observation:
        """Return a copy of the camera's image, which is valid until the next step only."""
        image = self._robot.color_image()
        if image.shape != IMAGE:
            raise ConfigurationError(
                f"the camera's image has the shape {image.shape}, and SeeTarget-v0 needs {IMAGE}; "
                "set width and height of the Camera in the world"
            )
        return np.array(image, order="C")

    def _seen(self) -> Observation:
        """Return the newest images as one new array."""
        return np.concatenate(self._frames, axis=2)


def _stage(scene: Scene) -> Stage:
    if not isinstance(scene, Stage):
        raise ConfigurationError(
            f"cylinders: {type(scene).__name__} cannot move them, since it has no method put; "
            "set cylinders to false, or add the method"
        )
    return scene
