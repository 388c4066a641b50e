"""REINFORCE (Williams, 1992), as a Stable-Baselines3 algorithm.

It learns from whole episodes, by the gradient of log pi(a|s) * (G - b). G is the discounted return from the
step on, and b is an optional baseline. The class inherits save, load, predict, callbacks and logger from
`BaseAlgorithm`, and uses the policies of Stable-Baselines3.
"""

from __future__ import annotations

import sys
import time
from typing import Any, ClassVar, Self

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.policies import (
    ActorCriticCnnPolicy,
    ActorCriticPolicy,
    BasePolicy,
    MultiInputActorCriticPolicy,
)
from stable_baselines3.common.type_aliases import GymEnv, MaybeCallback, Schedule
from stable_baselines3.common.utils import obs_as_tensor, safe_mean

from palaestra_trainer.algorithms.buffers import valid_rows
from palaestra_trainer.algorithms.episodes import Batch, EpisodeRecorder
from palaestra_trainer.environments.episode_end import EpisodeEnd


class REINFORCE(BaseAlgorithm):
    """The Monte-Carlo policy gradient algorithm REINFORCE.

    One update learns from `episodes_per_update` whole episodes of each environment. The number is the same
    for each environment, because an update from the episodes that end first would prefer short episodes. If
    an environment finishes further episodes before the others are ready, the further episodes are dropped.
    Episodes that a fault truncated are dropped too. The update does not wait for an environment that
    restarts. Training ends with the first episode that ends at or after `total_timesteps`. The return of a
    truncated episode is the sum of its rewards until its last step.

    Args:
        policy: "MlpPolicy", "CnnPolicy", "MultiInputPolicy" or an actor-critic class; its value network is
            trained only for the baseline "value".
        env: environment or VecEnv in which the policy learns.
        learning_rate: learning rate of Adam, or a function of the remaining progress (1 to 0).
        episodes_per_update: number of whole episodes of each environment in one update.
        gamma: discount factor per step, 0 to 1.
        baseline: "value" subtracts a learned V(s) from the return; "none" does not subtract a baseline.
        normalize_advantage: scale G - b to mean 0 and deviation 1 within an update; without a baseline, G is
            only divided by its root mean square.
        ent_coef: weight of the policy's entropy in the loss; more entropy keeps the policy exploring.
        vf_coef: weight of the baseline's squared error.
        max_grad_norm: largest norm of the gradient; a longer gradient is scaled down to this norm.
        stats_window_size: number of the newest episodes in the logged means.
        tensorboard_log: folder of event files, if no logger is set.
        policy_kwargs: keyword arguments of the policy, e.g. `net_arch`.
        verbose: 0 quiet, 1 info.
        seed: seed of networks and action sampling.
        device: device of the networks.
    """

    policy: ActorCriticPolicy
    policy_aliases: ClassVar[dict[str, type[BasePolicy]]] = {
        "MlpPolicy": ActorCriticPolicy,
        "CnnPolicy": ActorCriticCnnPolicy,
        "MultiInputPolicy": MultiInputActorCriticPolicy,
    }

    def __init__(  # noqa: PLR0913, PLR0917 - one argument per hyperparameter, as in Stable-Baselines3
        self,
        policy: str | type[ActorCriticPolicy],
        env: GymEnv | str | None,
        learning_rate: float | Schedule = 1e-3,
        episodes_per_update: int = 5,
        gamma: float = 0.99,
        baseline: str = "value",
        normalize_advantage: bool = True,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
        ent_coef: float = 0.0,
        vf_coef: float = 0.5,
        max_grad_norm: float = 0.5,
        stats_window_size: int = 100,
        tensorboard_log: str | None = None,
        policy_kwargs: dict[str, Any] | None = None,
        verbose: int = 0,
        seed: int | None = None,
        device: torch.device | str = "auto",
        _init_setup_model: bool = True,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
    ) -> None:
        super().__init__(
            policy,
            env,
            learning_rate,
            policy_kwargs=policy_kwargs,
            stats_window_size=stats_window_size,
            tensorboard_log=tensorboard_log,
            verbose=verbose,
            device=device,
            support_multi_env=True,
            seed=seed,
            supported_action_spaces=(
                spaces.Box,
                spaces.Discrete,
                spaces.MultiDiscrete,
                spaces.MultiBinary,
            ),
        )
        if baseline not in ("value", "none"):
            raise ValueError(f'baseline: {baseline!r} is unknown; use "value" or "none"')
        if episodes_per_update < 1:
            raise ValueError(f"episodes_per_update: {episodes_per_update} is less than 1; use 1 or more")
        self.episodes_per_update = episodes_per_update
        self.gamma = gamma
        self.baseline = baseline
        self.normalize_advantage = normalize_advantage
        self.ent_coef = ent_coef
        self.vf_coef = vf_coef
        self.max_grad_norm = max_grad_norm
        if _init_setup_model:
            self._setup_model()

    def _setup_model(self) -> None:
        self._setup_lr_schedule()
        self.set_random_seed(self.seed)
        policy = self.policy_class(
            self.observation_space, self.action_space, self.lr_schedule, **self.policy_kwargs
        )
        self.policy = policy.to(self.device)  # type: ignore[assignment]  # actor-critic policy: see __init__

    def learn(
        self,
        total_timesteps: int,
        callback: MaybeCallback = None,
        log_interval: int = 1,
        tb_log_name: str = "REINFORCE",
        reset_num_timesteps: bool = True,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
        progress_bar: bool = False,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
    ) -> Self:
        """Train until the first episode that ends at or after `total_timesteps`; return this model.

        `log_interval` counts updates; the other arguments are Stable-Baselines3's.
        """
        total_timesteps, callbacks = self._setup_learn(
            total_timesteps, callback, reset_num_timesteps, tb_log_name, progress_bar
        )
        callbacks.on_training_start(locals(), globals())
        while self.num_timesteps < total_timesteps:
            batch = self.collect_episodes(callbacks)
            if batch is None:
                break
            self._update_current_progress_remaining(self.num_timesteps, total_timesteps)
            self.train(batch)
            if log_interval and self._n_updates % log_interval == 0:
                self.dump_logs()
        callbacks.on_training_end()
        return self

    def collect_episodes(self, callback: BaseCallback) -> Batch | None:
        """Return the whole valid episodes of one update; None if the callback ended training.

        At the end of training, an environment may have fewer than `episodes_per_update` episodes.

        Raises:
            ConfigurationError: an episode does not end.
        """
        assert self.env is not None  # set in __init__ or by set_env()
        self.policy.set_training_mode(False)
        recorder = EpisodeRecorder(self.env.num_envs, self.episodes_per_update)
        dones, end = np.zeros(self.env.num_envs, dtype=bool), EpisodeEnd("REINFORCE")
        callback.on_rollout_start()
        while not recorder.complete:
            observations, actions = self._last_obs, self._act()
            new_obs, rewards, dones, infos = self.env.step(self._within_bounds(actions))
            valid = valid_rows(infos)
            self.num_timesteps += int(valid.sum())
            callback.update_locals(locals())
            if not callback.on_step():
                return None
            self._update_info_buffer(infos, dones)
            self._last_obs = new_obs  # type: ignore[assignment]  # as in Stable-Baselines3
            recorder.add(observations, actions, rewards, dones, valid)
            end.not_after(recorder.longest)
            self._episode_num += int(dones.sum())
            if dones.any() and self.num_timesteps >= self._total_timesteps:
                break
        if not dones.all():
            # An environment may be in an episode that began with the policy of the previous update.
            self._last_obs = self.env.reset()  # type: ignore[assignment]  # as in Stable-Baselines3
        callback.on_rollout_end()
        return recorder.batch(self.gamma)

    def train(self, batch: Batch) -> None:
        """Take one gradient step on the episodes in `batch`; do nothing for an empty batch."""
        if not len(batch.returns):
            return
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        loss = self._loss(batch)
        self.policy.optimizer.zero_grad()
        torch.autograd.backward(loss)
        torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
        self.policy.optimizer.step()
        self._n_updates += 1
        self.logger.record("train/loss", loss.item())

    def dump_logs(self) -> None:
        """Write means over the last episodes, the speed, and the values that `train` recorded."""
        seconds = max((time.time_ns() - self.start_time) / 1e9, sys.float_info.epsilon)
        fps = int((self.num_timesteps - self._num_timesteps_at_start) / seconds)
        self.logger.record("time/episodes", self._episode_num, exclude="tensorboard")
        self.logger.record("time/fps", fps)
        self.logger.record("time/total_timesteps", self.num_timesteps, exclude="tensorboard")
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        if self.ep_info_buffer:
            for tag, key in (("rollout/ep_rew_mean", "r"), ("rollout/ep_len_mean", "l")):
                self.logger.record(tag, safe_mean([info[key] for info in self.ep_info_buffer]))
        if self.ep_success_buffer:
            self.logger.record("rollout/success_rate", safe_mean(self.ep_success_buffer))
        self.logger.dump(step=self.num_timesteps)

    def _loss(self, batch: Batch) -> torch.Tensor:
        observations = obs_as_tensor(batch.observations, self.device)
        actions = torch.as_tensor(batch.actions, device=self.device)
        returns = torch.as_tensor(batch.returns, device=self.device)
        values, log_prob, entropy = self.policy.evaluate_actions(observations, actions)
        values = values.flatten()
        policy_loss = -(self._advantages(returns, values.detach()) * log_prob).mean()
        entropy_loss = log_prob.mean() if entropy is None else -entropy.mean()
        self.logger.record("train/policy_gradient_loss", policy_loss.item())
        self.logger.record("train/entropy_loss", entropy_loss.item())
        loss = policy_loss + self.ent_coef * entropy_loss
        if self.baseline == "value":
            value_loss = torch.nn.functional.mse_loss(values, returns)
            self.logger.record("train/value_loss", value_loss.item())
            loss = loss + self.vf_coef * value_loss
        return loss

    def _advantages(self, returns: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        """Return G - b of each step, normalized if `normalize_advantage` is set."""
        if self.baseline == "none":
            return returns / (returns.square().mean().sqrt() + 1e-8) if self.normalize_advantage else returns
        advantages = returns - values
        if self.normalize_advantage and len(advantages) > 1:
            advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        return advantages

    def _act(self) -> np.ndarray:
        with torch.no_grad():
            actions, _, _ = self.policy(obs_as_tensor(self._last_obs, self.device))  # type: ignore[arg-type]  # learn() has reset the environment
        chosen: np.ndarray = actions.cpu().numpy()
        return chosen

    def _within_bounds(self, actions: np.ndarray) -> np.ndarray:
        if isinstance(self.action_space, spaces.Box):
            actions = np.clip(actions, self.action_space.low, self.action_space.high)
        return actions

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        return ["policy", "policy.optimizer"], []
