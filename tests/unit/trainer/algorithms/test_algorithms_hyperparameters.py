"""Hyperparameters are checked by the signature of the algorithm's class, before a model is made."""

from __future__ import annotations

import pytest

from palaestra_protocol.foreign_words import ELSEWHERE, OF_ZOO
from palaestra_trainer.algorithms import ALGORITHMS, buffer_options, check
from palaestra_trainer.algorithms.registry import OURS
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_defaults_are_hyperparameters_of_the_class(name):
    """Every run with a default that the class does not have would fail."""
    assert check(Algorithm(name=name, hyperparameters=dict(ALGORITHMS[name].arena))).cls


def test_all_mistyped_hyperparameters_are_reported_at_once_with_the_nearest_name():
    """A person can correct all names at once, and no simulator starts for a run that must fail."""
    wrong = {"learning_rat": 1, "gama": 0.9, "zzz": 0}

    with pytest.raises(ConfigurationError) as caught:
        check(Algorithm(name="DQN", hyperparameters=wrong))

    lines = str(caught.value).splitlines()
    assert (
        "hyperparameters.learning_rat: DQN has no such hyperparameter; did you mean learning_rate?"
        in lines[0]
    )
    assert "did you mean gamma?" in lines[1]
    assert "use one of batch_size, " in lines[2]


@pytest.mark.parametrize("name", ["env", "seed", "optimize_memory_usage", "device"])
def test_what_the_training_loop_gives_itself_is_no_hyperparameter(name):
    """A job that could set these would disable the code that keeps invalid rows out of the losses."""
    with pytest.raises(ConfigurationError, match=f"{name}: is not a hyperparameter here"):
        check(Algorithm(name="DQN", hyperparameters={name: 1}))


def test_the_error_for_an_unknown_algorithm_has_the_nearest_name():
    """The operator checks the name too, but a person may also write training.yaml by hand."""
    with pytest.raises(ConfigurationError, match=r"algorithm.name: DQM .* did you mean DQN"):
        check(Algorithm(name="DQM"))


def test_returns_over_several_steps_are_refused_where_rows_are_mixed():
    """Rows of several simulators alternate in the buffer, so the next row may belong to another simulator."""
    with pytest.raises(ConfigurationError, match="n_steps"):
        check(Algorithm(name="DQN", hyperparameters={"n_steps": 3}))


WRONG = [
    ("A2C", {"ent_coef": "lin_0.01"}, "ent_coef: 'lin_0.01' is refused; give a number"),
    ("DQN", {"gamma": "0.9"}, "gamma: '0.9' is refused; give a number"),
    ("DQN", {"batch_size": 32.5}, "batch_size: 32.5 is refused; give a whole number"),
    ("PPO", {"use_sde": 1}, "use_sde: 1 is refused; give true or false"),
    ("PPO", {"clip_range_vf": "small"}, "'small' is refused; give a number or null or a schedule such as"),
    ("DQN", {"train_freq": ["a", 1]}, "give a whole number or a list of a whole number and text"),
    ("PPO", {"policy_kwargs": [64]}, "policy_kwargs: [64] is refused; give a mapping or null"),
    ("PPO", {"policy_kwargs": {"net_arc": [8]}}, "has no such argument; did you mean net_arch?"),
    ("PPO", {"policy_kwargs": {"net_arch": "big"}}, "net_arch: 'big' is refused; give a list or a mapping"),
    ("PPO", {"policy_kwargs": {"activation_fn": "Tahn"}}, "'Tahn' is not known; did you mean Tanh?"),
    ("PPO", {"policy_kwargs": {"optimizer_class": 3}}, "3 is not known; use one of Adam"),
    ("PPO", {"policy_kwargs": {"features_extractor_class": "Own"}}, "name a class as module:Class"),
]


@pytest.mark.parametrize(("name", "hyperparameters", "line"), WRONG, ids=lambda it: str(it)[:40])
def test_a_value_of_a_wrong_type_is_refused_by_the_signature(name, hyperparameters, line):
    """Without the check, each of four attempts would start the simulators and then fail."""
    with pytest.raises(ConfigurationError) as refusal:
        check(Algorithm(name=name, hyperparameters=hyperparameters))

    assert line in str(refusal.value)


def test_a_misspelled_class_with_its_module_has_the_nearest_one_named():
    """The module is right, so the suggestion compares only class names."""
    policy = {"activation_fn": "torch.nn.Tahn"}

    with pytest.raises(
        ConfigurationError, match=r"'torch\.nn\.Tahn' is not known; did you mean Tanh\?, or write"
    ):
        check(Algorithm(name="DQN", hyperparameters={"policy_kwargs": policy}))


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_every_algorithm_takes_a_schedule_of_its_learning_rate(name):
    """The signature of TQC has a bare Callable, so the check cannot rely on declared arguments."""
    for schedule in ("lin_7.3e-4", [[0, 0.001], [1, 0.0001]]):
        assert check(Algorithm(name=name, hyperparameters={"learning_rate": schedule}))

    with pytest.raises(ConfigurationError, match=r"give a number or a schedule such as lin_0\.001"):
        check(Algorithm(name=name, hyperparameters={"learning_rate": "quick"}))


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_defaults_have_the_types_of_the_signature(name):
    """Each run with a default of a wrong type would be refused.

    As everywhere in YAML, an integer is accepted for a float.
    """
    check(Algorithm(name=name, hyperparameters=ALGORITHMS[name].defaults))


def test_words_of_other_projects_are_refused_with_their_place_here():
    """The nearest hyperparameter would be a wrong suggestion: `n_timesteps` does not mean `n_steps`."""
    given = Algorithm(name="PPO", hyperparameters={"n_timesteps": 1e5, "policy": "MlpPolicy", "seed": 1})

    with pytest.raises(ConfigurationError) as refused:
        check(given)

    assert str(refused.value).splitlines() == [
        "algorithm.hyperparameters.n_timesteps: is not a hyperparameter here; write trainer.steps",
        "algorithm.hyperparameters.policy: is not a hyperparameter here; write trainer.algorithm.policy",
        "algorithm.hyperparameters.seed: is not a hyperparameter here; write spec.seed",
        (
            "algorithm.hyperparameters: has words of RL-Baselines3-Zoo; "
            "`palaestra from-zoo FILE` writes a job from a whole file of RL-Baselines3-Zoo"
        ),
    ]


@pytest.mark.parametrize(
    ("name", "word", "fact"),
    [
        (
            "A2C",
            "n_epochs",
            "A2C has no such hyperparameter, unlike PPO, RecurrentPPO, MaskablePPO; leave it out",
        ),
        (
            "DQN",
            "noise_type",
            "DQN has no such hyperparameter, unlike SAC, TD3, DDPG, TQC, CrossQ; leave",
        ),
        (
            "DQN",
            "optimize_memory_usage",
            "is not a hyperparameter here; in a run, its value is always false",
        ),
        ("REINFORCE", "rollout_buffer_class", "REINFORCE has no such hyperparameter, unlike PPO, A2C, TRPO"),
        ("PPO", "log_std_init", "is an argument of the policy; write it in policy_kwargs.log_std_init"),
        ("PPO", "lr", "PPO has no such hyperparameter; write learning_rate"),
        ("A2C", "cliprange", "A2C has no such hyperparameter; use one of"),
        ("SAC", "save_freq", "is not a hyperparameter here; write trainer.checkpoint.everySteps"),
        (
            "TRPO",
            "max_steps",
            "is not a hyperparameter here; write trainer.steps, or trainer.environment.options",
        ),
        ("DQN", "rollout_steps", "DQN has no such hyperparameter; use one of"),
    ],
)
def test_a_word_with_a_meaning_of_its_own_is_not_taken_for_a_misspelling(name, word, fact):
    """A person who followed a suggestion would set another hyperparameter to this value."""
    with pytest.raises(ConfigurationError) as refused:
        check(Algorithm(name=name, hyperparameters={word: 3}))

    line = str(refused.value)
    assert line.startswith(f"algorithm.hyperparameters.{word}: {fact}")
    assert "did you mean" not in line


def test_layers_that_policy_and_value_shared_have_their_form_of_today():
    """Half of the examples on the web use the old form, so the message shows the present form."""
    old = {"policy_kwargs": {"net_arch": [{"pi": [8], "vf": [8]}]}}

    with pytest.raises(ConfigurationError, match=r"removed in 1\.8; write \{pi: \[\.\.\.\], vf"):
        check(Algorithm(name="PPO", hyperparameters=old))


def test_each_argument_that_a_run_gives_itself_has_its_place():
    """A person may copy any argument of Stable-Baselines3. The message shows the job's field for it."""
    assert OURS - {"self"} - {*buffer_options.NAMES} <= ELSEWHERE.keys()


def test_no_word_with_a_place_elsewhere_is_a_hyperparameter():
    """A hyperparameter with such a name would be rejected, with a hint to another field of the job."""
    known = {name for entry in ALGORITHMS.values() for name in entry.known}

    assert known.isdisjoint(ELSEWHERE)
    assert ELSEWHERE.keys() >= OF_ZOO
