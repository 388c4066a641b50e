"""The conversion of RL-Baselines3-Zoo files to TrainingJobs, with a note for each difference."""

import pytest

from palaestra.api import load
from palaestra.errors import SpecErrors
from palaestra.zoo import ZooError, convert

FILE = """\
default:
  n_timesteps: !!float 1e6
  policy: 'MlpPolicy'

atari:
  n_timesteps: !!float 1e7
  policy: 'CnnPolicy'

# Tuned
Reach-v1: &reach
  normalize: "dict(norm_obs=True, norm_reward=False)"
  n_envs: 20
  n_timesteps: !!float 2.5e5
  policy: 'MlpPolicy'
  learning_rate: lin_3e-4
  clip_range: lin_.2
  ent_coef: 0.0
  train_freq: [1, "episode"]
  policy_kwargs: "dict(log_std_init=-2,
                       activation_fn=nn.ReLU,
                       optimizer_class=th.optim.AdamW,
                       net_arch=[dict(pi=[64, 64], vf=[64])]
                       )"
  env_kwargs: {size: 3}

Push-v1:
  <<: *reach
  normalize: true
  n_envs: 2
"""
OFF_POLICY = "a-v1:\n  n_timesteps: 1000\n"


@pytest.fixture
def converted():
    """Return a function that converts an entry with more lines to a trainer's spec and notes."""

    def convert_words(*words, algorithm="SAC"):
        text = OFF_POLICY + "".join(f"  {word}\n" for word in words)
        result = convert(text, "zoo.yml", algorithm=algorithm)
        notes = [note for note in result.notes if not note.startswith("environment:")]
        return load(result.text).spec.trainer, notes

    return convert_words


def test_each_word_of_an_entry_has_its_place():
    """The job must train with exactly the values of the published entry."""
    spec = load(convert(FILE, "hyperparams/ppo.yml", env="Reach-v1").text).spec

    assert spec.trainer.steps == 250_000
    assert [(group.role, group.count) for group in spec.simulators] == [
        ("Collect", 16),
        ("Collect", 4),
        ("Evaluate", 1),
    ]
    assert spec.trainer.environment.id == "Reach-v1"
    assert spec.trainer.environment.options == {"size": 3}
    algorithm = spec.trainer.algorithm
    assert (algorithm.name, algorithm.policy) == ("PPO", "MlpPolicy")
    assert (algorithm.normalize.observations, algorithm.normalize.rewards) == (True, False)
    assert algorithm.hyperparameters == {
        "learning_rate": "lin_3e-4",
        "clip_range": [[0, 0.2], [1, 0]],
        "ent_coef": 0.0,
        "train_freq": [1, "episode"],
        "policy_kwargs": {
            "log_std_init": -2,
            "activation_fn": "ReLU",
            "optimizer_class": "AdamW",
            "net_arch": {"pi": [64, 64], "vf": [64]},
        },
    }


def test_an_entry_that_refers_to_another_has_its_words_too():
    """Half of Zoo's entries refer to another entry and change one value."""
    spec = load(convert(FILE, "ppo.yml", env="Push-v1").text).spec

    assert spec.trainer.steps == 250_000
    assert spec.trainer.algorithm.normalize.rewards
    assert [group.count for group in spec.simulators] == [2, 1]


def test_an_environment_that_the_file_does_not_name_gets_the_default_with_a_note():
    """Zoo does the same. Without the note, a mistyped id would get general values and nobody would notice."""
    result = convert(FILE, "ppo.yml", env="Own-v0")

    assert load(result.text).spec.trainer.steps == 1_000_000
    assert "--env: ppo.yml has no entry Own-v0; as in Zoo, the job uses the entry default" in result.notes


def test_every_note_is_a_comment_in_the_job():
    """Weeks later a person opens the job, and the notes on standard error are lost."""
    result = convert(OFF_POLICY + '  frame_stack: 4\n  vec_env_wrapper: "a\\nb: 1"\n', "td3.yml")

    assert all(f"# - {note}\n" in result.text for note in result.notes)
    assert load(result.text).metadata.name == "td3-a-v1"


@pytest.mark.parametrize(
    ("file", "algorithm", "name"),
    [
        ("ppo_lstm.yml", None, "RecurrentPPO"),
        ("qrdqn.yml", None, "QRDQN"),
        ("own.yml", "tqc", "TQC"),
        ("ppo.yml", "my.lab:Own", "my.lab:Own"),
    ],
)
def test_the_algorithm_is_the_given_one_else_the_files(file, algorithm, name):
    """Zoo's files are named after their algorithm, and do not contain its name."""
    result = convert(OFF_POLICY, file, algorithm=algorithm)

    assert load(result.text).spec.trainer.algorithm.name == name


@pytest.mark.parametrize(
    ("text", "file", "options", "problem"),
    [
        (FILE, "ppo.yml", {}, "ppo.yml: has 2 environments; choose one as --env ID: Reach-v1, Push-v1"),
        (
            FILE,
            "ppo.yml",
            {"env": "atari"},
            "--env: atari is not an environment in ppo.yml; use one of Reach",
        ),
        (OFF_POLICY, "sac.yml", {"env": "a-v2"}, "a-v2 is not an environment in sac.yml; did you mean a-v1?"),
        (OFF_POLICY, "ars.yml", {}, "ars cannot be used: ARS learns from whole returns, which would include"),
        (
            OFF_POLICY,
            "mine.yml",
            {},
            "mine.yml: the file's name is not an algorithm; give one as --algorithm: DQN",
        ),
        (OFF_POLICY, "sac.yml", {"algorithm": "SAK"}, "--algorithm: SAK is not an algorithm; give one as"),
        (
            "n_timesteps: 5",
            "sac.yml",
            {},
            "sac.yml: has the hyperparameters of one environment, but not its id; give the id as",
        ),
        ("a-v1: {gamma: 1}", "sac.yml", {}, "sac.yml: the entry a-v1 has no n_timesteps; add it"),
        ("a-v1: [1]", "sac.yml", {}, "sac.yml: the entry a-v1 is not a mapping"),
        ("- 1", "sac.yml", {}, "sac.yml: has no entries with names of environments"),
        ("a: b: c", "sac.yml", {}, "sac.yml:1:5: not YAML"),
        ("!!python/object/apply:collections.OrderedDict []", "config.yml", {}, "config.yml that Zoo wrote"),
    ],
)
def test_a_file_or_option_that_is_wrong_is_an_error_with_a_remedy(text, file, options, problem):
    """A guess would train with wrong values for hours."""
    with pytest.raises(ZooError) as error:
        convert(text, file, **options)

    assert problem in str(error.value)


def test_a_value_beyond_the_bounds_of_a_job_is_refused_by_the_job():
    """The converter must not write a job that no command accepts."""
    with pytest.raises(SpecErrors, match=r"spec\.trainer\.steps"):
        convert("a-v1: {n_timesteps: 1e12}", "sac.yml")


def test_a_flat_file_is_one_entry():
    """Users keep the keys of a single run in a separate file, without an entry around them."""
    spec = load(convert("n_timesteps: 5\ngamma: 0.9", "sac.yml", env="a-v1").text).spec

    assert spec.trainer.algorithm.hyperparameters == {"gamma": 0.9}


NOTED = [
    ("n_envs: 32", "n_envs: 32 became 31, because a pod has at most 32 simulators"),
    ("n_envs: many", "n_envs: left out; 'many' is not a number; write one"),
    ("frame_stack: four", "frame_stack: left out; 'four' is not a number"),
    (
        "env_wrapper: a.Own",
        "env_wrapper: a run sums the rewards after the wrappers, Zoo the rewards before them",
    ),
    ("env_wrapper: rl_zoo3.wrappers.FrameSkip", "rl_zoo3.wrappers.FrameSkip needs the package rl_zoo3"),
    ("env_wrapper: [{a.Own: 1, b: 2}]", "is left out, because it does not name a class"),
    ("vec_env_wrapper: a.Own", "vec_env_wrapper: a.Own is left out; a run makes the vector environment"),
    ("vec_env_wrapper: [{b.VecFrameStack: {n_stack: 2, channels_order: first}}]", "is left out; a run makes"),
    ("callback: stable_baselines3.common.callbacks.EvalCallback", "set trainer.evaluation"),
    ("callback: rl_zoo3.callbacks.ParallelTrainCallback", "it needs Zoo's own training"),
    ("monitor_kwargs: \"dict(info_keywords=('is_success',))\"", "monitor_kwargs: left out; a run records"),
    ('replay_buffer_kwargs: "dict(handle_timeout_termination=True)"', "its value is True, as in the file"),
    ('replay_buffer_kwargs: "dict(handle_timeout_termination=False)"', "its value is True, unlike"),
    (
        'replay_buffer_kwargs: "dict(size=1)"',
        "replay_buffer_kwargs.size: left out; the buffer of a run has no",
    ),
    (
        "optimize_memory_usage: true",
        "optimize_memory_usage: left out; in a run, its value is always false",
    ),
    ("noise_std: 0.1", "noise_std: 0.1 is left out; without noise_type it has no effect"),
    ("n_steps: 3", "n_steps: 3 is left out; rows of several simulators share a buffer, so only 1 works"),
    ('normalize: "dict(epsilon=1e-3)"', "normalize.epsilon: left out; algorithm.normalize has no such field"),
    ('normalize: "yes please"', "normalize: left out; is not a Python expression, or is nested too deeply"),
    ("learning_rate: const_0.1", "learning_rate: const_0.1 falls linearly to 0, as in Zoo"),
    (
        'policy_kwargs: "dict(net_arch=[64, dict(pi=[8])])"',
        "policy_kwargs.net_arch: left out; since 1.8, Stable",
    ),
    ('policy_kwargs: "dict(a=Own, gamma=1)"', "policy_kwargs.a: left out; Own does not name a module"),
    ('policy_kwargs: "open(1)"', "policy_kwargs: left out; open(1) is not a mapping"),
    ("policy_kwargs: 3", "policy_kwargs: left out; 3 is not a mapping"),
    ("verbose: 1", "verbose: left out; the log of a run contains all figures"),
]


@pytest.mark.parametrize(("word", "note"), NOTED)
def test_what_a_job_cannot_hold_exactly_is_noted(converted, word, note):
    """Without a note, a person would not learn that the job trains differently from the file."""
    _, notes = converted(word)

    assert any(note in line for line in notes)


def test_the_rest_of_an_expression_is_kept_where_one_part_cannot_be_read(converted):
    """One unknown class must not remove the network architecture next to it."""
    trainer, _ = converted('policy_kwargs: "dict(a=Own, net_arch=[8])"')

    assert trainer.algorithm.hyperparameters == {"policy_kwargs": {"net_arch": [8]}}


def test_hindsight_is_written_as_in_a_job(converted):
    """The current form and the older form of Zoo's her.yml give the same replay buffer."""
    buffer = {
        "replay_buffer_class": "HerReplayBuffer",
        "replay_buffer_kwargs": {"n_sampled_goal": 4, "goal_selection_strategy": "future"},
    }
    now, notes = converted(
        "replay_buffer_class: HerReplayBuffer",
        "replay_buffer_kwargs: \"dict(n_sampled_goal=4, goal_selection_strategy='future')\"",
    )
    before, _ = converted(
        "model_class: tqc", "n_sampled_goal: 4", "goal_selection_strategy: future", algorithm=None
    )

    assert now.algorithm.hyperparameters == before.algorithm.hyperparameters == buffer
    assert before.algorithm.name == "TQC"
    assert notes == []


@pytest.mark.parametrize(("kind", "algorithm"), [("replay", "DQN"), ("rollout", "PPO")])
def test_a_buffer_of_ones_own_is_named_as_in_a_job(converted, kind, algorithm):
    """The buffer keeps its own options; a note names the settings that each run has anyway."""
    trainer, notes = converted(
        f"{kind}_buffer_class: my.lab.Own",
        f'{kind}_buffer_kwargs: "dict(alpha=0.5, handle_timeout_termination=True)"',
        algorithm=algorithm,
    )

    assert trainer.algorithm.hyperparameters == {
        f"{kind}_buffer_class": "my.lab:Own",
        f"{kind}_buffer_kwargs": {"alpha": 0.5},
    }
    assert len(notes) == 1


@pytest.mark.parametrize("word", ["frame_stack: 4", "vec_env_wrapper: [{sb3.VecFrameStack: {n_stack: 4}}]"])
def test_wrappers_and_stacked_frames_are_fields_of_the_environment(converted, word):
    """Both of Zoo's keys for frame stacking give the layout that a job has."""
    trainer, notes = converted("env_wrapper: [a.b.Own: {k: 1}, a.Other]", word)

    own, other = trainer.environment.wrappers
    assert (own.name, own.options, other.name) == ("a.b:Own", {"k": 1}, "a:Other")
    assert trainer.environment.frame_stack == 4
    assert len(notes) == 1


def test_frames_of_normalized_observations_have_a_note(converted):
    """The order of stacking and normalization differs from Zoo, but only if observations are normalized."""
    _, notes = converted("frame_stack: 4", "normalize: true")
    _, of_rewards = converted("frame_stack: 4", "normalize: {norm_obs: false}")

    assert notes == ["frame_stack: a run stacks observations, then normalizes; Zoo normalizes, then stacks"]
    assert of_rewards == []


def test_own_callbacks_and_policies_are_classes_of_the_job(converted):
    """A job names such a class as `module:Class`, Zoo as `module.Class`."""
    trainer, notes = converted("callback: [a.b.Own: {k: 1}, a.Other]", "policy: a.b.Policy")

    own, other = trainer.algorithm.callbacks
    assert (own.name, own.options, other.name) == ("a.b:Own", {"k": 1}, "a:Other")
    assert trainer.algorithm.policy == "a.b:Policy"
    assert notes == []


@pytest.mark.parametrize(
    ("words", "hyperparameters"),
    [
        (["noise_type: normal", "noise_std: 0.1"], {"noise_type": "normal", "noise_std": 0.1}),
        (
            ["noise_type: ' ornstein-uhlenbeck '", "noise_std: 1"],
            {"noise_type": "ornstein-uhlenbeck", "noise_std": 1},
        ),
        (["noise_type: normal", "noise_std: 0"], {}),
        (["noise_type: null", "callback: null", "env_wrapper: null", "replay_buffer_class: null"], {}),
        (["seed: 7", "normalize: false", "n_steps: 1", "policy_kwargs: null"], {}),
        (["learning_rate: linear_0.1"], {"learning_rate": [[0, 0.1], [1, 0]]}),
        (["learning_rate: 0.1"], {"learning_rate": 0.1}),
        (["learning_rate: quick"], {"learning_rate": "quick"}),
    ],
)
def test_words_mean_what_they_mean_in_zoo(converted, words, hyperparameters):
    """In Zoo, noise of 0 means no noise, each schedule name a linear decrease, and null an absent key."""
    trainer, _ = converted(*words)

    assert trainer.algorithm.hyperparameters == hyperparameters


@pytest.mark.parametrize(
    ("normalize", "expected"),
    [
        ("true", (True, True, None, None)),
        ("{norm_obs: false, clip_obs: 5, clip_reward: 2}", (False, True, None, 2)),
        ("\"{'norm_reward': False, 'clip_obs': 5, 'clip_reward': 2}\"", (True, False, 5, None)),
    ],
)
def test_normalization_keeps_only_limits_that_have_an_effect(converted, normalize, expected):
    """A job rejects a limit for values that are not normalized, while Zoo ignores such a limit."""
    trainer, _ = converted(f"normalize: {normalize}")

    found = trainer.algorithm.normalize
    assert (found.observations, found.rewards, found.clip_observations, found.clip_rewards) == expected


def test_normalizing_nothing_is_no_normalization(converted):
    """A job rejects a section `normalize` without an effect."""
    trainer, _ = converted('normalize: "dict(norm_obs=False, norm_reward=False)"')

    assert trainer.algorithm.normalize is None


@pytest.mark.parametrize("environment", ["MoveToTargetEnv-v0", "Navigate-v0"])
def test_the_environments_of_palaestra_need_no_note_about_simulators(environment):
    """These environments take a robot, which needs simulators.

    Only the arena has defaults that the file does not show.
    """
    result = convert("n_timesteps: 5", "ppo.yml", env=environment)

    assert [note.partition(":")[0] for note in result.notes] == (
        ["defaults"] if environment == "MoveToTargetEnv-v0" else []
    )
