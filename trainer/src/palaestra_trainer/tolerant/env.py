"""One member as a gymnasium.Env that tolerates faults."""

from __future__ import annotations

from typing import Any

import gymnasium

from palaestra_trainer.simulators.member import Step
from palaestra_trainer.tolerant.players import Players


class TolerantEnv(gymnasium.Env[Any, Any]):
    """The environment of one simulator; a fault truncates an episode, and the next reset waits for it.

    Args:
        players: a single one.
    """

    def __init__(self, players: Players) -> None:
        self._players = players
        [self._player] = players.all
        inner = self._player.env
        self.observation_space, self.action_space = inner.observation_space, inner.action_space
        self.metadata, self.render_mode = inner.metadata, inner.render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; return its first observation and info. Waits until the simulator is mended.

        Raises:
            As `Players.begin`.
        """
        super().reset(seed=seed)
        self._players.begin([seed], [options])
        return self._player.observation, self._player.reset_info

    def step(self, action: Any) -> Step:
        """Return what the environment's step returns; or, after a fault, the last observation as truncated.

        Raises:
            As `Players.step`.
        """
        return self._players.step(action).step

    def render(self) -> Any:
        """Return what the environment's `render` returns."""
        return self._player.env.render()

    def close(self) -> None:
        """Stop the simulator and release it; safe to repeat."""
        self._players.close()
