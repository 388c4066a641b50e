"""A trainer of your own for a robot of your own: a model of MuJoCo in `world.inline`.

    palaestra run manifests/examples/cartpole-mjcf.yaml

It balances the pole by random search over linear policies, with numpy alone. Palaestra starts the
simulator with the ROS names of this job; the program drives it by the services of Webots. SIGTERM ends
it with an exit code that asks to be started again; the search goes on from the best policy so far.
"""

import os
import signal
import sys
import threading
from pathlib import Path

import numpy as np

from palaestra_trainer import report
from palaestra_trainer.configuration import load
from palaestra_trainer.launching.sidecar import Sidecar
from palaestra_trainer.ros import RosService, ensure_node
from palaestra_trainer.webots import Mode, Webots
from palaestra_trainer.webots.devices import PositionSensor

STEP_MS = 40
FARTHEST_M, STEEPEST_RAD, STRONGEST_N = 1.5, 0.3, 10.0
LONGEST = 250  # steps of an episode
SENSORS = ("cart position", "cart speed", "pole angle", "pole speed")  # each is one number

job = load()  # what PALAESTRA_CONFIG names: the TrainingJob, resolved for this replica
saved = Path(os.environ["PALAESTRA_RUN"]) / "policy.npy"  # outlives the pod
interrupted = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: interrupted.set())


class CartPole:
    """The simulated cart-pole: reset, push, observe."""

    def __init__(self) -> None:
        simulator = job.with_role("Collect")[0]
        sidecar = Sidecar(simulator.control, simulator.name)
        self.robot = sidecar.state().robots[0].ros_name
        self.webots = Webots(self.robot, simulator.world, launcher=sidecar)
        self.webots.start()
        self.webots.supervisor.set_mode(Mode.FAST)
        self.time_step = self.service("robot/time_step", "set_int")
        self.push = self.service("push/set_force", "set_float")
        self.reset_world = self.service("supervisor/simulation_reset", "get_bool")
        self.put_joint = self.service("supervisor/node/set_joint_position", "node_set_joint_position")
        find = self.service("supervisor/get_from_def", "supervisor_get_from_def")
        self.hinge = find(name="hinge").node
        self.sensors = [PositionSensor(self.robot, name) for name in SENSORS]
        for sensor in self.sensors:
            sensor.enable(STEP_MS)

    def service(self, path: str, type_name: str) -> RosService:
        """Return a service of the robot."""
        return RosService(f"/{self.robot}/{path}", f"webots_ros/{type_name}")

    def reset(self, angle_rad: float) -> np.ndarray:
        """Begin an episode with the pole at an angle; return the first observation."""
        self.reset_world(ask=True)
        self.time_step(value=STEP_MS)
        self.put_joint(node=self.hinge, position=angle_rad, index=1)
        return self.step(0.0)

    def step(self, force_n: float) -> np.ndarray:
        """Push for one step; return position, speed, angle and its speed after it."""
        self.push(value=force_n)
        self.time_step(value=STEP_MS)
        for sensor in self.sensors:
            sensor.read()
        return np.array([sensor.value for sensor in self.sensors])


def balance(robot: CartPole, policy: np.ndarray, angle_rad: float) -> int:
    """Return for how many steps a policy keeps the pole up."""
    seen = robot.reset(angle_rad)
    for step in range(LONGEST):
        if abs(seen[0]) > FARTHEST_M or abs(seen[2]) > STEEPEST_RAD:
            return step
        seen = robot.step(float(np.clip(policy @ seen, -STRONGEST_N, STRONGEST_N)))
    return LONGEST


ensure_node("cartpole_trainer")
robot = CartPole()
random = np.random.default_rng(job.seed)
best = np.load(saved) if saved.exists() else np.zeros(4)
record, steps = 0, 0
while steps < job.steps and record < 3 * LONGEST and not interrupted.is_set():
    policy = best + random.normal(size=4, scale=5.0)
    lengths = [balance(robot, policy, angle_rad) for angle_rad in (-0.1, 0.05, 0.1)]
    steps += sum(lengths)
    if sum(lengths) > record:
        record, best = sum(lengths), policy
        np.save(saved, best)
    report(step=steps)
robot.webots.stop()
if interrupted.is_set():
    sys.exit(75)  # interrupted, start me again
print(f"balances for {record / 3:.0f} of {LONGEST} steps after {steps}")
