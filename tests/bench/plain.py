"""The cost of simulators, ROS and restarts: `make run` compared with plain Stable-Baselines3.

Plain training runs the same task in one process without a simulator: `fake_arena` simulates the task, and SB3
evaluates the policy. `subproc` is a program with Stable-Baselines3's `SubprocVecEnv`, which steps the same
simulators as the example. All three trainings have the same steps, hyperparameters and evaluations.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import torch
from stable_baselines3 import DQN
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.monitor import Monitor

from palaestra_trainer.algorithms.hyperparameters import arguments
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import fake_arena
from tests.bench.sizes import scaled
from tests.jobs import example
from tests.local_run import PALAESTRA

NEW, OLD = "move-to-target", "paper-dqn"
CONFIRMING = 100  # the default of evaluation.confirmEpisodes, because the example does not set this field
LEAST_STEPS = 300


def measure(scale=1.0):
    """Return the seconds of the trainings, which run one after the other, and their ratios."""
    run_s, plain_s = _seconds_of_both(NEW, scale)
    with tempfile.TemporaryDirectory() as folder:
        spec = Path(folder) / "spec.json"
        spec.write_text(json.dumps(job(NEW, scale)["spec"]))
        subproc_s = seconds_of([sys.executable, "-m", "tests.bench.sb3_program", spec, folder])
    return _figures(run_s, plain_s) | {
        "subproc_seconds": round(subproc_s),
        "times_subproc": round(run_s / subproc_s, 2),
    }


def measure_old(scale=1.0):
    """Return the seconds of `make run` and of plain training with the settings of paper-dqn."""
    return _figures(*_seconds_of_both(OLD, scale))


def _seconds_of_both(name, scale):
    """Return the seconds of `make run` with an example, and of plain training with its settings."""
    plain_s = seconds_of([sys.executable, "-m", "tests.bench.plain", name, str(scale)])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "job.yaml"
        file.write_text(json.dumps(job(name, scale)))
        return seconds_of([PALAESTRA, "run", file, "--dir", folder]), plain_s


def _figures(run_s, plain_s):
    return {
        "seconds": round(run_s),
        "plain_seconds": round(plain_s),
        "times_plain": round(run_s / plain_s, 2),
    }


def job(name, scale):
    """Return an example, with a share of its steps and episodes."""
    made = example(name)
    trainer = made["spec"]["trainer"]
    evaluation = trainer["evaluation"]
    evaluation.pop("stopAtSuccessRate", None)  # both programs train all steps
    trainer["steps"] = scaled(trainer["steps"], scale, LEAST_STEPS)
    evaluation["episodes"] = scaled(evaluation["episodes"], scale)
    evaluation["confirmEpisodes"] = scaled(CONFIRMING, scale)
    return made


def seconds_of(command):
    """Return the duration of a command in seconds."""
    began = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.monotonic() - began


def train(spec):
    """Train and evaluate the job with this `spec` in this process."""
    torch.set_num_threads(1)  # the trainer does this too
    trainer = spec["trainer"]
    evaluation, hyperparameters = trainer["evaluation"], trainer["algorithm"]["hyperparameters"]
    one, other = (Monitor(make(*fake_arena(), **trainer["environment"]["options"])) for _ in range(2))
    model = DQN("MlpPolicy", one, seed=spec["seed"], device="cpu", **arguments(DQN, hyperparameters))
    evaluating = EvalCallback(
        other, eval_freq=evaluation["everySteps"], n_eval_episodes=evaluation["episodes"], verbose=0
    )
    model.set_logger(Logger(None, []))  # otherwise Stable-Baselines3 leaves a folder behind for each run
    model.learn(trainer["steps"], callback=evaluating)
    evaluate_policy(model, other, n_eval_episodes=evaluation["confirmEpisodes"])


if __name__ == "__main__":
    train(job(sys.argv[1], float(sys.argv[2]))["spec"])
