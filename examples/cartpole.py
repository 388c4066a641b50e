"""An example of your own robot and task, with a model of MuJoCo in `world.inline`.

    palaestra run manifests/examples/cartpole-mjcf.yaml

`CartPole` names the devices of the model, and `BalanceEnv` is the task. The job names them as
`cartpole:CartPole` and `cartpole:Balance-v0`; Palaestra imports this module from PYTHONPATH.
"""

from typing import Any

import gymnasium
import numpy as np

from palaestra_trainer.robots import Joints
from palaestra_trainer.robots.joints import JointRobot

FARTHEST_M, STEEPEST_RAD = 1.5, 0.3
LONGEST = 250  # maximum steps of an episode; a step is 40 ms


class CartPole(JointRobot):
    """A cart on a rail, with a pole that falls; a motor pushes the cart."""

    period_ms = 40
    motors = ("push",)
    greatest = (10.0,)  # N
    sensors = ("cart position", "cart speed", "pole angle", "pole speed")


class BalanceEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """Keep the pole up for 10 s; each step with the pole up has reward 1."""

    needs = (Joints,)
    observation_space = gymnasium.spaces.Box(-10.0, 10.0, (4,), np.float32)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def __init__(self, robot: Any, scene: Any) -> None:
        self.robot, self.scene = robot, scene

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode with the pole at a small angle."""
        super().reset(seed=seed, options=options)
        self.steps = 0
        self.scene.begin(int(self.np_random.integers(2**31)))
        self.scene.set_joint("hinge", self.np_random.uniform(-0.1, 0.1))
        self.robot.command([0.0])
        self.robot.advance()
        return self.observe(), {}

    def step(self, action: np.ndarray) -> Any:
        """Push the cart for one step."""
        self.robot.command(action * self.robot.greatest)
        self.robot.advance()
        self.steps += 1
        seen = self.observe()
        fell = bool(abs(seen[0]) > FARTHEST_M or abs(seen[2]) > STEEPEST_RAD)
        over = self.steps == LONGEST
        return seen, float(not fell), fell, over, {"is_success": over and not fell}

    def observe(self) -> np.ndarray:
        """Return position and speed of the cart, then angle and angular speed of the pole."""
        return np.clip(self.robot.joints(), -10.0, 10.0).astype(np.float32)


gymnasium.register(id="Balance-v0", entry_point=BalanceEnv)
