"""The options of a task in a job file, and the messages about invalid options."""

from __future__ import annotations

import pytest

from palaestra_trainer.environments.options import MoveToTargetOptions, SeeOptions, parse, parse_as
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots import Movement


def test_nothing_said_gives_the_defaults():
    """An example of two lines, without options, must train."""
    assert parse({}) == MoveToTargetOptions()


def test_a_job_file_names_movements_and_parts_as_text():
    """YAML has no enumerations, so a job names movements by texts."""
    options = parse({"movements": ["STOP", "FORWARD"], "observe": ["target"], "max_steps": 50})

    assert options == MoveToTargetOptions(
        movements=(Movement.STOP, Movement.FORWARD), observe=["target"], max_steps=50
    )


def test_python_may_use_the_enumeration():
    """A person may write `Movement.LEFT` in a notebook."""
    assert parse({"movements": (Movement.LEFT,)}).movements == (Movement.LEFT,)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"reward": "dense"}, "reward: 'dense' is not a reward; use Dense or Sparse"),
        (
            {"observe": ["camera"]},
            "observe: 'camera' is not a part of the observation; use sensors, velocity",
        ),
        ({"observe": []}, "observe: is empty"),
        ({"observe": ["target", "target"]}, "observe: contains a part twice"),
        ({"actions": "both"}, "actions: 'both' is not known; use discrete or continuous"),
        ({"movements": ["JUMP"]}, r"movements: contains unknown movements \(JUMP\); use STOP, FORWARD"),
        ({"movements": []}, "movements: is empty"),
        ({"movements": ["STOP", "STOP"]}, "movements: contains a movement twice"),
        ({"max_steps": 0}, "max_steps: 0 leaves no time; use at least 1"),
        ({"time_up": "done"}, "time_up: 'done' is not known; use terminated or truncated"),
        ({"steps": 7}, "steps: is not an option; use reward, observe, movements"),
    ],
    ids=lambda it: next(iter(it)) + str(next(iter(it.values()))) if isinstance(it, dict) else "",
)
def test_a_wrong_option_is_refused_with_fact_and_remedy(given, message):
    """The error comes before a simulator is started, and has the remedy."""
    with pytest.raises(ConfigurationError, match=message):
        parse(given)


def test_all_mistakes_are_reported_at_once():
    """With a line for each mistake, a person corrects the file in one go."""
    with pytest.raises(ConfigurationError) as caught:
        parse({"reward": "Rich", "actions": "none", "max_steps": -1})

    assert [line.split(":")[0] for line in str(caught.value).splitlines()] == [
        "reward",
        "actions",
        "max_steps",
    ]


def test_a_task_that_sees_has_options_of_its_own():
    """The options for driving have the same names and values as in a task without a camera."""
    options = parse_as(SeeOptions, {"frames": 3, "cylinders": True, "movements": ["FORWARD"]})

    assert options == SeeOptions(frames=3, cylinders=True, movements=(Movement.FORWARD,))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"frames": 2}, "frames: 2 is not a number of frames; use 1 or 3"),
        ({"cylinders": "no"}, "cylinders: 'no' is neither true nor false; use one of them"),
        ({"actions": "both"}, "actions: 'both' is not known; use discrete or continuous"),
        ({"observe": ["target"]}, "observe: is not an option; use reward, movements, actions"),
    ],
    ids=lambda it: next(iter(it)) if isinstance(it, dict) else "",
)
def test_wrong_options_of_a_task_that_sees_are_refused_in_the_same_way(given, message):
    """The error comes before a simulator is started, and has the fact and the remedy."""
    with pytest.raises(ConfigurationError, match=message):
        parse_as(SeeOptions, given)
