"""A model that is trained in the corridor, its checkpoints, and its rows of experience."""

from __future__ import annotations

import numpy as np

from palaestra_trainer.run import checkpoint

HYPERPARAMETERS = {
    "DQN": {
        "learning_starts": 10,
        "batch_size": 8,
        "gradient_steps": 1,
        "buffer_size": 200,
        "policy_kwargs": {"net_arch": [8]},
    },
    "PPO": {"n_steps": 16, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}},
}
CHUNK_ROWS = 16


class Trained:
    """A model that was trained for some steps, with its checkpoints."""

    def __init__(self, model, env, configuration, folder):
        self.model = model
        self.configuration = configuration
        self.folder = folder
        self._env = env
        self.saver = checkpoint.Saver(folder, keep=3)

    def learn(self, steps):
        """Continue the training for some steps."""
        self.model.learn(steps, reset_num_timesteps=False)
        return self

    def save(self, step=None):
        """Save a checkpoint, and return whether it was written."""
        state = checkpoint.TrainingState.of(self.model, self._env.snapshot(), {"returns": [1.5]})
        step = self.model.num_timesteps if step is None else step
        return self.saver.save(
            self.model, state, checkpoint.describe(self.configuration, step, {"episodes": 4})
        )

    def resume(self):
        """Restore the model from the newest checkpoint, and return the restored state."""
        found = checkpoint.newest(self.folder)
        state = checkpoint.restore(found, self.model)
        self._env.resume(state.members)
        state.put_back(self.model)
        self.saver = checkpoint.Saver(self.folder, keep=3, resumed=found)
        return state

    def path(self, step):
        """Return the folder of a checkpoint."""
        return self.folder / str(step)

    def experience(self, step):
        """Return the experience files of a checkpoint, by name."""
        return {file.name: file for file in sorted((self.path(step) / "experience").iterdir())}


def rows(model):
    """Return the experience of a model by column."""
    return {name: column[: model.replay_buffer.size()] for name, column in model.replay_buffer.rows().items()}


def equal(one, other):
    """Return whether two buffers hold the same rows at the same positions."""
    return all(np.array_equal(column, rows(other)[name]) for name, column in rows(one).items())
