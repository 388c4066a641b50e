"""The interface of the VecEnv in which a run collects rows: pauses, positions in episodes, and a resume."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence

from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs

from palaestra_protocol.scene import SceneState
from palaestra_trainer.episodes.episode_state import EpisodeState


class CollectingVecEnv(VecEnv):
    """A VecEnv whose rows a run can bring back to a position; its rows may be invalid, see `infos`."""

    @abstractmethod
    def pause(self) -> None:
        """Pause all simulators until `unpause`."""

    @abstractmethod
    def unpause(self) -> None:
        """End the pause of all simulators."""

    @abstractmethod
    def set_training_progress(self, training_progress: float) -> None:
        """Set the share of the training that is complete when the next episodes begin, 0 to 1."""

    @abstractmethod
    def snapshot(self) -> list[EpisodeState]:
        """Return the position of each row in its episodes; later steps do not change the result."""

    @abstractmethod
    def moments(self) -> Mapping[str, SceneState]:
        """Return the episode and step of each simulator by name; any thread may call this method."""

    @abstractmethod
    def resume(self, states: Sequence[EpisodeState], *, masked: bool = False) -> VecEnvObs:
        """Bring all rows back to their states; return their observations.

        The repeated steps are not counted. If `masked` is set, a row does not take an action that its mask
        forbids now.
        """
