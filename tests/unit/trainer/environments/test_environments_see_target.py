"""The task SeeTarget with camera images: its data sheet, its episodes and its images."""

from __future__ import annotations

import inspect
import itertools
import math

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

from palaestra_trainer.environments import SeeOptions, SeeTargetEnv
from palaestra_trainer.environments.rewards import TERMS, WEIGHTS
from palaestra_trainer.environments.see_target import IMAGE, REACHED_M
from palaestra_trainer.errors import ConfigurationError, MissingCapability, SimulatorDead
from palaestra_trainer.robots import Movement
from palaestra_trainer.simulators.entry_point import make_seeing
from palaestra_trainer.testing import FakeScene, FakeSeeingRobotino, fake_arena, fake_camera, fake_seeing
from palaestra_trainer.testing.fake_scene import arena

NAME = "SeeTarget-v0"
SHEET = inspect.getdoc(SeeTargetEnv) or ""
FORWARD, TURN_LEFT, STOP = Movement.FORWARD, Movement.TURN_LEFT, Movement.STOP
BEFORE_THE_POLE = {"start": (0.0, 0.0, 0.0), "target": (0.7, 0.0)}
BEFORE_A_WALL = {"start": (1.6, 0.0, 0.0), "target": (-1.0, 0.0)}
VARIANTS = [
    {"actions": actions, "reward": reward, "frames": frames, "cylinders": cylinders}
    for actions, reward, frames, cylinders in (
        ("discrete", "Dense", 1, False),
        ("continuous", "Dense", 3, False),
        ("discrete", "Sparse", 3, True),
    )
]


@pytest.fixture
def make_env():
    """Make an environment on a fake robot with cameras.

    The robot dies at the steps `deaths`; other keywords are options.
    """

    def with_options(deaths=(), **options):
        return make_seeing(*fake_seeing(deaths), **options)

    return with_options


def play(env, episode, movements):
    """Return the results of the steps of one episode."""
    env.reset(seed=3, options=episode)
    return [env.step(movement) for movement in movements]


def tables():
    """Return the tables of the docstring as lists of rows; each row is a dictionary by column."""
    lines = [line.strip() for line in SHEET.splitlines()]
    for is_table, group in itertools.groupby(lines, key=lambda line: line.startswith("|")):
        if is_table:
            head, _, *body = ([cell.strip() for cell in line[1:-1].split("|")] for line in group)
            yield [dict(zip(head, cells, strict=True)) for cells in body]


OBSERVATION, REWARD = tables()


@pytest.mark.parametrize("frames", [1, 3])
def test_the_space_is_the_one_on_the_sheet(make_env, frames):
    """A user reads the shape for each number of frames from the docstring."""
    space = make_env(frames=frames).observation_space

    assert isinstance(space, spaces.Box)
    assert space.shape == tuple(int(row[f"frames={frames}"]) for row in OBSERVATION)
    assert {str(bound) for bound in space.low.flat} == {row["min"] for row in OBSERVATION}
    assert {str(bound) for bound in space.high.flat} == {row["max"] for row in OBSERVATION}
    assert space.dtype == np.uint8


def test_rewards_are_on_the_sheet_with_their_weights():
    """An empty cell means that this reward does not have the term."""
    assert [row["term"] for row in REWARD] == list(TERMS)
    for reward, weights in WEIGHTS.items():
        assert {row["term"]: float(row[reward]) for row in REWARD if row[reward]} == weights


@pytest.mark.parametrize(
    "fact", [f"{REACHED_M:.2f} m", "64 x 48 pixels", f"{fake_camera.POLE_HEIGHT_M} m high"]
)
def test_the_task_is_on_the_sheet_with_its_numbers(fact):
    """A user must find in the docstring when the target counts as reached."""
    assert fact in " ".join(SHEET.split())


@pytest.mark.parametrize("options", VARIANTS, ids=lambda it: "-".join(map(str, it.values())))
def test_gymnasium_has_nothing_to_object_to(make_env, options):
    """The checker tests seeds, spaces, types and determinism, and that no array is returned twice."""
    check_env(make_env(**options), skip_render_check=True)


@pytest.mark.parametrize("options", VARIANTS[:1] + VARIANTS[2:], ids=["one frame", "three frames"])
def test_stable_baselines3_has_nothing_to_object_to(make_env, options):
    """The checker of Stable-Baselines3 has additional rules for images."""
    check_env_for_sb3(make_env(**options), skip_render_check=True)


def test_the_environment_is_made_by_name():
    """With a fake robot, one line makes the environment."""
    env = gymnasium.make(NAME, simulator=fake_seeing, frames=3, movements=["FORWARD", "TURN_LEFT"])

    assert isinstance(env.unwrapped, SeeTargetEnv)
    assert env.unwrapped.options == SeeOptions(frames=3, movements=(FORWARD, TURN_LEFT))


def test_the_pole_is_reached_at_its_distance(make_env):
    """The robot need not stop at the pole."""
    env = make_env()

    steps = play(env, BEFORE_THE_POLE, [FORWARD] * 3)

    assert [info["outcome"] for *_, info in steps] == ["running", "running", "reached"]
    assert [info["is_success"] for *_, info in steps] == [False, False, True]
    assert steps[-1][2:4] == (True, False)
    assert 0.35 < env.target_m < REACHED_M


def test_driving_toward_the_pole_earns_what_was_gained(make_env):
    """A turn on the spot earns nothing and costs time."""
    turning, driving = (
        play(make_env(), BEFORE_THE_POLE, [TURN_LEFT, STOP])[0],
        play(make_env(), BEFORE_THE_POLE, [FORWARD])[0],
    )

    assert turning[4]["reward_terms"]["progress"] == pytest.approx(0.0)
    assert 0.0 < driving[4]["reward_terms"]["progress"] < 0.1
    assert driving[1] == pytest.approx(sum(driving[4]["reward_terms"].values()))


def test_a_collision_ends_the_episode(make_env):
    """The bumper feels walls, but not the pole."""
    steps = play(make_env(), BEFORE_A_WALL, [FORWARD] * 4)
    ended = next(step for step in steps if step[2])

    assert ended[4]["outcome"] == "collided"
    assert ended[1] < 0.0


@pytest.mark.parametrize(("reward", "end"), [("Dense", (False, True)), ("Sparse", (True, False))])
def test_time_is_up_after_max_steps(make_env, reward, end):
    """With Dense the episode is truncated, so the learner estimates the later rewards.

    With Sparse it is terminated, because giving up must cost something.
    """
    steps = play(make_env(max_steps=2, reward=reward), BEFORE_THE_POLE, [STOP, STOP])

    assert [step[2:4] for step in steps] == [(False, False), end]
    assert steps[-1][4]["outcome"] == "time_up"


def test_an_observation_is_what_the_camera_sees(make_env):
    """The colors are in the order red, green, blue: the pole is red."""
    observation, _ = make_env().reset(seed=1, options=BEFORE_THE_POLE)

    assert observation.shape == IMAGE
    assert tuple(observation[24, 32]) == fake_camera.POLE


def test_an_observation_stays_as_it_was_after_the_next_step():
    """A learner may keep an observation, but the facade writes the next image into the same memory."""

    class Reusing(FakeSeeingRobotino):
        buffer = np.zeros(IMAGE, np.uint8)

        def color_image(self):
            self.buffer[:] = super().color_image()
            return self.buffer

    robot = Reusing()
    env = SeeTargetEnv(robot, FakeScene(robot, arena(())), SeeOptions(frames=3))
    first, _ = env.reset(seed=1)
    kept = first.copy()

    second, *_ = env.step(TURN_LEFT)

    assert np.array_equal(first, kept)
    assert not np.array_equal(first[..., 6:], second[..., 6:])


def test_three_frames_are_the_newest_the_oldest_first(make_env):
    """At the start of an episode, all three frames are the first image."""
    env, single = make_env(frames=3), make_env()
    first, _ = env.reset(seed=1)
    seen = [single.reset(seed=1)[0]]

    for movement in (TURN_LEFT, FORWARD, TURN_LEFT):
        stacked, *_ = env.step(movement)
        seen.append(single.step(movement)[0])

    assert np.array_equal(first, np.concatenate([seen[0]] * 3, axis=2))
    assert np.array_equal(stacked, np.concatenate(seen[-3:], axis=2))


def test_without_cylinders_episodes_use_the_whole_floor(make_env):
    """Starts and poles may then be where the arena has its cylinders."""
    env = make_env()

    places = [env.reset(seed=seed)[1]["target"] for seed in range(60)]

    assert any(arena().gap(*place) < 0.0 for place in places)


def test_with_cylinders_they_stand_and_starts_keep_clear_of_them(make_env):
    """A reset removes the cylinders, so the environment places them again."""
    env = make_env(cylinders=True)

    for seed in range(30):
        observation, info = env.reset(seed=seed)
        assert arena().gap(info["start"].x_m, info["start"].y_m) > 0.3
        assert env.target_m >= 1.0
    observation, _ = env.reset(options={"start": (0.0, 0.8, 0.0), "target": (1.6, 0.8)})

    assert tuple(observation[24, 32]) == fake_camera.CYLINDER


def test_a_start_in_a_cylinder_is_refused_only_where_there_is_one(make_env):
    """Without cylinders, the same position is free."""
    episode = {"start": (0.8, 0.8, math.pi), "target": (-1.0, 0.0)}
    make_env().reset(seed=1, options=episode)

    with pytest.raises(ConfigurationError, match="puts the robot in an obstacle"):
        make_env(cylinders=True).reset(seed=1, options=episode)


def test_a_robot_without_a_camera_is_refused_before_the_first_episode():
    """A job with such a robot can never train, so the error comes before the first step."""
    with pytest.raises(MissingCapability, match="FakeRobotino has no Cameras, which SeeTargetEnv needs"):
        make_seeing(*fake_arena())


def test_a_simulator_is_given_back_if_its_robot_has_no_camera(monkeypatch):
    """Another environment of the process may then use the simulator."""
    released = []
    robot, scene = fake_arena()
    taken = type("Taken", (), {"robot": robot, "scene": scene, "release": lambda: released.append(True)})
    monkeypatch.setenv("PALAESTRA_CONFIG", "training.yaml")
    monkeypatch.setattr("palaestra_trainer.simulators.configured.simulator_for", lambda *_: taken)

    with pytest.raises(MissingCapability):
        make_seeing()

    assert released == [True]


def test_an_image_of_another_size_is_refused():
    """The message has both sizes, and the place where the size is set."""

    class Large(FakeSeeingRobotino):
        def color_image(self):
            return np.zeros((480, 640, 3), np.uint8)

    _, scene = fake_seeing()

    with pytest.raises(ConfigurationError, match=r"\(480, 640, 3\), but SeeTarget-v0 needs \(48, 64, 3\)"):
        SeeTargetEnv(Large(), scene).reset(seed=1)


def test_without_mujoco_an_environment_of_its_own_is_refused(monkeypatch):
    """The message has the package to install. No process is started."""
    monkeypatch.delenv("PALAESTRA_CONFIG", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)

    with pytest.raises(ConfigurationError, match=r"is not installed; install palaestra-sim\[mujoco\]"):
        make_seeing()


def test_a_fault_of_the_simulator_comes_through_unchanged(make_env):
    """The caller of the environment decides what a fault means."""
    env = make_env(deaths=(1,))
    env.reset(seed=1)

    with pytest.raises(SimulatorDead):
        env.step(FORWARD)


def test_a_step_before_the_first_reset_is_refused(make_env):
    """Before the first reset, no pole has been placed."""
    with pytest.raises(ResetNeeded):
        make_env().step(FORWARD)


def test_closing_releases_the_simulator_once_it_is_asked():
    """No other environment can use a simulator that was not given back."""
    closed = []
    env = SeeTargetEnv(*fake_seeing(), on_close=lambda: closed.append(True))

    env.close()

    assert closed == [True]
