"""PPO of skrl in the simulators of a job, or in stubs: `trainer: {command: [python, skrl_ppo.py]}`.

skrl is not in the trainer's image; add it with `FROM palaestra-trainer` and `pip install skrl`. To run this
program by hand: `python examples/skrl_ppo.py --environment MoveToTargetEnv-v0 --simulators 2 --steps 4096`.
"""

import argparse
import os
from pathlib import Path
from typing import Any

import torch
from skrl.agents.torch.ppo import PPO
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import CategoricalMixin, DeterministicMixin, Model
from skrl.trainers.torch import SequentialTrainer
from torch import nn

from palaestra_trainer import make_vec_env, report
from palaestra_trainer.job.configuration import load

parser = argparse.ArgumentParser()
parser.add_argument("--environment", help="id of the environment; by default that of the job")
parser.add_argument("--simulators", type=int, help="number of simulators; by default all with role Collect")
parser.add_argument("--steps", type=int, help="steps of all simulators together; by default those of the job")
parser.add_argument("--rollout", type=int, default=128, help="steps of each simulator between two updates")
settings = parser.parse_args()


def network(inputs: int, outputs: int) -> nn.Sequential:
    """Return a network with one hidden layer."""
    return nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, outputs))


class Policy(CategoricalMixin, Model):
    """Logits of the actions."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        CategoricalMixin.__init__(self)
        self.net = network(self.num_observations, self.num_actions)

    def compute(self, inputs: dict[str, torch.Tensor], role: str) -> tuple[torch.Tensor, dict[str, Any]]:
        """Return logits for observations."""
        del role
        return self.net(inputs["observations"]), {}


class Value(DeterministicMixin, Model):
    """The expected discounted return."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = network(self.num_observations, 1)

    def compute(self, inputs: dict[str, torch.Tensor], role: str) -> tuple[torch.Tensor, dict[str, Any]]:
        """Return values for observations."""
        del role
        return self.net(inputs["observations"]), {}


class Reporting(PPO):
    """PPO that reports its steps to the operator."""

    def post_interaction(self, *, timestep: int, timesteps: int) -> None:
        """Report after each update."""
        super().post_interaction(timestep=timestep, timesteps=timesteps)
        if (timestep + 1) % settings.rollout == 0:
            report(step=(timestep + 1) * envs.num_envs)


envs = wrap_env(make_vec_env(settings.environment, settings.simulators), verbose=False)
spaces = {
    "observation_space": envs.observation_space,
    "action_space": envs.action_space,
    "device": envs.device,
}
agent = Reporting(
    models={"policy": Policy(**spaces), "value": Value(**spaces)},
    memory=RandomMemory(memory_size=settings.rollout, num_envs=envs.num_envs, device=envs.device),
    cfg={
        "rollouts": settings.rollout,
        "discount_factor": 0.97,
        "learning_rate": 3e-4,
        "entropy_loss_scale": 0.01,
        # `time_limit_bootstrap` stays off: with it, skrl would use the first observation of the next episode
        # instead of the last observation of a truncated episode.
        "experiment": {
            "directory": os.environ.get("PALAESTRA_RUN", "runs"),
            "write_interval": 0,
            "checkpoint_interval": 0,
        },
    },
    **spaces,
)
total = settings.steps or load().steps
trainer = SequentialTrainer(
    env=envs,
    agents=agent,
    cfg={
        "timesteps": -(-total // envs.num_envs),
        "headless": True,
        "disable_progressbar": True,
        "close_environment_at_exit": False,
    },
)
trainer.train()
envs.close()
if run := os.environ.get("PALAESTRA_RUN"):
    torch.save(agent.models["policy"].state_dict(), Path(run) / "policy.pt")
report(step=trainer.cfg.timesteps * envs.num_envs)
print(f"done: {trainer.cfg.timesteps * envs.num_envs} steps")
