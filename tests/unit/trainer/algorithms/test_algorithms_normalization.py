"""Normalization of observations and rewards; the statistics are a part of the policy."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import stable_baselines3 as sb3
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecNormalize

from palaestra_trainer.algorithms import ModelPolicy, make_model
from palaestra_trainer.algorithms.normalization import Moments, ValidNormalize
from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.seeds import EVALUATE
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, Normalize
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.evaluate import measure
from palaestra_trainer.simulators.restarter import Restarter
from tests.pages import blocks

DOCS = Path(__file__).parents[4] / "docs"
GAMMA = 0.9
HYPERPARAMETERS = {
    "DQN": {"learning_starts": 10, "batch_size": 8, "buffer_size": 200, "policy_kwargs": {"net_arch": [8]}},
    "PPO": {"n_steps": 16, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}},
}


@pytest.fixture
def make_env(make_member):
    """Yield a function that makes corridors of two simulators, or one for each item of `faults`."""

    def make(*faults):
        members = [make_member(f"collect-{row}", **these) for row, these in enumerate(faults or ({}, {}))]
        return SimulatorsVecEnv([Restarter(member) for member in members], run_seed=1)

    return make


@pytest.fixture
def make_normal(make_env):
    """Return a function that makes a model of the corridor with normalization."""

    def make(name="PPO", *faults, **normalize):
        algorithm = Algorithm(
            name=name, hyperparameters=HYPERPARAMETERS[name], normalize=Normalize(**normalize)
        )
        return make_model(algorithm, make_env(*faults), seed=1)

    return make


def actions(members, steps=60):
    """Return random actions for each simulator, from a fixed seed."""
    return np.random.default_rng(1).integers(0, 2, (steps, members))


def of(running):
    """Return the statistics of Stable-Baselines3 as lists."""
    return [np.asarray(running.mean).tolist(), np.asarray(running.var).tolist(), running.count]


@pytest.mark.parametrize(("observations", "rewards"), [(True, True), (False, True), (True, False)])
def test_without_faults_it_is_stable_baselines3s_own(make_env, observations, rewards):
    """The results are equal to the last bit, so the documentation of VecNormalize applies."""
    wanted = Normalize(observations=observations, rewards=rewards, clip_observations=1.5, clip_rewards=1.2)
    ours = ValidNormalize(make_env(), wanted, GAMMA)
    theirs = VecNormalize(
        make_env(), norm_obs=observations, norm_reward=rewards, clip_obs=1.5, clip_reward=1.2, gamma=GAMMA
    )

    assert np.array_equal(ours.reset(), theirs.reset())
    for chosen in actions(2):
        mine, expected = ours.step(chosen), theirs.step(chosen)
        assert all(np.array_equal(one, other) for one, other in zip(mine[:3], expected[:3], strict=True))
        last = [info.get("terminal_observation", np.zeros(2)).tolist() for info in mine[3]]
        assert last == [info.get("terminal_observation", np.zeros(2)).tolist() for info in expected[3]]
        assert np.array_equal(ours.get_original_obs(), theirs.get_original_obs())
        assert np.array_equal(ours.get_original_reward(), theirs.get_original_reward())
        assert np.array_equal(ours.returns, theirs.returns)


def test_what_a_fault_spoiled_reaches_no_statistic(make_env):
    """A broken simulator repeats its last observation, which would pull the mean toward it."""
    env = ValidNormalize(make_env({}, {"steps": [12, 20]}), Normalize(), GAMMA)
    seen = [env.reset() * 0 + env.get_original_obs()]

    for chosen in actions(2):
        *_, infos = env.step(chosen)
        seen.append(env.get_original_obs()[[info["palaestra"]["valid"] for info in infos]])

    rows = np.concatenate(seen)
    assert len(rows) < 2 * 61
    assert env.obs_rms.count == pytest.approx(len(rows), abs=1e-3)
    assert env.obs_rms.mean == pytest.approx(rows.mean(axis=0), abs=1e-4)
    assert env.ret_rms.count == pytest.approx(len(rows) - 2, abs=1e-3)


def test_a_fault_ends_the_return_that_rewards_are_scaled_by(make_env):
    """The return of the cut episode must not continue in the next one."""
    env = ValidNormalize(make_env({"steps": [3]}), Normalize(), GAMMA)
    env.reset()

    walked = [env.step(np.zeros(1, int)) and env.returns.tolist() for _ in range(3)]

    assert walked == [[pytest.approx(-0.1)], [pytest.approx(-0.19)], [0.0]]


def test_a_step_that_has_not_ended_does_not_discount_the_return(make_env):
    """With `Asynchronous`, a slow simulator waits for many steps of the others."""
    env = ValidNormalize(make_env(), Normalize(), GAMMA)
    env.reset()
    env.returns = np.array([2.0, 3.0])

    env._earn(np.array([1.0, 0.0]), np.array([True, False]))

    assert env.returns.tolist() == [pytest.approx(2.8), 3.0]


def test_a_member_that_cannot_be_reset_shows_nothing_to_the_statistics(make_env):
    """Before its first reset, a simulator's observation is all zeros, which would change the mean."""
    env = ValidNormalize(make_env({}, {"resets": [1]}), Normalize(), GAMMA)

    env.reset()

    assert env.obs_rms.count == pytest.approx(1, abs=1e-3)


def test_the_end_of_an_episode_is_not_seen_where_the_next_cannot_begin(make_env):
    """After a failed reset, the row repeats the old episode's last observation, which must count once."""
    env = ValidNormalize(make_env({"resets": [2]}), Normalize(), GAMMA)
    env.reset()

    steps = [env.step(np.zeros(1, int)) for _ in range(8)]

    assert [(dones.item(), infos[0]["palaestra"]["valid"]) for *_, dones, infos in steps] == [
        (False, True)
    ] * 7 + [(True, True)]
    assert env.obs_rms.count == pytest.approx(8, abs=1e-3)


def test_a_policy_is_not_used_with_another_epsilon(make_normal):
    """The file may come from another release with another epsilon."""
    env = make_normal().get_vec_normalize_env()

    with pytest.raises(ValueError, match=r"its epsilon is 0\.5"):
        env.learn_from_json(env.to_json() | {"epsilon": 0.5})


def test_the_replay_buffer_holds_what_was_seen(make_normal):
    """Statistics change during a run, so stored rows are raw, and are normalized when they are sampled."""
    model = make_normal("DQN").learn(40)
    buffer = model.replay_buffer
    env = model.get_vec_normalize_env()

    stored = buffer.observations[: buffer.size(), 0]
    drawn = buffer._get_samples(np.arange(buffer.size()), env)

    assert set(np.unique(np.round(stored[:, 0] * 10))) <= set(range(-8, 4))
    assert np.array_equal(drawn.observations.numpy(), env.normalize_obs(stored))
    assert set(buffer.rewards[: buffer.size()].flatten()) <= {np.float32(-0.1), np.float32(1.0)}


def test_a_policy_is_shown_what_it_learned_from(make_env):
    """A caller of the policy has raw observations, so the policy normalizes them itself."""
    env = make_env()
    env.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)  # continuous, so that small differences count
    normalizing = Algorithm(name="PPO", hyperparameters=HYPERPARAMETERS["PPO"], normalize=Normalize())
    model = make_model(normalizing, env, seed=1).learn(40)
    observation = np.array([0.2, 0.1], np.float32)
    seen = model.get_vec_normalize_env().normalize_obs(observation)

    chosen, _ = ModelPolicy(model).predict(observation, deterministic=True)

    assert chosen == model.predict(seen, deterministic=True)[0]
    assert chosen != model.predict(observation, deterministic=True)[0]


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_an_evaluation_earns_what_it_earns_and_changes_no_statistic(make_normal, make_member, name):
    """Two policies are compared by the environment's rewards, not by normalized ones."""
    model = make_normal(name).learn(40)
    env = model.get_vec_normalize_env()
    before = of(env.obs_rms), of(env.ret_rms)

    evaluation = evaluate(ModelPolicy(model), make_member(), [10, 20])

    assert (of(env.obs_rms), of(env.ret_rms)) == before
    for episode in evaluation.episodes:
        expected = 1.1 * episode.success - 0.1 * episode.length
        assert episode.total_reward == pytest.approx(expected)


def test_a_policy_that_was_saved_sees_as_it_saw(make_normal, tmp_path):
    """With other statistics, the same weights would act differently."""
    model = make_normal().learn(40)
    checkpoint.save_tensors(tmp_path / "model.zip", model)

    loaded = make_normal()
    checkpoint.load_tensors(tmp_path / "model.zip", loaded)

    env, other = model.get_vec_normalize_env(), loaded.get_vec_normalize_env()
    assert (of(other.obs_rms), of(other.ret_rms)) == (of(env.obs_rms), of(env.ret_rms))


def shown_in(page, name):
    """Return the Python block on a page of docs/ that defines `name`."""
    found = blocks((DOCS / page).read_text(), "python")
    return next(block for block in found if f"def {name}(" in block)


def test_a_policy_is_used_without_this_package_as_the_page_says(make_normal, tmp_path):
    """The page needs only plain Stable-Baselines3 and the statistics in the model's file."""
    model = make_normal(clip_observations=2.0).learn(40)
    checkpoint.save_tensors(tmp_path / "model.zip", model)
    observation = np.array([0.2, 0.1], np.float32)

    loaded = sb3.PPO.load(tmp_path / "model.zip")
    page = {}
    exec(shown_in("howto/use-a-policy.md", "eyes_of"), page)
    seen = page["eyes_of"](tmp_path / "model.zip")(observation)

    assert np.array_equal(seen, model.get_vec_normalize_env().normalize_obs(observation))
    chosen = ModelPolicy(model).predict(observation, deterministic=True)[0]
    assert loaded.predict(seen, deterministic=True)[0] == chosen


@pytest.mark.parametrize(
    ("saved", "wanted", "fact"),
    [
        ({}, None, "algorithm.normalize is not set, unlike in the checkpoint"),
        (None, {}, "algorithm.normalize is set, unlike in the checkpoint"),
        ({"observations": False}, {}, "it normalizes rewards"),
        ({}, {"observations": False}, "it normalizes observations and rewards"),
        ({}, {"clip_observations": 5.0}, "its limits of clipping are different"),
    ],
)
def test_a_policy_is_not_used_with_other_eyes(make_normal, make_env, tmp_path, saved, wanted, fact):
    """The weights would fit, but their inputs would have another scale."""

    def made(normalize):
        if normalize is not None:
            return make_normal(**normalize)
        return make_model(Algorithm(name="PPO", hyperparameters=HYPERPARAMETERS["PPO"]), make_env(), seed=1)

    checkpoint.save_tensors(tmp_path / "model.zip", made(saved))

    with pytest.raises(ConfigurationError, match=rf"does not fit PPO as configured \({fact}"):
        checkpoint.load_tensors(tmp_path / "model.zip", made(wanted))


@pytest.mark.parametrize(("saved", "wanted"), [({}, {"clipRewards": 5}), ({}, None), (None, {})])
def test_a_run_is_not_continued_with_another_normalization(make_configuration, tmp_path, saved, wanted):
    """One run has one normalization, like one set of hyperparameters.

    For a job without `normalize`, the manifest lacks that field, and this counts as a difference too.
    """
    one, other = ({"name": "PPO", "normalize": normalize} for normalize in (saved, wanted))
    found = checkpoint.SavedCheckpoint(
        path=tmp_path, manifest=checkpoint.describe(make_configuration(algorithm=one), 0, {})
    )

    with pytest.raises(ConfigurationError, match=r"algorithm\.normalize: the run in"):
        checkpoint.refuse_another_run(found, make_configuration(algorithm=other))


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_a_run_that_normalizes_is_measured_as_it_was_evaluated(play, job, directory, make_member, name):
    """`palaestra-eval` must measure the same policy, so it reads the statistics from the model's file."""
    normalizing = job(
        name, algorithm={"name": name, "hyperparameters": HYPERPARAMETERS[name], "normalize": {}}
    )

    code, _ = play(normalizing, {"collect-0": {"steps": [30]}})
    result = measure(
        normalizing, directory.model, lambda _: [make_member("evaluate-0")], episodes=4, stream=EVALUATE
    )

    lines = [json.loads(line) for line in directory.evaluations.read_text().splitlines()]
    best = max(lines, key=lambda line: (line["success_rate"], line["mean_return"]))
    assert code == 0
    assert [result[key] for key in ("success_rate", "mean_return")] == [
        best["success_rate"],
        best["mean_return"],
    ]


@pytest.mark.parametrize("mean", [[0.0], [[0.0, 0.0]]])
def test_statistics_of_another_shape_are_refused(mean):
    """NumPy would broadcast the statistics of one number to all numbers of an observation."""
    content = {"mean": mean, "variance": [1.0, 1.0], "count": 5.0}

    with pytest.raises(ValueError, match=r"statistics of shape .*, not \(2,\)"):
        Moments.from_json(content, (2,))
