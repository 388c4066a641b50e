"""The task to find the red pole in the camera's image and drive to it.

The environment consists of a scene and a robot with a color camera, and depends on neither ROS nor Webots. It
defines the observations, the rewards and the end of an episode. It does not catch a `SimulatorFault` of the
robot.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from palaestra_trainer.environments.actions import action_space, twist
from palaestra_trainer.environments.options import SeeOptions
from palaestra_trainer.environments.placement import FreePlaces
from palaestra_trainer.environments.rewards import EpisodeOutcome, Transition
from palaestra_trainer.environments.step_result import result
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.robots.capabilities import Cameras, require
from palaestra_trainer.robots.geometry import Point

REACHED_M = 0.45
IMAGE = (48, 64, 3)  # rows, columns, colors

Observation = NDArray[np.uint8]
Info = dict[str, Any]


class SeeTargetEnv(gymnasium.Env[Observation, Any]):
    """Find the red pole with the camera, and drive to within 0.45 m of its middle.

    A Robotino with a camera of 64 x 48 pixels drives on a walled floor of 4 x 4 m with a red pole, 0.5 m
    high. The pole is visible, but the robot cannot collide with it. Start, heading and position of the pole
    differ in every episode, so the pole is often out of sight at the start. The pole counts as reached at
    0.45 m, where its top and its foot leave the image. A step is one control period of the robot (0.192 s in
    simulation). In a step the robot drives 0.1 m at 0.5 m/s, and turns 11 degrees at 1 rad/s.

    ## Actions

    The actions are those of `MoveToTargetEnv`. With `actions="discrete"` an action is one of the `movements`,
    by default one of all seven. With `actions="continuous"` an action is forward, left and turning, `Box(-1,
    1, (3,), float32)`. Three movements are enough: FORWARD, TURN_LEFT and TURN_RIGHT.

    ## Observation

    The space is a `Box(uint8)` with only the image of the camera. With `frames=3` the space has the newest
    three images, the oldest first. The first observation of an episode then has the same image three times.

    | axis | frames=1 | frames=3 | min | max | meaning                                   |
    |------|----------|----------|-----|-----|-------------------------------------------|
    | 0    | 48       | 48       | 0   | 255 | rows, from the top down                   |
    | 1    | 64       | 64       | 0   | 255 | columns, from left to right               |
    | 2    | 3        | 9        | 0   | 255 | red, green, blue of each image            |

    ## Reward

    The terms and weights are those of `MoveToTargetEnv`; `info["reward_terms"]` has each term.

    | term      | Dense | Sparse | min  | max | is                                                  |
    |-----------|-------|--------|------|-----|-----------------------------------------------------|
    | progress  | 1     |        | -0.1 | 0.1 | meters gained toward the pole, by one movement      |
    | success   | 1     | 1      | 0    | 1   | 1 when the robot came within 0.45 m                 |
    | collision | -1    | -1     | 0    | 1   | 1 when it ran into something                        |
    | proximity | -0.1  |        | 0    | 1   | rises linearly as objects come from 0.18 to 0.03 m  |
    | time_up   |       | -0.5   | 0    | 1   | 1 when time is up without success or collision      |
    | duration  | -0.01 |        | 1    | 1   | 1 for every step                                    |

    ## Start

    Only the seed of `reset(seed=s)` decides the start, the heading and the position of the pole. Start and
    pole are drawn uniformly from the free positions, at least 1 m apart. At a free position the robot has 0.1
    m of free space around it. The heading is drawn from all directions. `options={"start": (x, y, heading),
    "target": (x, y)}` sets the start, the pole or both. With `cylinders=True` the world's four cylinders
    stand on the floor and can hide the pole.

    ## End of an episode

    An episode is terminated when the robot reaches the pole (`info["is_success"]`) or bumps into an object.
    After `max_steps` steps, the option `time_up` decides between terminated and truncated, as in
    `MoveToTargetEnv`.

    ## Info

    `is_success`, `outcome` (running, reached, collided, time_up), `reward_terms` (by name, weighted),
    `extra_steps` (control periods that the step waited for a late sensor).

    Args:
        robot: the robot to drive, a `RobotinoAbc` with `Cameras`; its color camera has 64 x 48 pixels.
        scene: the scene, which places robot and pole for each episode.
        options: the options for images, actions and rewards.
        on_close: a function that `close` calls.

    Raises:
        MissingCapability: the robot is not a Robotino with cameras.
        NoSuchSensor: the connected robot does not have the color camera.
    """

    needs: ClassVar[tuple[type, ...]] = (RobotinoAbc, Cameras)

    def __init__(
        self,
        robot: Any,
        scene: Scene,
        options: SeeOptions | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        require(robot, self.needs, type(self).__name__)
        self.options = options or SeeOptions()
        rows, columns, colors = IMAGE
        shape = (rows, columns, colors * self.options.frames)
        self.observation_space = gymnasium.spaces.Box(0, 255, shape, np.uint8)
        self.action_space = action_space(self.options)
        # Both attributes are the same robot, because Python has no type for a class with two capabilities.
        self._robot: RobotinoAbc = robot
        self._eyes: Cameras = robot
        self._scene = scene
        self._on_close = on_close
        self._frames: deque[Observation] = deque(maxlen=self.options.frames)
        self._target: Point | None = None
        self._steps = 0
        self._eyes.use_cameras(color=True)

    @property
    def target_m(self) -> float:
        """Meters from the robot's center to the center of the pole.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._target is None:
            raise ResetNeeded("no episode has begun; call reset() first")
        pose = self._robot.pose()
        return math.dist((pose.x_m, pose.y_m), self._target)

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Observation, Info]:
        """Begin the episode that `seed` decides; return its first observation and info.

        Raises:
            ConfigurationError: `options` sets an impossible start or target, or the image has another size.
            SimulatorFault: the simulator of the robot failed.
        """
        super().reset(seed=seed)
        self._scene.begin(int(self.np_random.integers(2**31)))
        if self.options.cylinders:
            self._raise_cylinders()
        places = FreePlaces(layout=self._scene.layout(), radius_m=self._robot.radius_m)
        task = places.chosen_task(self.np_random, options or {})
        self._scene.place(task.start, task.target)
        self._target, self._steps = task.target, 0
        self._frames.extend([self._image()] * self.options.frames)
        return self._seen(), {"start": task.start, "target": task.target}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Drive with the velocity of `action` for one control period; return the result of the step.

        Raises:
            ResetNeeded: no episode has begun.
            SimulatorFault: the simulator of the robot failed.
        """
        before_m = self.target_m
        self._robot.drive(*twist(action, self.options))
        extra_steps = self._robot.advance()
        self._steps += 1
        self._frames.append(self._image())
        step = Transition(
            before_m=before_m,
            after_m=self.target_m,
            nearest_m=float(self._robot.distances().min()),
            outcome=self._outcome(),
        )
        return self._seen(), *result(step, self.options, extra_steps)

    def close(self) -> None:
        """Release the simulator if it is one of PALAESTRA_CONFIG; further calls have no effect."""
        if self._on_close is not None:
            self._on_close()

    def _raise_cylinders(self) -> None:
        """Move the cylinders onto the floor; the world stores them below the floor."""
        for thing in self._scene.layout().obstacles:
            if thing.top_m < 0.0:
                self._scene.put(thing.name, (thing.x_m, thing.y_m, 0.5 * (thing.top_m - thing.bottom_m)))

    def _outcome(self) -> EpisodeOutcome:
        if self._robot.bumped():
            return EpisodeOutcome.COLLIDED
        if self.target_m < REACHED_M:
            return EpisodeOutcome.REACHED
        return EpisodeOutcome.TIME_UP if self._steps >= self.options.max_steps else EpisodeOutcome.RUNNING

    def _image(self) -> Observation:
        """Return a copy of the camera's image; the original is valid only until the next step."""
        image = self._eyes.color_image()
        if image.shape != IMAGE:
            raise ConfigurationError(
                f"the camera's image has the shape {image.shape}, but SeeTarget-v0 needs {IMAGE}; "
                "set width and height of the Camera in the world"
            )
        return np.array(image, order="C")

    def _seen(self) -> Observation:
        """Return the newest images as one new array."""
        return np.concatenate(self._frames, axis=2)
