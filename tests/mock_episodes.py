"""Episodes of a policy on a mock robot, judged by the robot's true pose."""

import math

import numpy as np

from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.environments.move_to_target import REACHED_M
from palaestra_trainer.environments.placement import FreePlaces
from palaestra_trainer.errors import RobotStopped
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.safety import SafetyRules
from palaestra_trainer.real_robots.scene import RealScene
from palaestra_trainer.robots.base import OUTLINE_M
from palaestra_trainer.robots.geometry import SPEED_M_S
from palaestra_trainer.testing import fake_arena


class MockFloor(RealScene):
    """The floor of a mock robot: it knows the arena, and places the robot where a person would."""

    def __init__(self, robot, client):
        super().__init__(robot, lambda start: place(client, start))
        self._arena = fake_arena()[1].layout()

    def layout(self):
        """Return the arena that the mock robot drives in."""
        return self._arena


def place(client, start):
    """Carry the robot to a pose."""
    client.send("/mock/place", [start.x_m, start.y_m, start.heading_rad])


def tasks(count, seed):
    """Return starts and targets on the free floor of the arena."""
    random = np.random.default_rng(seed)
    places = FreePlaces(layout=fake_arena()[1].layout(), radius_m=OUTLINE_M)
    return [places.draw_task(random) for _ in range(count)]


def succeeded(client, package, link, speed, wanted):
    """Return for each task whether the robot truly stands on its target at the end of the episode."""
    clock = RobotClock(speed)
    with RealRobotino(link(clock), SafetyRules(speed_m_s=SPEED_M_S), package.period_s, clock) as robot:
        robot.connect()
        env = make_environment(package.environment, robot, MockFloor(robot, client))
        return [episode(env, package.policy, client, task) for task in wanted]


def episode(env, policy, client, task):
    """Play an episode; return whether the robot truly stands on its target."""
    place(client, task.start)
    policy.begin()
    over = False
    try:
        observation, _ = env.reset(options={"start": task.start, "target": task.target})
        while not over:
            observation, _, terminated, truncated, info = env.step(policy.act(observation))
            over = terminated or truncated
    except RobotStopped:
        return False
    truth = client.get("/mock/truth")
    away_m = math.dist((truth["x"], truth["y"]), task.target)
    return bool(info["is_success"]) and away_m < REACHED_M
