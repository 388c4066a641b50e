"""A training loop of your own: `trainer: {command: [python, own_training_script.py]}`.

It runs where the built-in loop would: the simulators of the TrainingJob are there, and every
environment that is made takes one that has its role. A fault is not mended here.
It saves its model as often as the job says, and reports its steps, so that the operator sees it
come forward. SIGTERM ends it after the step that is under way, with the model saved and an exit
code that asks to be started again; started again, it goes on from there.
"""

import os
import signal
import sys
import threading
from pathlib import Path

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from palaestra_trainer import report
from palaestra_trainer.configuration import load
from palaestra_trainer.environments.making import make_environment
from palaestra_trainer.simulators.configured import simulator_for

job = load()  # what PALAESTRA_CONFIG names: the TrainingJob, resolved for this replica
run = Path(os.environ["PALAESTRA_RUN"])  # what is written here outlives the pod
saved = run / "model.zip"
interrupted = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: interrupted.set())


def make(role: str = "Collect") -> gymnasium.Env:
    """Make an environment in a simulator with this role that no other environment has."""
    taken = simulator_for(role)
    return Monitor(make_environment(job.environment, taken.robot, taken.scene))


def save(model: PPO) -> None:
    """Replace the saved model at once: a kill amid a save leaves the one before."""
    model.save(run / "unfinished.zip")
    (run / "unfinished.zip").replace(saved)


class Progress(BaseCallback):
    """Reports before each rollout, when the model is whole, and saves when it is time."""

    def _on_training_start(self) -> None:
        self.next_save = self.num_timesteps + job.checkpoint.every_steps

    def _on_rollout_start(self) -> None:
        report(step=self.num_timesteps)
        if self.num_timesteps >= self.next_save:
            save(self.model)
            self.next_save += job.checkpoint.every_steps

    def _on_step(self) -> bool:
        return not interrupted.is_set()


envs = DummyVecEnv([make] * len(job.with_role("Collect")))
if saved.exists():
    model = PPO.load(saved, envs, device=job.device)
else:
    settings = {"n_steps": 512, "batch_size": 128, "gamma": 0.97, "seed": job.seed, "device": job.device}
    model = PPO("MlpPolicy", envs, tensorboard_log=str(run / "tensorboard"), **settings)
missing = max(0, job.steps - model.num_timesteps)
model.learn(missing, Progress(), reset_num_timesteps=False)
save(model)
report(step=model.num_timesteps)

if interrupted.is_set():
    sys.exit(75)  # interrupted, start me again
if job.with_role("Evaluate"):
    mean_return, _ = evaluate_policy(model, make("Evaluate"), n_eval_episodes=job.evaluation.episodes)
    print(f"mean return {mean_return:.2f} over {job.evaluation.episodes} episodes")
