"""A Stable-Baselines3 VecEnv of the copies of a world in one simulator.

A fault of the simulator ends the episodes of all rows; the simulator is then restarted, and the rows are
invalid until it is up. A row whose simulation fails, or whose observation or reward is not finite, ends its
own episode as truncated; the other rows go on. Both kinds of rows have `valid` False, see `infos`.

A resume plays the episodes again. The rows are aligned at their ends: a row with a short episode begins it
later, so that all rows reach their positions in the same step.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import structlog
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from palaestra_protocol.pod.status import Cause
from palaestra_protocol.scene import SceneState
from palaestra_trainer.environments.batched import RESET_MASK
from palaestra_trainer.environments.infos import OURS, TRUNCATED
from palaestra_trainer.episodes.collecting import CollectingVecEnv
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.row_infos import row_infos
from palaestra_trainer.episodes.row_log import RowLog
from palaestra_trainer.episodes.seeds import COLLECT, episode_seed
from palaestra_trainer.errors import Diverged, SimulatorFault, WrongData
from palaestra_trainer.simulators.batch_simulator import BatchSimulator
from palaestra_trainer.simulators.restarter import Restarter, await_one, settle
from palaestra_trainer.waiting.check import Check, go_on

log = structlog.get_logger(__name__)

MOST_TRIES = 3  # resets of a row that fails in its first period, before the simulator counts as faulty
MOST_FAILURES = 100  # failures since the last complete episode, for each row of the batch

Rows = NDArray[np.int64]


class BatchVecEnv(CollectingVecEnv):
    """The copies of a world as a VecEnv.

    Args:
        restarter: the restarter of the simulator, whose member is a `BatchSimulator`.
        run_seed: the replica's seed; it decides each episode's seed, with the row and the episode's number.
        check: called every tenth of a second during a restart; it raises to end the wait.
    """

    def __init__(self, restarter: Restarter, run_seed: int, *, check: Check = go_on) -> None:
        member = restarter.member
        if not isinstance(member, BatchSimulator):
            raise TypeError(f"{restarter.name} is not a simulator with copies")
        self._member, self._env = member, member.batched
        self._restarter, self._check, self._run_seed = restarter, check, run_seed
        rows = self._env.num_envs
        super().__init__(rows, self._env.single_observation_space, self._env.single_action_space)
        self._training_progress = 0.0
        self._episodes, self._began_at = np.zeros(rows, np.int64), np.zeros(rows)
        self._returns, self._started = np.zeros(rows), np.zeros(rows)
        self._log = RowLog(rows)
        self._running = False
        self._fault: dict[str, Any] = {}
        self._failures = 0
        self._actions: Any = np.empty(0)
        self._observation: Any = np.zeros_like(self._env.observation_space.sample())

    def pause(self) -> None:
        """Do nothing: the simulator uses no processor time between two steps."""

    def unpause(self) -> None:
        """Do nothing; see `pause`."""

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Set the run's seed, unless `seed` is None; return the seeds of the next episodes."""
        self._run_seed = self._run_seed if seed is None else seed
        return self._next_seeds(np.arange(self.num_envs))

    def set_training_progress(self, training_progress: float) -> None:
        """Set the share of the training that is complete when the next episodes begin, 0 to 1."""
        self._training_progress = training_progress

    def reset(self) -> VecEnvObs:
        """Begin new episodes in all rows; return their first observations."""
        with self._restarter.watcher.spending(Cause.TRANSPORT):
            self._begin_all()
        self._reset_options()
        return self._observed()

    def snapshot(self) -> list[EpisodeState]:
        """Return the position of each row in its episodes; later steps do not change the result."""
        if not self._running:
            return [EpisodeState(int(episode), None) for episode in self._episodes]
        return [
            EpisodeState(int(self._episodes[row]) - 1, self._log.of_row(row), float(self._began_at[row]))
            for row in range(self.num_envs)
        ]

    def moments(self) -> dict[str, SceneState]:
        """Return the episode and step of row 0; any thread may call this method."""
        length = int(self._log.lengths()[0])
        state = SceneState(time_s=0.0, target=None, episode=int(self._episodes[0]), step=length, rewards={})
        return {self._restarter.name: state}

    def resume(self, states: Sequence[EpisodeState], *, masked: bool = False) -> VecEnvObs:
        """Bring all rows back to their states; return their observations; see `CollectingVecEnv`.

        A row begins its next episode if no episode ran, or if the repeated episode ends earlier. If the
        simulator is down or fails meanwhile, all rows begin their next episodes when it is up.
        """
        del masked  # a batched environment has no masks
        self._episodes[:] = [state.episode for state in states]
        if self._restarter.up():
            try:
                self._replay(states)
            except SimulatorFault as fault:
                self._break(fault)
        if not self._running:
            after = [state.episode + (state.actions is not None) for state in states]
            np.maximum(self._episodes, after, out=self._episodes)
        return self._observed()

    def step_async(self, actions: np.ndarray) -> None:
        """Store `actions`, one for each row, until `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; return observations, rewards, dones and infos.

        Raises:
            FaultBudgetSpent: the simulator failed more often than its restart budget allows.
            Diverged: rows fail again and again, and no episode ends.
        """
        if not self._running:
            return self._recover()
        began = time.perf_counter()
        try:
            with self._restarter.watcher.spending(Cause.TRANSPORT):
                result = self._stepped(self._actions)
        except SimulatorFault as fault:
            self._break(fault)
            return self._all_invalid(done=True)
        seconds = time.perf_counter() - began
        if self._restarter.meter.count_step(seconds):
            self._restarter.watcher.slow(self._restarter.name, seconds)
        return result

    def close(self) -> None:
        """End a restart in the background and close the environment; the caller stops the simulator."""
        settle([self._restarter])
        self._env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the batched environment, once for each chosen row."""
        return [self._member.env.get_wrapper_attr(attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the batched environment, which all rows share; `indices` has no effect."""
        del indices
        self._restarter.set_attribute(attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return the result of a method of the batched environment, once for each chosen row."""
        result = self._member.env.get_wrapper_attr(method_name)(*method_args, **method_kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return False for each chosen row, because a batched environment has no wrappers."""
        del wrapper_class
        return [False for _ in self._get_indices(indices)]

    def _stepped(self, actions: Any) -> VecEnvStepReturn:
        observation, rewards, terminated, truncated, info = self._env.step(actions)
        self._log.append(np.asarray(actions))
        failed = self._member.failed | ~_finite(observation, self.num_envs) | ~np.isfinite(rewards)
        self._returns += np.where(failed, 0.0, rewards)
        dones = terminated | truncated | failed
        infos = row_infos(info, self.num_envs, truncated & ~terminated)
        ended = np.flatnonzero(dones)
        if len(ended):
            self._end(ended, observation, failed, infos)
            self._begin(ended)
        else:
            self._observation = observation
        self._restarter.watcher.stepped(int(self.num_envs - failed.sum()))
        rewards = np.where(failed, 0.0, rewards).astype(np.float32)
        return self._observed(), rewards, dones, infos

    def _end(self, rows: Rows, observation: Any, failed: Any, infos: list[dict[str, Any]]) -> None:
        """Complete the infos of rows whose episodes have ended."""
        lengths, now = self._log.lengths(), time.monotonic()
        for row in rows.tolist():
            last = np.array(observation[row])
            if failed[row]:
                infos[row] = self._failed(row, int(lengths[row]), last)
                continue
            self._failures = 0
            infos[row]["terminal_observation"] = last
            infos[row]["episode"] = {
                "r": round(float(self._returns[row]), 6),
                "l": int(lengths[row]),
                "t": round(now - float(self._started[row]), 6),
            }

    def _failed(self, row: int, length: int, last: Any) -> dict[str, Any]:
        """Count the failure of one row; return the row's info."""
        fact = self._reason(row, "observation or reward")
        fault = WrongData(self._restarter.name, f"row {row}: {fact}")
        self._failures += 1
        if self._failures > MOST_FAILURES * self.num_envs:
            raise Diverged(
                f"{fault}; {self._failures} rows failed, and no episode ended; fix the environment"
            )
        self._restarter.watcher.fault(self._restarter.name, fault, length, restarts=False)
        sim_fault = {
            "kind": fault.kind,
            "simulator": self._restarter.name,
            "fact": str(fault),
            "episode": int(self._episodes[row]) - 1,
            "step": length,
        }
        words = {"valid": False, "sim_fault": sim_fault}
        return {OURS: words, TRUNCATED: True, "terminal_observation": np.nan_to_num(last)}

    def _begin(self, rows: Rows) -> None:
        """Begin the next episode in rows; try again in a row whose simulation fails at once."""
        for _ in range(MOST_TRIES):
            self._reset_rows(rows)
            rows = rows[self._member.failed[rows] | ~_finite(self._observation, self.num_envs)[rows]]
            if not len(rows):
                return
        fact = self._reason(rows[0], "observation")
        raise WrongData(self._restarter.name, f"row {rows[0]} fails at each reset: {fact}")

    def _reason(self, row: int, checked: str) -> str:
        """Return the reason of a row's failure: its simulation, or a `checked` value that is not finite."""
        if self._member.failed[row]:
            return self._member.reason(row)
        return f"the environment's {checked} is not finite"

    def _reset_rows(self, rows: Rows) -> None:
        mask = np.zeros(self.num_envs, dtype=bool)
        mask[rows] = True
        seeds = np.zeros(self.num_envs, np.int64)
        seeds[rows] = self._next_seeds(rows)
        options = {
            RESET_MASK: mask,
            "training_progress": np.full(len(rows), self._training_progress),
            "episode": self._episodes[rows],
        }
        self._began_at[rows] = self._training_progress
        self._episodes[rows] += 1
        self._restarter.give_attributes()
        self._observation, _ = self._env.reset(seed=seeds.tolist(), options=options)
        self._restarter.meter.resets += len(rows)
        self._returns[rows], self._started[rows] = 0.0, time.monotonic()
        self._log.begin(rows)

    def _next_seeds(self, rows: Rows) -> list[int]:
        pairs = zip(rows.tolist(), self._episodes[rows].tolist(), strict=True)
        return [episode_seed(self._run_seed, COLLECT, row, episode) for row, episode in pairs]

    def _begin_all(self) -> None:
        self._running = False
        if self._restarter.up():
            try:
                self._begin(np.arange(self.num_envs))
                self._running = True
            except SimulatorFault as fault:
                self._break(fault)

    def _replay(self, states: Sequence[EpisodeState]) -> None:
        taken = [np.empty(0) if state.actions is None else state.actions for state in states]
        lengths = np.array([len(actions) for actions in taken])
        now = self._training_progress
        progress = np.array([now if state.actions is None else state.training_progress for state in states])
        for step in range(int(lengths.max(initial=0)), -1, -1):
            self._check()
            for share in np.unique(progress[lengths == step]):
                self._training_progress = float(share)
                self._begin(np.flatnonzero((lengths == step) & (progress == share)))
            self._training_progress = now
            if step:
                over = self._repeat(taken, lengths, step)
                lengths[over], progress[over] = 0, now  # the round of step 0 begins their next episodes
        self._running = True

    def _repeat(self, taken: Sequence[np.ndarray], lengths: Any, left: int) -> NDArray[np.bool_]:
        """Repeat one of the `left` remaining steps; return the rows whose episodes end too early."""
        actions: Any = np.zeros_like(self._env.action_space.sample())
        playing = lengths >= left
        for row in np.flatnonzero(playing).tolist():
            actions[row] = taken[row][len(taken[row]) - left]
        self._observation, rewards, terminated, truncated, _ = self._env.step(actions)
        self._log.append(actions)
        self._returns += np.where(np.isfinite(rewards), rewards, 0.0)
        over: NDArray[np.bool_] = (terminated | truncated | self._member.failed) & playing
        return over

    def _recover(self) -> VecEnvStepReturn:
        """Return the rows of a step while the simulator restarts; begin the next episodes when it is up."""
        with self._restarter.watcher.spending(Cause.RECOVERING):
            await_one([self._restarter], self._check)
        seen = self._observed()
        self._begin_all()
        return self._all_invalid(seen, done=self._running, recovering=not self._restarter.lost)

    def _break(self, fault: SimulatorFault) -> None:
        lengths = self._log.lengths()
        self._fault = {
            "kind": fault.kind,
            "simulator": self._restarter.name,
            "fact": str(fault),
            "episode": int(self._episodes[0]) - 1,
            "step": int(lengths[0]),
        }
        lost = int(lengths.sum()) if self._running else 0
        self._running = False
        self._restarter.begin_restart(fault, lost)

    def _all_invalid(self, seen: Any = None, *, done: bool, **words: Any) -> VecEnvStepReturn:
        """Return invalid rows; the first call after a fault puts the fault into the info of row 0."""
        last = self._observed() if seen is None else seen
        infos: list[dict[str, Any]] = [
            {OURS: {"valid": False, **words}, TRUNCATED: done, "terminal_observation": np.array(last[row])}
            for row in range(self.num_envs)
        ]
        if self._fault:
            infos[0][OURS]["sim_fault"], self._fault = self._fault, {}
        rows = self.num_envs
        return self._observed(), np.zeros(rows, np.float32), np.full(rows, done), infos

    def _observed(self) -> np.ndarray:
        return np.array(self._observation)


def _finite(observation: Any, rows: int) -> NDArray[np.bool_]:
    if observation.dtype.kind != "f":
        return np.ones(rows, dtype=bool)
    finite: NDArray[np.bool_] = np.isfinite(observation).reshape(rows, -1).all(axis=1)
    return finite
