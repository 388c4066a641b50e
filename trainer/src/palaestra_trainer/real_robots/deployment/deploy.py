"""Drive episodes of a policy on a robot: a dry run first, then as many episodes as there are targets."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.environments.masks import mask_of
from palaestra_trainer.errors import RobotStopped
from palaestra_trainer.real_robots.deployment.checked_package import CheckedPackage
from palaestra_trainer.real_robots.deployment.record import DeploymentRecord
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.scene import RealScene
from palaestra_trainer.robots.geometry import Point, Pose, Twist

REHEARSED: Final = 10  # steps of a dry run
Show = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class DrivenEpisode:
    """The end of an episode.

    Attributes:
        steps: steps of the policy.
        success: whether the task counts the episode as a success; None if the task does not report success.
        outcome: the task's word for the end.
    """

    steps: int
    success: bool | None
    outcome: str


class Deployment:
    """A policy on a robot.

    Args:
        package: the policy and its environment.
        robot: the connected robot.
        record: the record of the deployment.
        show: shows a line of status, which the next line may replace.

    Raises:
        ConfigurationError: the environment cannot be made, or differs from that of the training.
    """

    def __init__(
        self, package: CheckedPackage, robot: RealRobotino, record: DeploymentRecord, show: Show
    ) -> None:
        self._policy = package.policy
        self._robot = robot
        self._record = record
        self._show = show
        robot.image_size = package.image_size or robot.image_size
        self._scene = RealScene(robot, _refuse_to_carry)
        self._env = make_environment(package.environment, robot, self._scene)
        package.refuse_other(self._env)

    def rehearse(self, target: Point | None) -> None:
        """Let the policy act on live readings for some steps, while a muted robot gets no command."""
        self._record.note({"begin": "dry run"})
        observation = self._begin(target)
        for _ in range(REHEARSED):
            action = self._act(observation)
            observation, _, terminated, truncated, _ = self._env.step(action)
            self._show(f"dry run: {_text(self._robot.commanded)}")
            if terminated or truncated:
                return

    def drive(self, target: Point | None) -> DrivenEpisode:
        """Drive one episode from where the robot stands, and return its end.

        Raises:
            RobotStopped: a safety rule has stopped the robot.
        """
        self._record.note({"begin": "episode"})
        observation = self._begin(target)
        steps, over, info = 0, False, dict[str, Any]()
        while not over:
            action = self._act(observation)
            self._record.step(self._robot.distances(), observation, action)
            if (image := self._robot.seen_image()) is not None:
                self._record.image(image)
            observation, _, terminated, truncated, info = self._env.step(action)
            steps, over = steps + 1, terminated or truncated
            self._show_step(steps)
        self._robot.stand()
        success = info.get("is_success")
        end = DrivenEpisode(
            steps, None if success is None else bool(success), str(info.get("outcome", "ended"))
        )
        self._record.note({"episode": end.outcome, "steps": steps, "success": end.success})
        return end

    def _begin(self, target: Point | None) -> Any:
        self._robot.stand()
        pose = self._robot.pose()
        options: dict[str, Any] = {"start": (pose.x_m, pose.y_m, pose.heading_rad)}
        if target is not None:
            options["target"] = target
        self._policy.begin()
        observation, _ = self._env.reset(options=options)
        if self._scene.target is not None:
            self._record.target(*self._scene.target)
        return observation

    def _act(self, observation: Any) -> Any:
        return self._policy.act(observation, mask_of(self._env) if self._policy.takes_masks else None)

    def _show_step(self, steps: int) -> None:
        pose = self._robot.pose()
        place = f"x {pose.x_m:+.2f} m, y {pose.y_m:+.2f} m, heading {math.degrees(pose.heading_rad):+.0f}°"
        self._show(f"step {steps}: {place}; {_text(self._robot.commanded)}")


def _text(twist: Twist) -> str:
    return f"forward {twist[0]:+.2f} m/s, left {twist[1]:+.2f} m/s, turn {twist[2]:+.2f} rad/s"


def _refuse_to_carry(start: Pose) -> None:
    raise RobotStopped(
        f"the task begins at ({start.x_m:.2f}, {start.y_m:.2f}), where the robot does not stand; deploy a "
        "task that takes its start from the options of reset"
    )
