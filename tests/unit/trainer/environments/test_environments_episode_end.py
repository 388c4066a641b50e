"""An episode that does not end, and the code that waits for its end."""

from __future__ import annotations

import pytest
import structlog

from palaestra_trainer.algorithms.reinforce import REINFORCE
from palaestra_trainer.environments import episode_end
from palaestra_trainer.environments.episode_end import SAY_EVERY_S, EpisodeEnd
from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.testing import FakeTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS


class Endless(FakeTask):
    """A task without an end."""

    def step(self, action):
        """Take a step."""
        observation, reward, _, _, info = super().step(action)
        return observation, reward, False, False, info


class First:
    """A policy that takes the first action."""

    def predict(self, _observation, state=None, _episode_start=None, **_options):
        """Return the action."""
        return 0, state


@pytest.fixture
def restarter(make_member):
    """The restarter of a member with the task."""
    member = make_member("collect-0")
    member.env = Endless(OBSERVATIONS["Box"], ACTIONS["Discrete"])
    return Restarter(member)


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Lower the limit of steps."""
    monkeypatch.setattr(episode_end, "MOST_STEPS", 50)


def test_an_evaluation_gives_an_endless_episode_up(restarter):
    """A policy that stands still would keep the run for ever, and its steps count as progress."""
    with pytest.raises(ConfigurationError, match="not ended after 50 steps, and an evaluation waits"):
        evaluate(First(), restarter, [1])


def test_reinforce_gives_an_endless_episode_up(restarter):
    """It learns from whole episodes."""
    model = REINFORCE("MlpPolicy", SimulatorsVecEnv([restarter], 1), policy_kwargs={"net_arch": [4]})

    with pytest.raises(ConfigurationError, match="REINFORCE waits for its end; return truncated after"):
        model.learn(30)


def test_a_long_episode_is_a_line_in_the_log_every_minute(clock):
    """Otherwise nothing would show that the run continues."""
    end = EpisodeEnd("an evaluation", clock)
    with structlog.testing.capture_logs() as logged:
        for steps in range(40):
            clock.now += SAY_EVERY_S / 10
            end.not_after(steps)

    assert [line["steps"] for line in logged] == [9, 19, 29, 39]
