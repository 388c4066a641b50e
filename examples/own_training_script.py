"""A training loop of your own: `trainer: {command: [python, own_training_script.py]}`.

It runs where the built-in loop would: the simulators of the TrainingJob are there, and every
environment that is made takes the next one, collecting ones first. A fault is not mended here.
"""

import os
import signal
import sys
from pathlib import Path

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from palaestra_trainer import environments
from palaestra_trainer.configuration import load

gymnasium.register_envs(environments)  # MoveToTargetEnv-v0

job = load()  # what PALAESTRA_CONFIG names: the TrainingJob, resolved for this replica
run = Path(os.environ["PALAESTRA_RUN"])  # what is written here outlives the pod
signal.signal(signal.SIGTERM, lambda *_: sys.exit(75))  # 75: interrupted, start me again


def make() -> gymnasium.Env:
    """Make an environment in the next simulator."""
    task = job.environment
    return Monitor(gymnasium.make(task.id, reward=task.reward, **task.options))


envs = DummyVecEnv([make] * len(job.with_role("Collect")))
model = PPO(
    "MlpPolicy",
    envs,
    n_steps=512,
    batch_size=128,
    gamma=0.97,
    seed=job.seed,
    tensorboard_log=str(run / "tensorboard"),
    device="cpu",
)
model.learn(job.steps)
model.save(run / "model.zip")

if job.with_role("Evaluate"):
    mean_return, _ = evaluate_policy(model, make(), n_eval_episodes=job.evaluation.episodes)
    print(f"mean return {mean_return:.2f} over {job.evaluation.episodes} episodes")
