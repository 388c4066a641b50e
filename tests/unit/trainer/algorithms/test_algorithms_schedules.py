"""A hyperparameter may be a schedule: points, a function of the job's author, or a text."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

from palaestra_trainer.algorithms import ALGORITHMS, check
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from tests.unit.trainer.algorithms.conftest import ROLLOUTS

POINTS = [[0, 0.01], [0.5, 0.002], [0.75, 0.004]]
SHARES = {1.0: 0.01, 0.75: 0.006, 0.5: 0.002, 0.375: 0.003, 0.2: 0.004, 0.0: 0.004}


def test_a_schedule_may_have_points(corridor_model):
    """Straight lines join the points. Before the first and after the last point the value is constant."""
    wanted = Algorithm(
        name="PPO", hyperparameters=ROLLOUTS | {"learning_rate": POINTS, "clip_range": "lin_0.3"}
    )
    check(wanted)

    model = corridor_model(wanted)

    assert {left: model.lr_schedule(left) for left in SHARES} == pytest.approx(SHARES)
    assert model.clip_range(0.5) == pytest.approx(0.15)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_takes_a_schedule(name):
    """Some algorithms declare the rate as a bare Callable, so the check cannot rely on its arguments."""
    for rate in ("lin_0.001", POINTS):
        check(Algorithm(name=name, hyperparameters={"learning_rate": rate}))


def test_plain_stable_baselines_loads_a_schedule_of_points(corridor_model, tmp_path):
    """The file refers to a function of NumPy, with the points as arguments, and not to this package."""
    corridor_model(Algorithm(name="PPO", hyperparameters=ROLLOUTS | {"learning_rate": POINTS})).save(
        tmp_path / "model.zip"
    )
    program = f"""
        import sys
        sys.modules["palaestra_trainer"] = None  # an import of it fails from now on
        from stable_baselines3 import PPO
        print(PPO.load({str(tmp_path / "model.zip")!r}, device="cpu").lr_schedule(0.5))
    """

    shown = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], check=True, capture_output=True, text=True
    )

    assert shown.stdout == "0.002\n"


def test_a_schedule_may_be_a_function_of_ones_own_which_the_model_names(lab, corridor_model, tmp_path):
    """The file has only the function's name, so a changed function takes effect in the next attempt."""
    wanted = Algorithm(
        name="PPO",
        hyperparameters=ROLLOUTS | {"learning_rate": "my_lab:halving", "clip_range": "my_lab:halving"},
    )
    check(wanted)

    model = corridor_model(wanted)
    model.save(tmp_path / "model.zip")

    assert (model.lr_schedule(1.0), model.lr_schedule(0.5)) == pytest.approx((0.01, 0.0025))
    assert model.clip_range(0.75) == pytest.approx(0.005)
    program = f"""
        import my_lab
        my_lab.halving = lambda left: 0.5
        from stable_baselines3 import PPO
        print(PPO.load({str(tmp_path / "model.zip")!r}, device="cpu").clip_range(1.0))
    """
    shown = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], check=True, capture_output=True, text=True, cwd=lab
    )
    assert shown.stdout == "0.5\n"


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("my_lab:rising", "my_lab:rising(1.0) is -1.0; return a finite number of 0 or more"),
        ("my_lab:failing", "my_lab:failing(1.0) cannot be used (RuntimeError: no rate today"),
        ("my_lab:Doubled", "my_lab:Doubled(1.0) cannot be used ("),
        ("my_lab:none", "my_lab:none cannot be imported (AttributeError"),
    ],
)
def test_a_function_that_returns_no_rate_is_refused(lab, name, fact):
    """The first update would fail or increase the loss, after the simulators have started."""
    del lab
    with pytest.raises(ConfigurationError) as refusal:
        check(Algorithm(name="DQN", hyperparameters={"learning_rate": name}))

    assert str(refusal.value).startswith(f"algorithm.hyperparameters.learning_rate: {fact}")


@pytest.mark.parametrize(
    "points", [[], [[0.5, 0.1], [0.5, 0.2]], [[0, 0.1], [2, 0.2]], [[0, "0.1"]], [0, 0.1], "lin_x"]
)
def test_points_that_make_no_schedule_are_refused(points):
    """The shares of the steps must increase from 0 to 1."""
    with pytest.raises(ConfigurationError, match=r"learning_rate: .* or a schedule such as lin_0\.001 or"):
        check(Algorithm(name="PPO", hyperparameters={"learning_rate": points}))
