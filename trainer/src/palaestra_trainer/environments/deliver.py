"""The task to drive to three targets in turn, and to stand on each.

World, robot, observations and rewards are those of `MoveToTargetEnv`. So the same world has tasks of
different difficulty.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.options import DeliverOptions
from palaestra_trainer.environments.placement import FreePlaces
from palaestra_trainer.robots.base import RobotinoAbc, Scene
from palaestra_trainer.robots.geometry import Point


class DeliverEnv(MoveToTargetEnv):
    """Drive to three targets in turn and stand on each: within 0.20 m, slower than 0.05 m/s.

    The task differs from `MoveToTargetEnv` in these points:

    - The mark shows one target. When the robot stands on this target, the mark moves to the next target, at
      least 1 m away, and the episode continues. `options.targets` is the number of targets.
    - The part `target` of an observation is the current target. The part `to_reach` is the share of the
      targets that are left: 1, 2/3, 1/3. By default the observation includes `to_reach`.
    - The robot earns `success` for each target. `info["outcome"]` of such a step is `delivered`, or `reached`
      for the last target. `info["is_success"]` is true only for the last target.
    - Time is up after 300 steps.

    `reset(options={"start": (x, y, heading), "target": (x, y)})` sets the start and the first target.

    Args:
        robot: the robot to drive.
        scene: the scene, which places robot and mark for each episode.
        options: the options for observation, actions and rewards.
        on_close: a function that `close` calls.

    Raises:
        MissingCapability: the robot is not a Robotino.
    """

    def __init__(
        self,
        robot: RobotinoAbc,
        scene: Scene,
        options: DeliverOptions | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        chosen = options or DeliverOptions()
        self._count = chosen.targets
        super().__init__(robot, scene, chosen, on_close)

    def _more_targets(self, places: FreePlaces, first: Point) -> Iterable[Point]:
        target = first
        for _ in range(self._count - 1):
            target = places.draw_from(self.np_random, target)
            yield target
