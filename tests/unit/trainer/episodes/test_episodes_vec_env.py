"""Several simulators as one VecEnv: rows, episodes, seeds, and the interface of Stable-Baselines3."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from gymnasium import Wrapper, spaces
from stable_baselines3.common.vec_env import VecEnv

from palaestra_protocol.scene import TargetMarker
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.seeds import COLLECT, episode_seed
from palaestra_trainer.errors import SimulatorHung
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.waiting.greenlets import let_others
from tests.unit.trainer.episodes.walking import LEFT, RIGHT, walk


@pytest.mark.parametrize("members", [1, 3])
def test_a_step_has_a_row_for_each_member(make_vec_env, make_member, members):
    """A training loop works with any number of simulators only if their rows have the same form."""
    env = make_vec_env(*(make_member(f"collect-{index}") for index in range(members)))

    first = env.reset()
    observations, rewards, dones, infos = env.step(np.full(members, RIGHT))

    assert isinstance(env, VecEnv)
    assert first.shape == observations.shape == (members, 2)
    assert rewards.dtype == np.float32
    assert rewards.shape == dones.shape == (members,)
    assert [info["palaestra"]["valid"] for info in infos] == [True] * members


def test_an_episode_is_reset_in_its_last_step(make_vec_env, make_member):
    """Stable-Baselines3 expects the next episode's first observation. The info has the last one."""
    env = make_vec_env(make_member())
    env.reset()

    observations, rewards, dones, infos = walk(env, 3)[-1]

    assert dones[0]
    assert observations[0][0] == 0.0
    assert infos[0]["terminal_observation"][0] == np.float32(0.3)
    assert infos[0]["TimeLimit.truncated"] is False
    assert infos[0]["episode"]["r"] == pytest.approx(0.8)
    assert infos[0]["episode"]["l"] == 3
    assert rewards[0] == 1.0


def test_a_viewer_sees_where_each_member_is_in_its_episode(make_vec_env, make_member):
    """An environment may return any value as a reward term, so a term that is not a number is left out."""

    class Terms(Wrapper):
        def step(self, action):
            *row, info = self.env.step(action)
            return *row, info | {"reward_terms": {"progress": 0.5, "why": "far"}}

    member = make_member("collect-0")
    member.env = Terms(member.env)
    env = make_vec_env(member, make_member("collect-1"))
    env.reset()
    walk(env, 2)

    moments = env.moments()

    assert [(it.episode, it.step) for it in moments.values()] == [(1, 2), (1, 2)]
    assert moments["collect-0"].rewards == {"progress": 0.5}
    assert moments["collect-1"].rewards == {"walk": -0.1}


def test_a_viewer_sees_the_target_of_a_robot_on_a_floor(make_vec_env, make_member):
    """In a world without a target marker, a person would not see where the robot should drive."""
    located, unplaced = make_member("collect-0"), make_member("collect-1")
    for member, target in ((located, (1.0, -0.5)), (unplaced, None)):
        member.sight = partial(
            Sight, pose=Pose(0.0, 0.0, 0.0), target=target, floor=None, radius_m=0.2, period_s=0.1
        )
    env = make_vec_env(located, unplaced, make_member("collect-2"))
    env.reset()

    targets = [moment.target for moment in env.moments().values()]

    assert targets == [TargetMarker(position=(1.0, -0.5, 0.0), radius_m=0.2), None, None]


def test_a_time_limit_is_distinguished_from_an_end(make_vec_env, make_member):
    """Only after a time limit is the value of later steps bootstrapped."""
    env = make_vec_env(make_member())
    env.reset()

    _, _, dones, infos = walk(env, 8, LEFT)[-1]

    assert dones[0]
    assert infos[0]["TimeLimit.truncated"] is True


def test_each_episode_has_the_seed_of_its_number(make_vec_env, make_member):
    """A run can then be repeated and resumed."""
    members = [make_member("collect-0"), make_member("collect-1")]
    env = make_vec_env(*members, run_seed=5)

    env.resume([EpisodeState(7, None), EpisodeState(0, None)])
    walk(env, 3)

    assert members[0].env.seeds == [episode_seed(5, COLLECT, 0, number) for number in (7, 8)]
    assert members[1].env.seeds == [episode_seed(5, COLLECT, 1, number) for number in (0, 1)]
    assert [state.episode for state in env.snapshot()] == [8, 1]
    assert [info["seed"] for info in env.reset_infos] == [members[i].env.seeds[-1] for i in (0, 1)]


def test_each_episode_begins_with_its_number_and_the_progress_of_that_moment(make_vec_env, make_member):
    """A curriculum needs the number and the progress; they stay the same during an episode."""
    member = make_member()
    env = make_vec_env(member)

    env.reset()
    env.set_training_progress(0.25)
    begun = env.snapshot()[0].training_progress
    walk(env, 3)  # the third step ends the episode and begins the next

    assert begun == 0.0
    assert member.env.options == {"training_progress": 0.25, "episode": 1}
    assert env.snapshot()[0].training_progress == 0.25


def test_a_replayed_episode_begins_with_the_progress_that_it_had(make_vec_env, make_member):
    """With other progress it would be another episode. The next episode gets the current progress."""
    member = make_member()
    env = make_vec_env(member)
    env.set_training_progress(0.5)

    env.resume([EpisodeState(7, np.array([RIGHT]), 0.25)])
    replayed = member.env.options
    walk(env, 2)

    assert replayed == {"training_progress": 0.25, "episode": 7}
    assert member.env.options == {"training_progress": 0.5, "episode": 8}


def test_members_step_at_the_same_time(make_vec_env, make_member):
    """All requests are sent before the first wait, so four simulators do not take four times as long."""
    members = [make_member(f"collect-{index}") for index in range(4)]
    told = []
    for member in members:

        def step(name=member.name):
            told.append(("asked", name))
            let_others()
            told.append(("awaited", name))

        member.take_step = step
    env = make_vec_env(*members)
    env.reset()

    walk(env, 1)

    names = [member.name for member in members]
    assert told == [("asked", name) for name in names] + [("awaited", name) for name in names]


@pytest.mark.parametrize("members", [1, 2])
def test_resting_reaches_every_member(make_vec_env, make_member, members):
    """Paused simulators leave the processor to the learner."""
    made = [make_member(f"collect-{index}") for index in range(members)]
    env = make_vec_env(*made)

    env.pause()
    env.unpause()

    assert [member.log for member in made] == [["pause", "run"]] * members


def test_a_broken_member_is_left_for_the_next_step_to_find(make_vec_env, make_member):
    """The pause only saves processor time, so its failure must not end a run."""
    member = make_member()
    member.pause = lambda: (_ for _ in ()).throw(SimulatorHung("collect-0", "no answer"))
    env = make_vec_env(member)

    env.pause()

    assert env.reset().shape == (1, 2)


def test_the_rest_of_the_interface_reaches_the_environments(make_vec_env, make_member):
    """Callbacks and wrappers of other projects use these methods."""
    members = [make_member("collect-0"), make_member("collect-1")]
    members[0].env = Wrapper(members[0].env)
    env = make_vec_env(*members)
    env.set_options({"easy": True})
    env.reset()
    env.set_attr("color", "red", indices=1)

    assert env.get_attr("options") == [{"training_progress": 0.0, "episode": 0, "easy": True}] * 2
    assert env.get_attr("color", indices=[1]) == ["red"]
    assert env.env_method("has_wrapper_attr", "seeds", indices=0) == [True]
    assert env.env_is_wrapped(Wrapper) == [True, False]
    assert env.seed(9) == [episode_seed(9, COLLECT, index, 1) for index in (0, 1)]
    assert env.seed() == env.seed(9)


def test_observations_by_name_are_stacked_by_name(make_vec_env, make_member):
    """A robot with a camera has a Dict as its observation."""

    class Named(Wrapper):
        observation_space = spaces.Dict({"place": spaces.Box(-1.0, 1.0, (2,), np.float32)})

        def reset(self, **options):
            observation, info = super().reset(**options)
            return {"place": observation}, info

        def step(self, action):
            observation, *rest = super().step(action)
            return {"place": observation}, *rest

    members = [make_member("collect-0"), make_member("collect-1")]
    for member in members:
        member.env = Named(member.env)
    env = make_vec_env(*members)

    assert env.reset()["place"].shape == (2, 2)
    assert walk(env, 1)[0][0]["place"].shape == (2, 2)
