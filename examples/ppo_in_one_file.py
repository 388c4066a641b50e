"""PPO in one file, to be read and changed: `trainer: {command: [python, ppo_in_one_file.py]}`.

In a job, the program trains in all simulators with role Collect, for the steps of the job. To run it by hand:

    python examples/ppo_in_one_file.py --environment MoveToTargetEnv-v0 --simulators 2 --steps 4096

A simulator that breaks is restarted within the step; its episode counts as truncated.
"""

import argparse
import os
import time
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical

from palaestra_trainer import make_vec_env, report
from palaestra_trainer.job.configuration import load

parser = argparse.ArgumentParser()
parser.add_argument("--environment", help="id of the environment; by default that of the job")
parser.add_argument("--simulators", type=int, help="number of simulators; by default all with role Collect")
parser.add_argument("--steps", type=int, help="steps of all simulators together; by default those of the job")
parser.add_argument("--rollout", type=int, default=128, help="steps of each simulator between two updates")
parser.add_argument("--epochs", type=int, default=4)
parser.add_argument("--minibatches", type=int, default=4)
parser.add_argument("--gamma", type=float, default=0.97)
parser.add_argument("--gae-lambda", type=float, default=0.95)
parser.add_argument("--clip", type=float, default=0.2)
parser.add_argument("--entropy", type=float, default=0.01)
parser.add_argument("--learning-rate", type=float, default=3e-4)
parser.add_argument("--seed", type=int, default=1)
settings = parser.parse_args()
total = settings.steps or load().steps


class Agent(nn.Module):
    """A policy and a value function, for discrete actions and one-dimensional observations."""

    def __init__(self, numbers: int, actions: int) -> None:
        super().__init__()
        self.policy = nn.Sequential(
            nn.Linear(numbers, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, actions)
        )
        self.critic = nn.Sequential(
            nn.Linear(numbers, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1)
        )

    def value(self, seen: torch.Tensor) -> torch.Tensor:
        """Return the estimated discounted return from this observation on."""
        return self.critic(seen).squeeze(-1)

    def choice(self, seen: torch.Tensor) -> Categorical:
        """Return the distribution of actions."""
        return Categorical(logits=self.policy(seen))


torch.manual_seed(settings.seed)
envs = make_vec_env(settings.environment, settings.simulators)
agent = Agent(envs.single_observation_space.shape[0], int(envs.single_action_space.n))
optimizer = torch.optim.Adam(agent.parameters(), lr=settings.learning_rate, eps=1e-5)

shape = (settings.rollout, envs.num_envs)
observations = torch.zeros((*shape, *envs.single_observation_space.shape))
actions, log_probs, rewards, values, ends = (torch.zeros(shape) for _ in range(5))

began, steps, episodes, cut = time.monotonic(), 0, 0, 0
seen = torch.as_tensor(envs.reset(seed=settings.seed)[0])
while steps < total:
    for step in range(settings.rollout):
        with torch.no_grad():
            choice = agent.choice(seen)
            action = choice.sample()
            observations[step], actions[step] = seen, action
            log_probs[step], values[step] = choice.log_prob(action), agent.value(seen)
        following, reward, terminated, truncated, infos = envs.step(action.numpy())
        ended = terminated | truncated
        rewards[step], ends[step] = torch.as_tensor(reward), torch.as_tensor(ended)
        # A time limit or a fault truncates an episode that would have continued: add its remaining value.
        for index in np.flatnonzero(truncated & ~terminated):
            last = torch.as_tensor(infos["final_obs"][index])
            with torch.no_grad():
                rewards[step, index] += settings.gamma * agent.value(last)
        episodes += int(ended.sum())
        cut += int(infos.get("final_info", {}).get("_sim_fault", np.zeros(1)).sum())
        seen = torch.as_tensor(following)
    steps += settings.rollout * envs.num_envs

    with torch.no_grad():
        advantages, advantage, next_value = torch.zeros(shape), torch.zeros(envs.num_envs), agent.value(seen)
        for step in reversed(range(settings.rollout)):
            goes_on = 1.0 - ends[step]
            surprise = rewards[step] + settings.gamma * next_value * goes_on - values[step]
            advantage = surprise + settings.gamma * settings.gae_lambda * goes_on * advantage
            advantages[step], next_value = advantage, values[step]
        returns = advantages + values

    batch = [rows.flatten(0, 1) for rows in (observations, actions, log_probs, advantages, returns)]
    for _ in range(settings.epochs):
        for chosen in torch.randperm(shape[0] * shape[1]).chunk(settings.minibatches):
            was_seen, was_done, was_likely, was_better, was_worth = (rows[chosen] for rows in batch)
            choice = agent.choice(was_seen)
            ratio = (choice.log_prob(was_done) - was_likely).exp()
            better = (was_better - was_better.mean()) / (was_better.std() + 1e-8)
            gain = torch.min(
                ratio * better, ratio.clamp(1 - settings.clip, 1 + settings.clip) * better
            ).mean()
            error = 0.5 * (agent.value(was_seen) - was_worth).square().mean()
            loss = error - gain - settings.entropy * choice.entropy().mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()

    report(step=steps)
    print(f"{steps} steps, {steps / (time.monotonic() - began):.0f} a second, loss {loss.item():.3f}")

envs.close()
if run := os.environ.get("PALAESTRA_RUN"):
    torch.save(agent.state_dict(), Path(run) / "agent.pt")
print(f"done: {steps} steps, {episodes} episodes, {cut} cut by faults")
