"""A member that plays one episode after another, and returns its row of each vector step.

The collector converts a step of gymnasium into the row that Stable-Baselines3 expects. The last step of an
episode also resets the environment. The info has `terminal_observation`, `TimeLimit.truncated`, and `episode`
as the Monitor wrapper sets it.

The collector converts a fault into invalid rows (`valid` is False), so the other members need not wait for
the faulty member. The row of the fault ends the episode (done, truncated, `sim_fault`). In the following
rows, `recovering` is True. The last recovering row has `done=True` and the first observation of the next
episode. If the run continues without the member, all its further rows are invalid and `recovering` is False.
`palaestra_trainer.environments.infos` describes these keys.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
import structlog
from gymnasium import spaces
from gymnasium.vector.utils import create_empty_array

from palaestra_protocol.scene import MOST_TERMS, SceneState, TargetMarker
from palaestra_trainer.environments.copies import copied
from palaestra_trainer.environments.infos import HIDDEN, OURS, TRUNCATED, of_environment
from palaestra_trainer.environments.masks import all_allowed, allows
from palaestra_trainer.episodes.episode_state import ActionLog, EpisodeState
from palaestra_trainer.episodes.reset_options import reset_options
from palaestra_trainer.episodes.seeds import COLLECT, episode_seed
from palaestra_trainer.errors import Diverged, SimulatorFault
from palaestra_trainer.simulators.interface import Environment, Located, Step
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.check import Check, go_on

log = structlog.get_logger(__name__)


class CollectedRow(NamedTuple):
    """The row of one member in a vector step.

    Attributes:
        observation: the next observation. After the end of an episode, it is the first observation of the
            next episode, unless that episode has not begun yet.
        reward: reward of this step; 0 in an invalid row.
        done: whether an episode ended, by termination, by a time limit or by a fault. In a recovering row,
            whether the next episode has begun.
        info: the environment's info, with the keys that the docstring of this module describes.
    """

    observation: Any
    reward: float
    done: bool
    info: dict[str, Any]


class Collector:
    """Plays the episodes of one member; the seed of each episode follows from its number.

    Attributes:
        restarter: the restarter of the member.
        run_seed: the replica's seed.
        index: the member's index among the collecting members.
        episode: number of the next episode.
        training_progress: share of the training that is complete when the next episode begins, 0 to 1.
        reset_info: the environment's info of the last reset; if the reset failed, this info has `valid`
            False.
    """

    def __init__(self, restarter: Restarter, run_seed: int, index: int, check: Check = go_on) -> None:
        self.restarter = restarter
        self.run_seed = run_seed
        self.index = index
        self.episode = 0
        self.training_progress = self._began_at = 0.0
        self.reset_info: dict[str, Any] = {}
        self._check = check
        self._started = time.monotonic()
        # `begin` returns this observation while the member has not started.
        self._observation: Any = blank(self.env.observation_space)
        self._return, self._length = 0.0, 0
        self._actions: ActionLog | None = None
        self._news: dict[str, Any] = {}
        self._found_broken: SimulatorFault | None = None
        self._hidden: set[str] = set()
        self._newest: dict[str, Any] = {}  # the info of the last step

    @property
    def env(self) -> Environment:
        """The member's environment."""
        return self.restarter.member.env

    @property
    def observation(self) -> Any:
        """The newest observation of the member."""
        return self._observation

    @property
    def state(self) -> EpisodeState:
        """The current state of the member's episode."""
        if self._actions is None:
            return EpisodeState(self.episode, None)
        return EpisodeState(self.episode - 1, self._actions.taken(), self._began_at)

    @property
    def moment(self) -> SceneState:
        """The episode, step, target and newest reward terms of the member, for a viewer."""
        terms = self._newest.get("reward_terms")
        given = list(terms.items())[:MOST_TERMS] if isinstance(terms, dict) else []
        rewards = {str(name): float(value) for name, value in given if isinstance(value, int | float)}
        return SceneState(
            time_s=0.0, target=self._target(), episode=self.episode, step=self._length, rewards=rewards
        )

    def _target(self) -> TargetMarker | None:
        """Return the target on the floor; None if the member's task has no target."""
        member = self.restarter.member
        sight = member.sight() if isinstance(member, Located) else None
        if sight is None or sight.target is None:
            return None
        return TargetMarker(position=(*sight.target, 0.0))

    def next_seed(self) -> int:
        """Return the seed of the next episode."""
        return episode_seed(self.run_seed, COLLECT, self.index, self.episode)

    def begin(self, options: dict[str, Any] | None = None) -> Any:
        """Begin the next episode if the member is up; return the current observation.

        Raises:
            FaultBudgetSpent: the member's restart budget is used up.
        """
        self._actions = self._found_broken = None
        self.reset_info = {OURS: {"valid": False}}
        self._return, self._length = 0.0, 0
        if self.restarter.up():
            try:
                self._reset(options)
            except SimulatorFault as fault:
                self._break(fault)
        return self._observation

    def action_mask(self) -> np.ndarray:
        """Return the mask of allowed actions for the next step.

        While the member restarts, the mask allows all actions, because the member does not execute them. If
        the request for the mask fails, the next step reports the fault.
        """
        if self._actions is not None and self._found_broken is None:
            try:
                return self.restarter.action_mask()
            except SimulatorFault as fault:
                self._found_broken = fault
        return all_allowed(self.env.action_space)

    def resume(self, state: EpisodeState, *, masked: bool = False) -> Any:
        """Take the actions of `state` again without counting them; return the observation afterwards.

        If the member fails meanwhile, the next episode begins. The next episode also begins if the
        environment is not deterministic: the repeated episode ends earlier, or, if `masked` is set, the mask
        forbids a repeated action.

        Raises:
            FaultBudgetSpent: the member's restart budget is used up.
        """
        self.episode, now = state.episode, self.training_progress
        self.training_progress = now if state.actions is None else state.training_progress
        self.begin()
        self.training_progress = now
        for action in () if state.actions is None or self._actions is None else state.actions:
            self._check()
            try:
                if masked and not allows(self.restarter.action_mask(), self.env.action_space, action):
                    return self.begin()
                _, _, terminated, truncated, _ = self._advance(action)
            except SimulatorFault as fault:
                self._break(fault)
                break
            if terminated or truncated:
                return self.begin()
        return self._observation

    def step(self, action: Any) -> CollectedRow:
        """Return the row of one step.

        A fault ends the episode. The member is then restarted in the background, and its rows are invalid
        until it is up again.

        Raises:
            FaultBudgetSpent: the member's restart budget is used up.
        """
        if self._actions is None:
            return self._recover()
        try:
            observation, reward, terminated, truncated, info = self._advance(action)
        except SimulatorFault as fault:
            self._break(fault)
            return self._invalid(seen=self._observation, done=True)
        info = self._said(info)
        info[TRUNCATED] = truncated and not terminated
        if terminated or truncated:
            info["terminal_observation"] = observation
            info["episode"] = self._summary()
            return CollectedRow(self.begin(), float(reward), True, info)
        return CollectedRow(observation, float(reward), False, info)

    def _reset(self, options: dict[str, Any] | None) -> None:
        seed = self.next_seed()
        position = reset_options(self.training_progress, self.episode)
        self._began_at = self.training_progress
        self.episode += 1
        try:
            self._observation, self.reset_info = self.restarter.reset(
                seed, position | (options or {}), self._check
            )
        except Diverged as error:
            raise Diverged(f"episode {self.episode - 1}, reset: {error}") from error
        self._started = time.monotonic()
        self._actions = ActionLog()

    def _advance(self, action: Any) -> Step:
        if self._found_broken is not None:
            raise self._found_broken
        try:
            step = self.restarter.step(action)
        except Diverged as error:
            raise Diverged(f"episode {self.episode - 1}, step {self._length + 1}: {error}") from error
        self._observation, self._newest = step[0], step[4]
        self._return += float(step[1])
        self._length += 1
        if self._actions is not None:
            self._actions.append(action)
        return step

    def _said(self, info: dict[str, Any]) -> dict[str, Any]:
        said = of_environment(info, valid=True)
        hidden = said[OURS].get(HIDDEN)
        for word in hidden.keys() - self._hidden if hidden else ():
            self._hidden.add(word)
            log.warning(
                "a key of the info of the environment was moved: Stable-Baselines3 or Palaestra uses it",
                word=word,
                now=f'info["{OURS}"]["{HIDDEN}"]["{word}"]',
            )
        return said

    def _break(self, fault: SimulatorFault) -> None:
        self._news = {
            "sim_fault": {
                "kind": fault.kind,
                "simulator": self.restarter.name,
                "fact": str(fault),
                "episode": self.episode - 1,
                "step": self._length,
            }
        }
        self._actions = self._found_broken = None
        self.restarter.begin_restart(fault, self._length)

    def _recover(self) -> CollectedRow:
        """Return the row of a step while no episode runs; begin the next episode if the member is up."""
        seen = self._observation
        self.begin()
        return self._invalid(seen, done=self._actions is not None, recovering=not self.restarter.lost)

    def _invalid(self, seen: Any, *, done: bool, **words: Any) -> CollectedRow:
        """Return an invalid row; the first invalid row after a fault holds its `sim_fault`."""
        words = {"valid": False} | words | self._news
        self._news = {}
        info = {OURS: words, TRUNCATED: done, "terminal_observation": copied(seen)}
        return CollectedRow(self._observation, 0.0, done, info)

    def _summary(self) -> dict[str, float]:
        seconds = time.monotonic() - self._started
        return {"r": round(self._return, 6), "l": self._length, "t": round(seconds, 6)}


def blank(space: spaces.Space[Any]) -> Any:
    """Return an observation of zeros."""
    one: Any = create_empty_array(space, n=1)
    return {name: part[0] for name, part in one.items()} if isinstance(space, spaces.Dict) else one[0]
