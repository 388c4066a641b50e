"""A training program as users of RLlib write it: DQN in one env runner, over a simulator of ours.

`PYTHON -m tests.bench.rllib_program SPEC FOLDER` trains the job whose spec is in the file SPEC. PYTHON is an
interpreter that imports Ray and `palaestra_trainer`. The program saves no checkpoints, because RLlib restarts
a broken environment and the program continues.
"""

import json
import sys
from pathlib import Path

import gymnasium
import ray
from ray.rllib.algorithms.dqn import DQNConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune.registry import register_env

from palaestra_trainer.webots.launching.master import ensure_master
from tests.bench.step_counter import StepCounter

MODULE = "palaestra_trainer.environments"  # each process of Ray imports it to register the environments
CPUS = 4  # the number that Ray may assign: one for the learner, and one for each env runner
CONFIRMATIONS = 2  # evaluations at the end, which together have as many episodes as plain.CONFIRMING
ROLLOUT = 4
PER_ITERATION = 1000


class CountedEnv(gymnasium.Wrapper):
    """Counts the steps of the environment in a file."""

    def __init__(self, env, folder):
        super().__init__(env)
        self._counter = StepCounter(folder)

    def step(self, action):
        """Take one step, and count it."""
        result = self.env.step(action)
        self._counter.value += 1
        return result


def main(spec, folder):
    """Train the job with this spec."""
    ensure_master()
    ray.init(num_cpus=CPUS, include_dashboard=False, log_to_driver=False)
    register_env("job", lambda wanted: environment(spec, wanted))
    algorithm = configured(spec, folder).build_algo()
    steps = 0
    while steps < spec["trainer"]["steps"]:
        algorithm.train()
        steps = StepCounter(folder).value
    if spec["trainer"]["evaluation"]["everySteps"]:
        for _ in range(CONFIRMATIONS):
            algorithm.evaluate()
    algorithm.stop()


def environment(spec, wanted):
    """Return the environment of a job in a new simulator; only the steps of training count."""
    job = spec["trainer"]["environment"]
    env = gymnasium.make(f"{MODULE}:{job['id']}", **job["options"])
    return CountedEnv(env, wanted["folder"]) if wanted.get("folder") else env


def schedule(rate, steps):
    """Return RLlib's form of a job's learning rate; the rate `lin_X` falls from X to 0."""
    falls = isinstance(rate, str)
    return [[0, float(rate.removeprefix("lin_"))], [steps, 0.0]] if falls else rate


def configured(spec, folder):
    """Return the configuration with the job's hyperparameters, and with both restarts of RLlib enabled."""
    trainer = spec["trainer"]
    given, evaluation = trainer["algorithm"]["hyperparameters"], trainer["evaluation"]
    every = evaluation["everySteps"]
    config = (
        DQNConfig()
        .environment("job", env_config={"folder": str(folder)})
        .env_runners(num_env_runners=1, rollout_fragment_length=ROLLOUT)
        .rl_module(model_config=DefaultModelConfig(fcnet_hiddens=given["policy_kwargs"]["net_arch"]))
        .training(
            lr=schedule(given.get("learning_rate", 1e-4), trainer["steps"]),
            epsilon=[
                [0, 1.0],
                [
                    round(given.get("exploration_fraction", 0.1) * trainer["steps"]),
                    given.get("exploration_final_eps", 0.05),
                ],
            ],
            tau=given.get("tau", 1.0),
            target_network_update_freq=max(given.get("target_update_interval", 10_000), ROLLOUT),
            gamma=given.get("gamma", 0.99),
            train_batch_size_per_learner=given["batch_size"],
            num_steps_sampled_before_learning_starts=given["learning_starts"],
            replay_buffer_config={"type": "EpisodeReplayBuffer", "capacity": given["buffer_size"]},
            double_q=False,
            dueling=False,
        )
        .reporting(min_sample_timesteps_per_iteration=every or PER_ITERATION)
        .fault_tolerance(restart_failed_env_runners=True, restart_failed_sub_environments=True)
        .debugging(seed=spec["seed"])
    )
    if every:
        config.evaluation(
            evaluation_interval=1,
            evaluation_duration=evaluation["episodes"],
            evaluation_num_env_runners=1,
            evaluation_config={"env_config": {"folder": ""}},
        )
    return config


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2]))
