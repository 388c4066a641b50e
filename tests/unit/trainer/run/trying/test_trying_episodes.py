"""The episodes in which a person tries an environment, and the problems that they find."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.environments.env_checker import held
from palaestra_trainer.errors import FaultBudgetSpent
from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.run.trying import episodes
from palaestra_trainer.run.trying.agents import EndEpisode, Random, Zero
from palaestra_trainer.run.trying.problems import Problems
from palaestra_trainer.run.trying.report import as_json, line_of, summary
from palaestra_trainer.run.trying.step_times import StepTimes
from palaestra_trainer.simulators.budget import RestartLimit
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.check import go_on


class Task(gymnasium.Env):
    """A task that counts to three; a test replaces the method that should be wrong."""

    observation_space = spaces.Box(0.0, 1.0, (1,), np.float32)
    action_space = spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        super().reset(seed=seed, options=options)
        self.steps = 0
        return self.seen(), {}

    def step(self, action):
        """Count one step."""
        del action
        self.steps += 1
        return self.seen(), self.reward(), self.steps == 3, False, self.info()

    def seen(self):
        """Return the observation."""
        return np.array([self.steps / 3], np.float32)

    def reward(self):
        """Return the reward."""
        return 1.0

    def info(self):
        """Return the info."""
        return {"is_success": True}


@pytest.fixture
def tried(make_member):
    """Return a function that plays two episodes of a task with changes, and returns the findings."""

    def play(agent=None, seeds=(1, 2), check=go_on, **changes):
        member = make_member()
        task = type("Task", (Task,), changes)()
        member.env = held(task, "Task-v0")
        agent = agent or Random(task.action_space, 1)
        return episodes.play(Restarter(member), agent, seeds, check, lambda *_: None)

    return play


def test_a_right_environment_has_figures_and_no_problem(tried):
    """A false problem would make a person search for a bug that does not exist.

    Each episode has three steps with a reward of 1.
    """
    found = tried()

    lines = summary(found)
    assert lines[0] == "2 episodes: return 3.00 to 3.00, mean 3.00; steps 3 to 3, mean 3.0; 2 of 2 succeeded"
    assert lines[1].startswith("a step takes ")
    assert lines[2:] == ["no problem found"]
    assert line_of(1, found.episodes[0]) == "episode  1: return 3.00, 3 steps, success"
    assert as_json(found)["problems"] == []
    assert as_json(found)["steps"] == 6


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seen": lambda _: np.array([np.nan], np.float32)}, "observation[0] is nan; fix the environment"),
        ({"reward": lambda _: np.inf}, "the reward is inf; fix the environment's reward"),
        ({"seen": lambda it: np.array([it.steps])}, "dtype int64, not float32"),
        (
            {"seen": lambda it: np.array([it.steps], np.float32)},
            "number [0] is not between 0.0 and 1.0; widen the space, or clip the observation",
        ),
        ({"seen": lambda _: np.zeros(1, np.float32)}, "no observation changed in 6 steps"),
        ({"reward": lambda _: 0.0}, "every reward of 6 steps was 0; check the reward"),
        ({"info": lambda _: {}}, 'no episode reported its success; set info["is_success"]'),
        ({"reward": lambda _: 1 / 0}, "ZeroDivisionError: division by zero"),
        (
            {
                "seen": lambda it: np.array([it.np_random.random()], np.float32),
                "reset": lambda it, **_: Task.reset(it),
            },
            "the checker of gymnasium says:",
        ),
        (
            {"action_space": spaces.Box(0.0, 5.0, (1,), np.float32)},
            "the checker of Stable-Baselines3 says: We recommend you to use a symmetric and normalized Box",
        ),
    ],
    ids=["nan", "inf", "dtype", "outside", "still", "zero", "no success", "raises", "seed", "scale"],
)
def test_each_problem_is_a_sentence_with_a_remedy(tried, changes, words):
    """A training would end minutes later, or learn nothing."""
    lines = summary(tried(**changes))

    assert any(words in line for line in lines), lines


@pytest.mark.parametrize(
    ("space", "observation"),
    [
        (spaces.Dict({"place": Task.observation_space}), lambda it: {"place": Task.seen(it)}),
        (spaces.Tuple((spaces.Discrete(2), Task.observation_space)), lambda it: (1, Task.seen(it))),
    ],
    ids=["dict", "tuple"],
)
def test_an_observation_of_parts_moves_if_a_part_moves(tried, space, observation):
    """An environment with a constant part, such as a goal, must not be reported as still."""
    lines = summary(tried(observation_space=space, seen=observation))

    assert not any("observation" in line and "same" in line for line in lines), lines


def test_an_episode_that_does_not_end_is_a_problem(tried, monkeypatch):
    """An evaluation would wait for the end of such an episode."""
    monkeypatch.setattr(episodes, "MOST_STEPS", 50)

    lines = summary(tried(step=lambda it, _: (it.seen(), 1.0, False, False, {}), steps=0))

    assert any("has not ended after 50 steps; return truncated" in line for line in lines), lines


def test_the_same_problem_is_told_once_with_its_number():
    """Ten episodes with a line per step would fill the terminal."""
    problems = Problems()
    for _ in range(3):
        problems.add("the reward is nan; fix it")

    assert problems.lines() == ["the reward is nan; fix it (3 times)"]


def test_a_fault_of_the_simulator_is_a_problem_and_the_next_episode_is_played(make_member):
    """A person wants to know of a crash before a night of training."""
    member = make_member(steps=[30])
    restarter = Restarter(member)
    reported = []

    found = episodes.play(
        restarter, Zero(member.env.action_space), range(6), go_on, lambda number, _: reported.append(number)
    )

    assert len(found.episodes) == len(reported) == 5
    assert reported[-1] == 6
    assert any("a fault of the simulator ended an episode" in line for line in found.problems.lines())


def test_a_spent_budget_ends_a_try(make_member):
    """Training ends in the same way, instead of restarting the simulator endlessly."""
    member = make_member(steps=range(1, 1000))
    restarter = Restarter(member, RestartLimit(restarts=2))

    with pytest.raises(FaultBudgetSpent):
        episodes.play(restarter, Zero(member.env.action_space), range(9), go_on, lambda *_: None)


def test_a_signal_ends_a_try_and_is_no_problem_of_the_environment(tried):
    """The program must stop the simulator after the signal."""

    def interrupted():
        raise Interrupted("SIGTERM received")

    with pytest.raises(Interrupted):
        tried(check=interrupted)


def test_an_episode_that_a_person_ends_is_not_counted(tried):
    """The return of half an episode would change the mean."""

    class Impatient(Zero):
        """An agent that ends the first episode after one step."""

        acts = 0

        def act(self, mask):
            """Choose an action, or end the episode."""
            self.acts += 1
            if self.acts == 2:
                raise EndEpisode
            return super().act(mask)

    assert len(tried(Impatient(Task.action_space)).episodes) == 1


def test_the_time_of_a_step_is_divided_among_its_parts():
    """The environment's own time is what remains after the waits for the simulator and for the transport."""
    clock, waited, transported = iter([0.0, 10.0]), iter([0.0, 6.0]), iter([0.0, 1.0])
    times = StepTimes()

    with times.step(lambda: next(transported), lambda: next(clock), lambda: next(waited)):
        pass

    assert (times.simulator_s, times.transport_s, times.environment_s) == (6.0, 1.0, 3.0)
    assert (times.count, times.seconds) == (1, 10.0)
