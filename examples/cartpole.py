"""An example of your own robot and task, with a model of MuJoCo in `world.inline`.

    palaestra run manifests/examples/cartpole-mjcf.yaml

`CartPole` names the devices of the model, and `BalanceEnv` is the task. The job names them as
`cartpole:CartPole` and `cartpole:Balance-v0`; Palaestra imports this module from PYTHONPATH.
`BatchedBalanceEnv` is the same task with arrays, for jobs with `simulators[].batch`.
"""

from typing import Any

import gymnasium
import numpy as np

from palaestra_trainer.environments.batched import BatchedEnv, generator
from palaestra_trainer.robots import Joints
from palaestra_trainer.robots.batched_base import BatchedJointsAbc
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


class BatchedBalanceEnv(BatchedEnv):
    """Many cart-poles: row i of each array is one of them, and equals a `BalanceEnv` with the same seeds."""

    needs = (BatchedJointsAbc,)

    def __init__(self, robot: Any, scene: Any) -> None:
        super().__init__(robot.rows, BalanceEnv.observation_space, BalanceEnv.action_space)
        self.robot, self.scene = robot, scene
        self.steps = np.zeros(robot.rows)
        scene.use_joints("hinge")

    def begin(self, rows: Any, seeds: Any, options: dict[str, Any]) -> np.ndarray:
        """Begin an episode in these rows; return the observations of all rows."""
        del options
        random = [generator(seed) for seed in seeds]
        noise = [int(one.integers(2**31)) for one in random]
        angles = np.array([[one.uniform(-0.1, 0.1)] for one in random])
        self.scene.begin(rows, noise, joints=angles, commands=np.zeros((len(rows), 1)))
        self.steps[rows] = 0
        return self.observe()

    def step(self, actions: np.ndarray) -> Any:
        """Push every cart for one step."""
        self.robot.command(actions * self.robot.greatest)
        self.robot.advance()
        self.steps += 1
        seen = self.observe()
        fell = (np.abs(seen[:, 0]) > FARTHEST_M) | (np.abs(seen[:, 2]) > STEEPEST_RAD)
        over = self.steps == LONGEST
        return seen, (~fell).astype(float), fell, over, {"is_success": over & ~fell}

    def observe(self) -> np.ndarray:
        """Return a row for each cart: its position and speed, then angle and angular speed of its pole."""
        return np.clip(self.robot.joints(), -10.0, 10.0).astype(np.float32)


gymnasium.register(id="Balance-v0", entry_point=BalanceEnv, vector_entry_point=BatchedBalanceEnv)
