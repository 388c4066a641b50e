"""The state on which the next step of a run depends, except for saved tensors and experience.

The training callback records this state at each boundary between rollouts, for off-policy algorithms every
few steps. So the recording must be fast; it takes some ten microseconds. The state holds references to
objects that later steps do not change, and copies of small objects.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms import noise as action_noise
from palaestra_trainer.algorithms.buffers import Positions, ValidReplayBuffer
from palaestra_trainer.algorithms.images import as_returned, as_seen
from palaestra_trainer.algorithms.normalization import Moments, normalizer_of
from palaestra_trainer.algorithms.observations import Observations, by_name, from_names
from palaestra_trainer.algorithms.rollout_state import rollout_state_of
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.run.checkpoint import recurrent_state
from palaestra_trainer.run.checkpoint.rng import Generators

STATE = "state.json"
ARRAYS = "state.npz"
# Every algorithm has these counts; `algorithms.rollout_state` lists further counts of each algorithm.
_NUMBERS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")
_NOISE = ("exploration_mat", "exploration_matrices")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingState:
    """The state of a run at a boundary between two rollouts.

    Attributes:
        numbers: the counts of the algorithm, by attribute.
        generators: states of the random generators.
        observation: the last observation of each member, one per row, as the environments returned it.
        episode_starts: whether each row of `observation` is the first observation of an episode.
        episodes: statistics of the last episodes, as Stable-Baselines3 keeps them.
        successes: for each of the last episodes, whether it succeeded.
        positions: write positions of the replay buffer; None without a replay buffer.
        members: state of each collecting simulator's episode.
        rollout: other counts of running episodes, as JSON data; the training callback defines them.
        noise: matrices of state-dependent exploration, drawn before the boundary; empty without such
            exploration.
        networks: copies of the networks' tensors that a rollout changes; `write` omits them, because
            model.zip has them.
        memories: states of recurrent networks, each of shape (layers, members, units).
        action_noise: state of the noise on each member's actions; None if the noise has no state.
        scales: statistics of observations and rewards, if these are normalized; `write` omits the statistics
            too.
        running_returns: for each member, the discounted sum of the rewards in its open episode so far; None
            without normalization.
    """

    numbers: dict[str, float]
    generators: Generators
    observation: Observations
    episode_starts: np.ndarray
    episodes: Sequence[dict[str, Any]]
    successes: Sequence[Any]
    positions: Positions | None
    members: Sequence[EpisodeState]
    rollout: Mapping[str, Any]
    noise: Mapping[str, torch.Tensor]
    networks: Sequence[torch.Tensor] = ()
    memories: Sequence[torch.Tensor] = ()
    action_noise: np.ndarray | None = None
    scales: Mapping[str, Moments] | None = None
    running_returns: np.ndarray | None = None

    @classmethod
    def of(
        cls, model: BaseAlgorithm, members: Sequence[EpisodeState], rollout: Mapping[str, Any]
    ) -> TrainingState:
        """Return the state of a model that has begun to learn and is between two rollouts."""
        buffer, normalizer = replay_buffer(model), normalizer_of(model)
        seen = normalizer.old_obs if normalizer else model._last_obs
        return cls(
            numbers={name: getattr(model, name) for name in (*_NUMBERS, *rollout_state_of(model).numbers)},
            generators=Generators.now(model.action_space, model.device),
            observation=as_returned(model, cast("Observations", seen)),
            episode_starts=np.asarray(model._last_episode_starts),
            episodes=tuple(model.ep_info_buffer or ()),
            successes=tuple(model.ep_success_buffer or ()),
            positions=buffer.positions if buffer else None,
            members=members,
            rollout=rollout,
            noise={name: getattr(_noise_of(model), name) for name in _NOISE if model.use_sde},
            networks=[parameter.detach().clone() for parameter in recurrent_state.networks(model)],
            memories=recurrent_state.memories(model),
            action_noise=action_noise.positions(getattr(model, "action_noise", None)),
            scales=normalizer.scales if normalizer else None,
            running_returns=normalizer.returns if normalizer else None,
        )

    def put_back(self, model: BaseAlgorithm) -> None:
        """Set the state of the model; its tensors and experience must be those of the same boundary."""
        for name, value in self.numbers.items():
            setattr(model, name, value)
        self.generators.put_back(model.action_space, model.device)
        self._show_observation(model)
        model._last_episode_starts = self.episode_starts
        model.ep_info_buffer = deque(self.episodes, maxlen=model._stats_window_size)
        model.ep_success_buffer = deque(self.successes, maxlen=model._stats_window_size)
        buffer = replay_buffer(model)
        if buffer and self.positions:
            buffer.positions = self.positions
        for name, matrix in self.noise.items():
            setattr(_noise_of(model), name, matrix.to(model.device))
        with torch.no_grad():
            for parameter, copy in zip(recurrent_state.networks(model), self.networks, strict=False):
                parameter.copy_(copy)
        if self.memories:
            recurrent_state.remember(model, self.memories)
        if self.action_noise is not None:
            action_noise.put_back(model.action_noise, self.action_noise)

    def _show_observation(self, model: BaseAlgorithm) -> None:
        """Set the model's last observation, both normalized and original."""
        original = seen = as_seen(model, self.observation)
        if (normalizer := normalizer_of(model)) and self.running_returns is not None:
            if self.scales is not None:
                normalizer.scales = self.scales
            seen = normalizer.go_on(original, self.running_returns)
        model._last_obs = seen
        model._last_original_obs = original

    def write(self, folder: Path) -> None:
        """Write the state into a folder, without the tensors and statistics that model.zip has."""
        arrays = by_name(self.observation, "observation") | {"episode_starts": self.episode_starts}
        if self.action_noise is not None:
            arrays["action_noise"] = self.action_noise
        arrays |= {f"memory-{index}": state.cpu().numpy() for index, state in enumerate(self.memories)}
        if self.running_returns is not None:
            arrays["running_returns"] = self.running_returns
        for index, member in enumerate(self.members):
            if member.actions is not None:
                arrays[f"actions-{index}"] = member.actions
        arrays |= {name: matrix.detach().cpu().numpy() for name, matrix in self.noise.items()}
        np.savez(folder / ARRAYS, allow_pickle=False, **arrays)
        content = {
            "numbers": self.numbers,
            "generators": self.generators.to_json(),
            "episodes": self.episodes,
            "successes": self.successes,
            "positions": self.positions,
            "members": [member.episode for member in self.members],
            "training_progress": [member.training_progress for member in self.members],
            "rollout": self.rollout,
        }
        text = json.dumps(content, default=_plain)
        (folder / STATE).write_text(text + "\n", encoding="utf-8")

    @classmethod
    def read(cls, folder: Path) -> TrainingState:
        """Return the state that `write` wrote into a folder.

        Raises:
            OSError, ValueError, TypeError, KeyError: a file is damaged.
        """
        content = json.loads((folder / STATE).read_text(encoding="utf-8"))
        with np.load(folder / ARRAYS, allow_pickle=False) as file:
            arrays = dict(file)
        positions = content["positions"]
        return cls(
            numbers=content["numbers"],
            generators=Generators.from_json(content["generators"]),
            observation=from_names(arrays, "observation"),
            episode_starts=arrays["episode_starts"],
            episodes=content["episodes"],
            successes=content["successes"],
            positions=positions and Positions.from_json(positions),
            members=[
                EpisodeState(episode, arrays.get(f"actions-{index}"), progress)
                for index, (episode, progress) in enumerate(
                    zip(content["members"], content["training_progress"], strict=True)
                )
            ],
            rollout=content["rollout"],
            noise={name: torch.from_numpy(arrays[name]) for name in _NOISE if name in arrays},
            running_returns=arrays.get("running_returns"),
            memories=[
                torch.from_numpy(arrays[name]) for name in sorted(arrays) if name.startswith("memory-")
            ],
            action_noise=arrays.get("action_noise"),
        )


def replay_buffer(model: BaseAlgorithm) -> ValidReplayBuffer | None:
    """Return the model's replay buffer; None for an on-policy model."""
    buffer = getattr(model, "replay_buffer", None)
    return buffer if isinstance(buffer, ValidReplayBuffer) else None


def _noise_of(model: BaseAlgorithm) -> Any:
    """Return the distribution that holds the noise of state-dependent exploration."""
    return getattr(model, "actor", model.policy).action_dist


def _plain(value: Any) -> Any:
    """Return a NumPy number as a Python number."""
    return value.item()
