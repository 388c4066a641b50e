"""An example of your own training loop: `trainer: {command: [python, own_training_script.py]}`.

The script replaces the built-in loop and uses the simulators of the TrainingJob. A simulator that breaks is
restarted, and its episode counts as truncated. The script saves its model at the interval in the job, and
reports its steps, so that the operator sees its progress. After a SIGTERM it ends the current step, saves the
model, and exits with a code that requests a restart. After the restart it resumes from the saved model.
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
from palaestra_trainer.job.configuration import load

job = load()  # the file in PALAESTRA_CONFIG: the TrainingJob, resolved for this replica
run = Path(os.environ["PALAESTRA_RUN"])  # files in this folder outlive the pod
saved = run / "model.zip"
interrupted = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: interrupted.set())


def save(model: PPO) -> None:
    """Replace the saved model atomically, so that a kill during the save leaves the previous model."""
    model.save(run / "unfinished.zip")
    (run / "unfinished.zip").replace(saved)


class Progress(BaseCallback):
    """Reports the steps and saves the model before a rollout, when no update is running."""

    def _on_training_start(self) -> None:
        self.next_save = self.num_timesteps + job.checkpoint.every_steps

    def _on_rollout_start(self) -> None:
        report(step=self.num_timesteps)
        if self.num_timesteps >= self.next_save:
            save(self.model)
            self.next_save += job.checkpoint.every_steps

    def _on_step(self) -> bool:
        return not interrupted.is_set()


envs = make_sb3_vec_env()  # in all simulators with role Collect
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
    sys.exit(75)  # interrupted: a restart resumes the run
if job.with_role("Evaluate"):
    env = Monitor(make_env(role="Evaluate"))
    mean_return, _ = evaluate_policy(model, env, n_eval_episodes=job.evaluation.episodes)
    env.close()
    print(f"mean return {mean_return:.2f} over {job.evaluation.episodes} episodes")
