"""The robot of cart_simulator.py as a class, and a task for the robot.

    palaestra run cart.yaml

The class names the devices of the world in cart.yaml; the job names class and task as `cart:Cart` and
`cart:Approach-v0`.
"""

from typing import Any

import gymnasium
import numpy as np

from palaestra_trainer.robots import Distances, Localization, Pose, Steering
from palaestra_trainer.robots.differential import DifferentialDrive
from palaestra_trainer.webots import DistanceSensor

NEAR_M, TOLERANCE_M = 0.4, 0.1
FORWARD_M_S = 0.3
LONGEST = 40  # maximum steps of an episode; a step is 192 ms


class Cart(DifferentialDrive, Distances):
    """A cart with two wheels and a distance sensor at its front."""

    definition = "CART"
    target = None
    wheels = ("left motor", "right motor")
    wheel_radius_m, axle_m, wheel_rad_s = 0.05, 0.3, 10.0
    radius_m, speed_m_s, turn_rad_s = 0.2, 0.5, 3.0
    bearings_rad = (0.0,)
    distance_range_m = (0.0, 2.0)

    def equip(self) -> None:
        """Add the wheels and the distance sensor."""
        super().equip()
        self._front = DistanceSensor(self.node_name, "distance sensor")
        self.simulation.add((self._front,), ())

    def distances(self) -> np.ndarray:
        """Return the meters to the wall in front, shape (1,)."""
        if self._front.value is None:
            raise self._no_reading()
        return np.array([self._front.value], np.float32)


class ApproachEnv(gymnasium.Env[np.ndarray, int]):
    """Drive to the wall, and stop 0.4 m before it."""

    needs = (Steering, Localization, Distances)
    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = gymnasium.spaces.Discrete(3)  # stop, forward, backward

    def __init__(self, robot: Any, scene: Any) -> None:
        self.robot, self.scene = robot, scene

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode at a random distance from the wall."""
        super().reset(seed=seed, options=options)
        self.steps = 0
        start = Pose(self.np_random.uniform(-0.5, 0.9), self.np_random.uniform(-1.0, 1.0), 0.0)
        self.scene.reset(int(self.np_random.integers(2**31)), start, (start.x_m, start.y_m))
        return self.seen(), {}

    def step(self, action: int) -> Any:
        """Drive for one step."""
        self.robot.steer((0.0, FORWARD_M_S, -FORWARD_M_S)[action], 0.0)
        self.robot.advance()
        self.steps += 1
        off_m = abs(float(self.robot.distances()[0]) - NEAR_M)
        over = self.steps == LONGEST
        return self.seen(), -off_m, False, over, {"is_success": over and off_m < TOLERANCE_M}

    def seen(self) -> np.ndarray:
        """Return the observation.

        The first number is the distance to the place where the robot must stop, in half meters. It is
        negative if the robot is too near the wall. The second number is the robot's heading in radians.
        """
        off = (float(self.robot.distances()[0]) - NEAR_M) / 0.5
        return np.clip([off, self.robot.pose().heading_rad], -1.0, 1.0).astype(np.float32)


gymnasium.register(id="Approach-v0", entry_point=ApproachEnv)
