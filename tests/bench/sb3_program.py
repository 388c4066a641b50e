"""A training program as users of Stable-Baselines3 write it: `SubprocVecEnv` over simulators of ours.

`python -m tests.bench.sb3_program SPEC FOLDER` trains the job whose spec is in the file SPEC. Each
environment is `gymnasium.make` of the job's id in a process of `SubprocVecEnv`, where it starts its own stub.
The program saves model and replay buffer in FOLDER at the job's interval, and resumes from the newest files.
"""

import json
import re
import sys
from functools import partial
from pathlib import Path

import gymnasium
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.callbacks import BaseCallback, CheckpointCallback, EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import SubprocVecEnv

import palaestra_trainer.environments  # noqa: F401 - the import registers the environments
from palaestra_trainer.algorithms.hyperparameters import arguments
from palaestra_trainer.webots.launching.master import ensure_master
from tests.bench.step_counter import StepCounter

SAVED = re.compile(r"model_(\d+)_steps\.zip")


class Counting(BaseCallback):
    """Writes the number of steps after each step."""

    def __init__(self, counter):
        super().__init__()
        self._counter = counter

    def _on_step(self):
        self._counter.value = self.num_timesteps
        return True


def main(spec, folder):
    """Train the job with this spec, or resume it."""
    torch.set_num_threads(1)  # the trainer of a job does this too
    ensure_master()
    trainer = spec["trainer"]
    evaluation, every = trainer["evaluation"], trainer["checkpoint"]["everySteps"]
    env = SubprocVecEnv([partial(environment, trainer["environment"])])
    model = made_or_loaded(spec, env, folder)
    callbacks = [
        Counting(StepCounter(folder)),
        CheckpointCallback(every, folder, "model", save_replay_buffer=True),
    ]
    if evaluation["everySteps"]:
        other = SubprocVecEnv([partial(environment, trainer["environment"])])
        callbacks.append(
            EvalCallback(other, None, None, evaluation["episodes"], evaluation["everySteps"], verbose=0)
        )
    model.learn(trainer["steps"] - model.num_timesteps, callbacks, reset_num_timesteps=False)
    if evaluation["everySteps"]:
        evaluate_policy(model, other, n_eval_episodes=evaluation["confirmEpisodes"])
        other.close()
    env.close()


def environment(wanted):
    """Return the environment of a job in a new simulator of this process."""
    return Monitor(gymnasium.make(wanted["id"], **wanted["options"]))


def made_or_loaded(spec, env, folder):
    """Return the model of the newest checkpoint, or a new one."""
    algorithm = spec["trainer"]["algorithm"]["hyperparameters"]
    steps = newest(folder)
    if steps is None:
        model = DQN("MlpPolicy", env, seed=spec["seed"], device="cpu", **arguments(DQN, algorithm))
    else:
        model = DQN.load(folder / f"model_{steps}_steps.zip", env, device="cpu")
        model.load_replay_buffer(folder / f"model_replay_buffer_{steps}_steps.pkl")
    model.set_logger(Logger(None, []))  # otherwise Stable-Baselines3 leaves a folder behind for each run
    return model


def newest(folder):
    """Return the number of steps of the newest checkpoint, or None."""
    found = (SAVED.fullmatch(path.name) for path in folder.iterdir())
    return max((int(match[1]) for match in found if match), default=None)


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2]))
