"""Many simulators as one Stable-Baselines3 VecEnv, in which faults are ordinary.

All members step at the same time, each in a thread of its own; a single member
steps in the caller's. A member that breaks is restarted alone and its row is
marked invalid, see `palaestra_trainer.simulators.collector`. Threads, not
processes: a step waits for a simulator's answer and uses next to no
processor, and what is shared needs no pickling.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.env_util import is_wrapped
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from palaestra_trainer.errors import SimulatorHung
from palaestra_trainer.simulators.collector import Collector, Row
from palaestra_trainer.simulators.member import Environment, Keeper

Work = Callable[[], Any]
Answer = tuple[Any, BaseException | None]


class _Worker:
    """One thread that does one thing at a time for one member."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._work: queue.SimpleQueue[Work | None] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._thread.start()

    def begin(self, work: Work) -> None:
        self._work.put(work)

    def result(self, deadline_s: float) -> Any:
        try:
            value, error = self._answers.get(timeout=deadline_s)
        except queue.Empty:
            raise SimulatorHung(self._name, f"its thread gave no answer for {deadline_s:g} s") from None
        if error is not None:
            raise error
        return value

    def end(self) -> None:
        self._work.put(None)

    def _serve(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                self._answers.put((work(), None))
            except BaseException as error:  # noqa: BLE001 - raised again by result(), in the caller's thread
                self._answers.put((None, error))


class SimulatorsVecEnv(VecEnv):
    """The collecting simulators of a run, for Stable-Baselines3.

    Args:
        keepers: one for each member; rows are in their order.
        run_seed: the replica's seed; each episode's own follows from it.
        episodes: for each member the number of its next episode, to continue a run.
        deadline_s: longest wait for one step of all members, restarts included.
    """

    def __init__(
        self,
        keepers: Sequence[Keeper],
        run_seed: int,
        *,
        episodes: Sequence[int] | None = None,
        deadline_s: float = 600.0,
    ) -> None:
        numbers = list(episodes or [])
        numbers += [0] * (len(keepers) - len(numbers))
        self._collectors = [
            Collector(keeper, run_seed, index, number)
            for index, (keeper, number) in enumerate(zip(keepers, numbers, strict=True))
        ]
        self._deadline_s = deadline_s
        self._watcher = keepers[0].watcher
        env = keepers[0].member.env
        super().__init__(len(keepers), env.observation_space, env.action_space)
        self._seeds = [None] * self.num_envs
        self._actions = np.empty(0)
        self._workers = [_Worker(keeper.name) for keeper in keepers] if self.num_envs > 1 else []

    @property
    def episodes(self) -> list[int]:
        """For each member the number of the next episode it will begin."""
        return [collector.episode for collector in self._collectors]

    def pause(self) -> None:
        """Let all members rest until `run`."""
        self._all(collector.keeper.pause for collector in self._collectors)

    def run(self) -> None:
        """End the rest of all members."""
        self._all(collector.keeper.run for collector in self._collectors)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Make `seed` the run's seed, if one is given; return the seeds of the next episodes."""
        for collector in self._collectors:
            collector.run_seed = collector.run_seed if seed is None else seed
        return [collector.next_seed() for collector in self._collectors]

    def reset(self) -> VecEnvObs:
        """Return the first observations of new episodes, begun in all members at once."""
        observations = self._all(
            partial(collector.begin, options or None)
            for collector, options in zip(self._collectors, self._options, strict=True)
        )
        self._reset_options()
        self._keep_reset_infos()
        return self._stack(observations)

    def step_async(self, actions: np.ndarray) -> None:
        """Begin a step with `actions`, one for each member, in all members at once."""
        self._actions = actions
        for worker, collector, action in zip(
            self._workers, self._collectors, actions, strict=bool(self._workers)
        ):
            worker.begin(partial(collector.step, action))

    def step_wait(self) -> VecEnvStepReturn:
        """Return observations, rewards, dones and infos of the step that was begun.

        Raises:
            SimulatorHung: a member's thread did not come back in time; the run cannot go on.
            FaultBudgetSpent: a member broke more often than its budget allows.
        """
        rows: list[Row] = self._results() if self._workers else [self._collectors[0].step(self._actions[0])]
        self._watcher.stepped(len(rows))
        dones = np.array([row.done for row in rows])
        if dones.any():
            self._keep_reset_infos()
        return (
            self._stack([row.observation for row in rows]),
            np.array([row.reward for row in rows], dtype=np.float32),
            dones,
            [row.info for row in rows],
        )

    def close(self) -> None:
        """End the threads and close the environments; the simulators are their owner's."""
        for worker in self._workers:
            worker.end()
        for env in self._targets(None):
            env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the chosen environments, also one behind wrappers."""
        return [env.get_wrapper_attr(attr_name) for env in self._targets(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the chosen environments."""
        for env in self._targets(indices):
            setattr(env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return what a method of the chosen environments returns."""
        return [
            env.get_wrapper_attr(method_name)(*method_args, **method_kwargs) for env in self._targets(indices)
        ]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return for each chosen environment whether it is wrapped in `wrapper_class`."""
        return [is_wrapped(env, wrapper_class) for env in self._targets(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return a picture of each environment, None where it draws none."""
        return [cast("np.ndarray | None", env.render()) for env in self._targets(None)]

    def _targets(self, indices: VecEnvIndices) -> list[Environment]:
        return [self._collectors[index].env for index in self._get_indices(indices)]

    def _keep_reset_infos(self) -> None:
        self.reset_infos = [collector.reset_info for collector in self._collectors]

    def _all(self, works: Iterable[Work]) -> list[Any]:
        if not self._workers:
            return [work() for work in works]
        for worker, work in zip(self._workers, works, strict=True):
            worker.begin(work)
        return self._results()

    def _results(self) -> list[Any]:
        # All of them are awaited before an error is raised: no thread may still be in a
        # step when the caller cleans up.
        answers: list[Any] = []
        errors: list[BaseException] = []
        for worker in self._workers:
            try:
                answers.append(worker.result(self._deadline_s))
            except Exception as error:  # noqa: BLE001 - the first one is raised below
                errors.append(error)
        if errors:
            raise errors[0]
        return answers

    def _stack(self, observations: list[Any]) -> VecEnvObs:
        if isinstance(self.observation_space, spaces.Dict):
            return {
                key: np.stack([observation[key] for observation in observations])
                for key in self.observation_space.spaces
            }
        return np.stack(observations)
