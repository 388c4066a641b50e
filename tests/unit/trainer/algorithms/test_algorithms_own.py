"""Classes of a job's author: algorithms, policies and parts of policies."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import numpy as np
import pytest

from palaestra_trainer.algorithms import check
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from tests.unit.trainer.algorithms.conftest import ROLLOUTS
from tests.unit.trainer.conftest import TINY


def test_a_class_of_ones_own_learns_from_valid_rows_only(lab, corridor_model):
    """Rows that a fault spoiled must not reach an author's loss either.

    The class has its own hyperparameter, and passes the others on to its base class.
    """
    del lab
    algorithm = Algorithm(name="my_lab:Careful", hyperparameters=ROLLOUTS | {"care": 0.25})
    check(algorithm)

    counted = []

    model = corridor_model(algorithm, faults=(3, 9)).learn(
        60, lambda locals_, _: not counted.extend(locals_["infos"])
    )

    valid = sum(info["palaestra"]["valid"] for info in counted)
    assert model.care == 0.25
    assert model.num_timesteps == valid < len(counted)


def test_its_own_hyperparameter_is_checked_by_its_type(lab):
    """The type comes from the signature, as for all other hyperparameters."""
    del lab
    wrong = Algorithm(name="my_lab:Careful", hyperparameters={"care": "much", "cares": 1})

    with pytest.raises(ConfigurationError) as refusal:
        check(wrong)

    assert "care: 'much' is refused; give a number" in str(refusal.value)
    assert "cares: my_lab:Careful has no such hyperparameter; did you mean care?" in str(refusal.value)


def test_a_run_with_a_class_of_ones_own_is_saved_and_resumed(lab, play, job, directory):
    """An author may load the model with the class itself, on a machine without this package."""
    algorithm = {"name": "my_lab:Eager", "hyperparameters": TINY | {"learning_starts": 10, "batch_size": 8}}

    code, _ = play(job(algorithm=algorithm, steps=60), {"collect-0": {"steps": [9]}})
    longer, _ = play(job(algorithm=algorithm, steps=90))

    program = f"""
        import sys
        sys.modules["palaestra_trainer"] = None  # an import of it fails from now on
        sys.path.insert(0, {str(lab)!r})
        import my_lab
        print(my_lab.Eager.load({str(directory.model)!r}, device="cpu").num_timesteps > 0)
    """
    shown = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], check=True, capture_output=True, text=True
    )
    assert (code, longer, shown.stdout) == (0, 0, "True\n")


REFUSED = [
    (
        "sb3_contrib:ARS",
        "sb3_contrib:ARS cannot be used: ARS learns from whole returns, which would include rows",
    ),
    (
        "my_lab:Search",
        "Search is neither an OnPolicyAlgorithm nor an OffPolicyAlgorithm, so it would learn from rows",
    ),
    ("HER", "HER cannot be used: HER is a replay buffer; use SAC"),
    ("my_lab:Doubled", "my_lab:Doubled is not a subclass of BaseAlgorithm; name a subclass"),
    ("my_lab:no_class", "my_lab:no_class is not a subclass of BaseAlgorithm"),
    ("my_lab:Missing", "my_lab:Missing cannot be imported .* has no attribute 'Missing'"),
    ("no_lab:Any", "no_lab:Any cannot be imported .* install its package in the image, or add its folder"),
]


@pytest.mark.parametrize(("name", "fact"), REFUSED, ids=[name for name, _ in REFUSED])
def test_a_class_that_cannot_be_used_is_refused_in_one_sentence(lab, name, fact):
    """The class is checked before a simulator starts, so a person waits only seconds for the error."""
    del lab

    with pytest.raises(ConfigurationError, match=rf"algorithm\.name: {fact}"):
        check(Algorithm(name=name))


@pytest.mark.parametrize(
    ("name", "buffer"),
    [
        ("my_lab:Masked", "MaskableRolloutBuffer"),
        ("my_lab:OwnRollouts", "Own"),
        ("my_lab:OwnReplay", "ReplayBuffer"),
    ],
)
def test_a_class_that_makes_its_own_buffer_is_refused(lab, corridor_model, name, buffer):
    """The class would learn from rows that a fault spoiled. The error comes before a simulator starts."""
    del lab
    hyperparameters = {} if "Replay" in name else {"n_steps": 16, "batch_size": 8}
    wanted = Algorithm(name=name, hyperparameters=hyperparameters)
    check(wanted)

    fact = rf"^algorithm\.name: {name.partition(':')[2]} creates its own {buffer}, which would keep rows"
    with pytest.raises(ConfigurationError, match=fact):
        corridor_model(wanted)


def test_parts_of_a_policy_may_be_classes_of_ones_own(lab, corridor_model):
    """Each part is written as `module:Class`; classes of PyTorch may be written by their names alone."""
    del lab
    parts = {
        "features_extractor_class": "my_lab:Doubled",
        "activation_fn": "my_lab:Calm",
        "optimizer_class": "my_lab:Slow",
        "net_arch": [8],
    }
    wanted = Algorithm(
        name="PPO", policy="my_lab:OwnPolicy", hyperparameters=ROLLOUTS | {"policy_kwargs": parts}
    )
    check(wanted)

    policy = corridor_model(wanted).policy

    kinds = {type(part).__name__ for part in (policy, *policy.modules(), policy.optimizer)}
    assert {"OwnPolicy", "Doubled", "Calm", "Slow"} <= kinds


@pytest.mark.parametrize("name", ["PPO", "A2C", "TRPO"])
@pytest.mark.parametrize(
    "parts",
    [
        {"policy_kwargs": {"features_extractor_class": "my_lab:Scribbling"}},
        {"policy": "my_lab:ScribblingPolicy"},
    ],
    ids=["extractor", "policy"],
)
def test_a_network_that_writes_into_its_input_changes_no_row(lab, corridor_model, name, parts):
    """Stable-Baselines3 stores the observation only after the network had access to its memory."""
    del lab
    steps = {"n_steps": 16} | ({} if name == "A2C" else {"batch_size": 8})
    named = Algorithm(
        name=name,
        policy=parts.get("policy"),
        hyperparameters=steps | {"policy_kwargs": parts.get("policy_kwargs", {})},
    )
    model = corridor_model(named)
    seen = []
    step = model.env.step_wait

    def step_wait():
        row = step()
        seen.append(row[0].copy())
        return row

    model.env.step_wait = step_wait

    model.learn(16)

    played = np.stack(seen, axis=1)  # (simulators, steps, *observation)
    stored = model.rollout_buffer.observations.reshape(played.shape)
    assert np.array_equal(stored[:, 1:], played[:, :-1])


@pytest.mark.parametrize(
    ("algorithm", "fact"),
    [
        ({"policy": "MlpPolice"}, r"algorithm\.policy: PPO has no policy MlpPolice; did you mean MlpPolicy"),
        ({"policy": "my_lab:Calm"}, r"algorithm\.policy: my_lab:Calm is not a subclass of BasePolicy"),
        (
            {"hyperparameters": {"policy_kwargs": {"features_extractor_class": "my_lab:Calm"}}},
            r"policy_kwargs\.features_extractor_class: my_lab:Calm is not a subclass of BaseFeatures",
        ),
        (
            {"hyperparameters": {"policy_kwargs": {"optimizer_class": "my_lab:Fast"}}},
            r"policy_kwargs\.optimizer_class: my_lab:Fast cannot be imported",
        ),
    ],
)
def test_wrong_parts_are_refused_by_field_and_remedy(lab, algorithm, fact):
    """The parts are checked before a simulator starts, so a person waits only seconds for the error."""
    del lab

    with pytest.raises(ConfigurationError, match=fact):
        check(Algorithm(name="PPO", **algorithm))


def test_a_policy_that_the_observation_does_not_fit_is_refused(corridor_model):
    """Stable-Baselines3 raises an AssertionError, which would look like a bug of Palaestra."""
    with pytest.raises(ConfigurationError, match="algorithm: PPO refuses its hyperparameters or the envir"):
        corridor_model(Algorithm(name="PPO", policy="CnnPolicy", hyperparameters=ROLLOUTS))


@pytest.mark.parametrize(
    ("extractor", "fact"),
    [
        ("Picky", "TypeError: 'Box' object is not subscriptable"),
        ("Hasty", "AttributeError: 'Hasty' object has no attribute 'missing'"),
        ("Lost", "KeyError: 'units'"),
    ],
)
def test_a_part_of_a_policy_whose_constructor_raises_is_refused_with_its_line(
    lab, corridor_model, extractor, fact
):
    """A retry would raise the same error, so the message has the line of the user's file."""
    parts = {"features_extractor_class": f"my_lab:{extractor}"}
    wanted = Algorithm(name="PPO", hyperparameters=ROLLOUTS | {"policy_kwargs": parts})

    with pytest.raises(ConfigurationError) as refusal:
        corridor_model(wanted)

    assert f"the environment's spaces ({fact}, in {lab / 'my_lab.py'} line " in str(refusal.value)
