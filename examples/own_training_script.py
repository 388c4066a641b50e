"""A training loop of your own: `trainer: {command: [python, own_training_script.py]}`.

It runs where the built-in loop would, in the simulators of the TrainingJob. A simulator that breaks is
mended, and its episode counts as truncated.
The script saves its model as often as the job says, and reports its steps, so that the operator sees its
progress.
SIGTERM ends it after the current step, with the model saved and an exit code that asks to be started again;
started again, it resumes from that model.
"""

import os
import signal
import sys
import threading
from pathlib import Path

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

from palaestra_trainer import make_env, make_sb3_vec_env, report
from palaestra_trainer.configuration import load

job = load()  # what PALAESTRA_CONFIG names: the TrainingJob, resolved for this replica
run = Path(os.environ["PALAESTRA_RUN"])  # what is written here outlives the pod
saved = run / "model.zip"
interrupted = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: interrupted.set())


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


envs = make_sb3_vec_env()  # in all simulators that collect
if saved.exists():
    model = PPO.load(saved, envs, device=job.device)
else:
    settings = {"n_steps": 512, "batch_size": 128, "gamma": 0.97, "seed": job.seed, "device": job.device}
    model = PPO("MlpPolicy", envs, tensorboard_log=str(run / "tensorboard"), **settings)
missing = max(0, job.steps - model.num_timesteps)
model.learn(missing, Progress(), reset_num_timesteps=False)
save(model)
report(step=model.num_timesteps)
envs.close()

if interrupted.is_set():
    sys.exit(75)  # interrupted, start me again
if job.with_role("Evaluate"):
    env = Monitor(make_env(role="Evaluate"))
    mean_return, _ = evaluate_policy(model, env, n_eval_episodes=job.evaluation.episodes)
    env.close()
    print(f"mean return {mean_return:.2f} over {job.evaluation.episodes} episodes")
