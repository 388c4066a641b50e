"""`simulators[].batch`: many copies of a world in one process, and the evaluation over ROS."""

import os
import signal
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from palaestra_trainer.environments.infos import OURS
from palaestra_trainer.episodes.batch_vec_env import BatchVecEnv
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError, WrongData
from palaestra_trainer.job.configuration import parse
from palaestra_trainer.simulators.batch_simulator import BatchSimulator
from palaestra_trainer.simulators.connect import simulator_at
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from tests.jobs import example
from tests.local_run import ROOT, LocalRun
from tests.soak import resume
from tests.soak.jobs import tiny_job
from tests.waiting import eventually

ROWS = 3
SHORT = {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 12}}
BALANCE = {"id": "cartpole:Balance-v0"}
OWN_ROBOT = """from palaestra_trainer.robots.robotino import Robotino

class Slow(Robotino):
    def drive(self, vx, vy, omega):
        super().drive(vx / 2, vy / 2, omega)
"""
WILD_ROBOT = """from cartpole import CartPole

class Wild(CartPole):
    greatest = (1e9,)
"""
LITTLE_PPO = {"name": "PPO", "hyperparameters": {"n_steps": 20, "batch_size": 40, "n_epochs": 2}}


def configuration(environment=SHORT, robot=None, batch=None, world="arena"):
    """Return a configuration with one collecting MuJoCo."""
    simulator = {
        "name": "collect-0", "group": "collect", "index": 0, "role": "Collect", "driver": "mujoco",
        "world": str(world), "batch": batch,
    }  # fmt: skip
    return parse(
        {"job": "b", "environment": environment, "robot": robot, "steps": 9, "simulators": [simulator]}
    )


@contextmanager
def batch_env(rows=ROWS, seed=5, **changes):
    """Yield a VecEnv of copies in one simulator, and the simulator's launcher."""
    given = configuration(batch=rows, **changes)
    entry = given.simulators[0]
    with ExitStack() as stack:
        launcher = ProcessLauncher(entry.world, "mujoco", (f"--batch={rows}",))
        stack.callback(launcher.close)
        restarter = started(BatchSimulator(launcher, given, entry))
        stack.callback(restarter.stop)
        env = BatchVecEnv(restarter, seed)
        stack.callback(env.close)
        yield env, launcher


@contextmanager
def single_env(seed=5, **changes):
    """Yield a VecEnv of one simulator over ROS; its episodes are those of row 0."""
    given = configuration(**changes)
    with ExitStack() as stack:
        launcher = ProcessLauncher(given.simulators[0].world, "mujoco")
        stack.callback(launcher.close)
        restarter = started(simulator_at(launcher, given, given.simulators[0]))
        stack.callback(restarter.stop)
        env = SimulatorsVecEnv([restarter], seed)
        stack.callback(env.close)
        yield env


def started(member):
    """Return the restarter of a member that has started."""
    restarter = Restarter(member)
    restarter.begin_start()
    restarter.under_way and restarter.under_way.result()
    assert restarter.up()
    return restarter


def actions_of(env, steps, seed=0):
    """Return random actions for all rows: (steps, rows, *action)."""
    env.action_space.seed(seed)
    return np.array([[env.action_space.sample() for _ in range(env.num_envs)] for _ in range(steps)])


def told(info):
    """Return an info as text, without the durations of episodes and without Palaestra's own entry."""
    kept = {name: value for name, value in info.items() if name != OURS}
    if "episode" in kept:
        kept["episode"] = {name: value for name, value in kept["episode"].items() if name != "t"}
    return repr(kept)


@pytest.fixture
def cartpole(tmp_path, monkeypatch):
    """Return the changes of a configuration for the cart-pole of the examples."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    world = tmp_path / "cartpole.xml"
    world.write_text(example("cartpole-mjcf")["spec"]["simulators"][0]["world"]["inline"])
    return {"environment": BALANCE, "robot": "cartpole:CartPole", "world": world}


@pytest.mark.parametrize("task", ["move to target", "balance"])
def test_a_row_equals_the_environment_over_ros(task, cartpole, master) -> None:
    """The policy learns in the copies and is evaluated over ROS, so both must be the same task."""
    del master
    changes = cartpole if task == "balance" else {}
    with batch_env(**changes) as (batch, _), single_env(**changes) as single:
        actions = actions_of(batch, 40)
        assert np.array_equal(batch.reset()[:1], single.reset())
        for chosen in actions:
            observation, rewards, dones, infos = batch.step(chosen)
            seen, reward, done, info = single.step(chosen[:1])

            assert np.array_equal(observation[:1], seen)
            assert (rewards[0], dones[0]) == (reward[0], done[0])
            assert told(infos[0]) == told(info[0])


def test_a_reset_and_a_step_simulate_one_period_of_each_row() -> None:
    """The metric of simulated time counts the copies, and divided by the wall time it is their speed."""
    with batch_env() as (env, _):
        member = env._restarter.member
        before = member.simulated_s
        env.reset()
        [action] = actions_of(env, 1)
        env.step(action)

        assert member.simulated_s - before == pytest.approx(2 * ROWS * 0.192)


def test_a_resume_continues_every_row_bit_for_bit(cartpole) -> None:
    """An interrupted run must equal an uninterrupted one, even if copies were reset after the checkpoint."""
    for changes in ({}, cartpole):
        with batch_env(**changes) as (env, _):
            actions = actions_of(env, 30)
            env.reset()
            for chosen in actions[:17]:
                last, *_ = env.step(chosen)
            states = env.snapshot()
            expected = [env.step(chosen) for chosen in actions[17:]]

            again = BatchVecEnv(env._restarter, 5)
            assert np.array_equal(again.resume(states), last)
            for chosen, (observation, rewards, dones, infos) in zip(actions[17:], expected, strict=True):
                found = again.step(chosen)

                assert np.array_equal(found[0], observation)
                assert np.array_equal(found[1], rewards)
                assert np.array_equal(found[2], dones)
                assert [told(info) for info in found[3]] == [told(info) for info in infos]


def test_a_killed_simulator_ends_the_episodes_of_all_rows_and_comes_back() -> None:
    """One process simulates all rows, so its end is a single fault, and no row of that step is valid.

    An attribute that a callback sets during the restart is set when the next episodes begin.
    """
    with batch_env() as (env, launcher):
        env.reset()
        [action] = actions_of(env, 1)
        os.kill(launcher.state().pid, signal.SIGKILL)

        _, _, dones, infos = env.step(action)

        assert dones.all()
        assert [info[OURS]["valid"] for info in infos] == [False] * ROWS
        assert infos[0][OURS]["sim_fault"]["kind"] == "dead"
        env.set_attr("difficulty", 0.5)
        eventually(lambda: env.step(action)[3][0][OURS]["valid"])
        assert env.get_attr("difficulty") == [0.5] * ROWS


def test_a_simulator_that_dies_during_a_resume_begins_the_next_episode_of_each_row() -> None:
    """A resume repeats steps for seconds, so a simulator can die in it; the run must go on.

    A row that the resume had not begun yet has played its episode before the interruption.
    """
    with batch_env() as (env, launcher):
        env.reset()
        [action] = actions_of(env, 1)
        env.step(action)
        first, *others = env.snapshot()
        states = [replace(first, actions=np.repeat(first.actions, 2, axis=0)), *others]
        os.kill(launcher.state().pid, signal.SIGKILL)

        again = BatchVecEnv(env._restarter, 5)
        again.resume(states)

        eventually(lambda: again.step(action)[3][0][OURS]["valid"])
        assert [state.episode for state in again.snapshot()] == [state.episode + 1 for state in states]


def test_a_resume_without_open_episodes_keeps_the_progress_of_the_training() -> None:
    """A curriculum must not begin again because the simulator restarted at the time of the checkpoint."""
    with batch_env() as (env, _):
        env.set_training_progress(0.8)

        env.resume([EpisodeState(3, None)] * ROWS)

        assert [state.training_progress for state in env.snapshot()] == [0.8] * ROWS
        assert [state.episode for state in env.snapshot()] == [3] * ROWS


def test_the_calls_of_a_vec_env_reach_the_one_environment_of_all_rows() -> None:
    """Callbacks of Stable-Baselines3 call these methods, and the web page asks for the moment of row 0."""
    with batch_env() as (env, _):
        assert [(state.episode, state.actions) for state in env.snapshot()] == [(0, None)] * ROWS

        env.set_attr("difficulty", 0.5)
        env.reset()
        env.step(actions_of(env, 1)[0])

        assert env.get_attr("difficulty", [0, 2]) == [0.5, 0.5]
        assert env.env_method("__str__", indices=1) == [str(env._env)]
        assert env.env_is_wrapped(gymnasium.Wrapper) == [False] * ROWS
        [moment] = env.moments().values()
        assert (moment.episode, moment.step) == (1, 1)


def test_a_row_that_fails_is_truncated_alone(cartpole, monkeypatch, tmp_path) -> None:
    """The other rows must continue. Only the failed row is invalid, and its next episode is normal."""
    unlimited = cartpole["world"].read_text().replace(' ctrlrange="-1 1" ctrllimited="true"', "")
    cartpole["world"].write_text(unlimited)
    (tmp_path / "wild_robots.py").write_text(WILD_ROBOT)
    monkeypatch.syspath_prepend(str(tmp_path))
    calm, wild = np.zeros((ROWS, 1), np.float32), np.array([[0.0], [1.0], [0.0]], np.float32)
    with batch_env(**{**cartpole, "robot": "wild_robots:Wild"}) as (env, _):
        env.reset()
        env.step(calm)

        _, rewards, dones, infos = env.step(wild)

        assert (dones.tolist(), rewards.tolist()) == ([False, True, False], [1.0, 0.0, 1.0])
        assert [info[OURS]["valid"] for info in infos] == [True, False, True]
        assert infos[1]["TimeLimit.truncated"]
        assert "row 1" in infos[1][OURS]["sim_fault"]["fact"]
        assert all(info[OURS]["valid"] for info in env.step(calm)[3])


def test_a_reset_that_observes_no_number_is_not_a_failed_simulation(monkeypatch) -> None:
    """The author must look for the fault in the environment, and not in the world."""
    with batch_env() as (env, _):
        reset = env._env.reset

        def observing_nothing(**options):
            observation, info = reset(**options)
            observation[1] = np.nan
            return observation, info

        monkeypatch.setattr(env._env, "reset", observing_nothing)

        with pytest.raises(WrongData, match="row 1 fails at each reset: the environment's observation is"):
            env._begin(np.arange(ROWS))


def test_a_policy_learns_in_the_copies_and_is_evaluated_over_ros(tmp_path) -> None:
    """The whole path: the job's field, the plan, sidecar, trainer and evaluation."""
    evaluation = {"everySteps": 240, "episodes": 2, "confirmEpisodes": 2}
    job = tiny_job(
        collect={"driver": "mujoco", "batch": 4}, evaluate={"driver": "mujoco"}, steps=480,
        evaluation=evaluation, algorithm=LITTLE_PPO,
    )  # fmt: skip

    with LocalRun(tmp_path, job) as run:
        code, output = run.end()

    assert code == 0, output
    assert (run.summary()["faults"], run.summary()["steps"]) == (0, 480)
    assert resume.results(run.directory)


@pytest.mark.parametrize(
    ("environment", "robot", "fact"),
    [
        ({"id": "SeeTarget-v0"}, None, "has no batched form"),
        ({**SHORT, "frameStack": 2}, None, "environment.frameStack: has no batched form"),
        (SHORT, "EPuck", "EPuck has no batched form"),
        (SHORT, "own_robots:Slow", "Slow overrides drive"),
    ],
)
def test_what_has_no_batched_form_is_refused_before_a_simulator_starts(
    environment, robot, fact, tmp_path, monkeypatch
) -> None:
    """A form that ignores a method or a wrapper of the job would train another policy in silence."""
    (tmp_path / "own_robots.py").write_text(OWN_ROBOT)
    monkeypatch.syspath_prepend(str(tmp_path))
    given = configuration(environment, robot, batch=2)

    with pytest.raises(ConfigurationError, match=fact):
        BatchSimulator(None, given, given.simulators[0])
