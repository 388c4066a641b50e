"""Episodes that do not end, and code that waits for their end."""

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
    """A task whose episodes never end."""

    def step(self, action):
        """Take a step that does not end the episode."""
        observation, reward, _, _, info = super().step(action)
        return observation, reward, False, False, info


class First:
    """A policy that always takes action 0."""

    def predict(self, _observation, state=None, _episode_start=None, **_options):
        """Return the action."""
        return 0, state


@pytest.fixture
def restarter(make_member):
    """Return the restarter of a simulator with the task."""
    member = make_member("collect-0")
    member.env = Endless(OBSERVATIONS["Box"], ACTIONS["Discrete"])
    return Restarter(member)


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Lower the limit of steps to 50."""
    monkeypatch.setattr(episode_end, "MOST_STEPS", 50)


def test_an_evaluation_gives_an_endless_episode_up(restarter):
    """Steps of an endless episode count as progress, so no watchdog would end the run."""
    with pytest.raises(ConfigurationError, match="not ended after 50 steps, and an evaluation waits"):
        evaluate(First(), restarter, [1])


def test_reinforce_gives_an_endless_episode_up(restarter):
    """REINFORCE learns only from complete episodes."""
    model = REINFORCE("MlpPolicy", SimulatorsVecEnv([restarter], 1), policy_kwargs={"net_arch": [4]})

    with pytest.raises(ConfigurationError, match="REINFORCE waits for its end; return truncated after"):
        model.learn(30)


def test_a_long_episode_is_a_line_in_the_log_every_minute(clock):
    """Without these lines, a person could not see that the run continues."""
    end = EpisodeEnd("an evaluation", clock)
    with structlog.testing.capture_logs() as logged:
        for steps in range(40):
            clock.now += SAY_EVERY_S / 10
            end.not_after(steps)

    assert [line["steps"] for line in logged] == [9, 19, 29, 39]
