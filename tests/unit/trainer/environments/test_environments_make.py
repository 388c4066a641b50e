"""Making a user's environment: the arguments that it gets, and the reasons to reject it."""

# ruff: noqa: ARG002 - gymnasium names the arguments of its methods

from __future__ import annotations

import gymnasium
import pytest

from palaestra_trainer.environments.make import keywords, make_environment
from palaestra_trainer.errors import ConfigurationError, SimulatorDead
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.testing import fake_arena
from tests.unit.trainer.environments.hall import Hall


def refused(made, creator, **task):
    """Return the message with which a class is rejected."""
    with pytest.raises(ConfigurationError) as refusal:
        made(creator, **task)
    return str(refusal.value)


def test_an_environment_without_reward_works(made):
    """A job without `reward` still has the field's default, which a user's environment may ignore."""
    env = made(Hall, options={"size": 6.0})

    assert env.unwrapped.given["size"] == 6.0
    env.reset(seed=1)
    assert env.step(0)[1] == 1.0


def test_an_environment_gets_what_its_signature_accepts(made):
    """An author declares only the arguments that the environment needs."""

    class OnlyRobot(Hall):
        def __init__(self, robot, reward):
            self.given = {"robot": robot, "reward": reward}

    assert set(made(OnlyRobot, reward="Sparse").unwrapped.given) == {"robot", "reward"}


def test_an_environment_with_any_keyword_gets_all(made):
    """The environment may pass the keywords on to a base class."""

    class Anything(Hall):
        def __init__(self, **given):
            self.given = given

    assert set(made(Anything, options={"n": 1}).unwrapped.given) == {"robot", "scene", "reward", "n"}


def test_an_environment_that_accepts_neither_robot_nor_scene_is_refused(made):
    """Without a robot and a scene, the environment would not use the simulators at all."""

    class Alone(Hall):
        def __init__(self, size=1.0):
            self.given = {"size": size}

    assert "Hall-v0 accepts neither robot nor scene" in refused(made, Alone)


def test_a_reward_that_nothing_accepts_is_refused(made):
    """The job asks for Sparse, but the environment would use another reward."""
    assert "environment.reward: Hall-v0 has no argument reward" in refused(made, Hall, reward="Sparse")


def test_all_options_that_do_not_fit_are_reported_at_once(made):
    """A person corrects all options at once; each line has the nearest name or another remedy."""

    class Needy(Hall):
        def __init__(self, robot, scene, width):
            del robot, scene, width

    lines = refused(made, Needy, options={"widht": 1, "length": 2}).splitlines()

    assert lines == [
        "environment.options.widht: Hall-v0 has no such argument; did you mean width?",
        "environment.options.length: Hall-v0 has no such argument; use one of robot, scene, width",
        "environment.options.width: Hall-v0 needs this argument; set it, or give it a default",
    ]


@pytest.mark.parametrize("error", [ValueError, RuntimeError, AttributeError, OSError])
def test_an_environment_whose_constructor_raises_is_a_mistake_of_the_configuration(made, error):
    """A retry would raise the same error, so the message has the line for the author."""

    class Strict(Hall):
        def __init__(self, robot, scene):
            raise error("the hall is too small")

    fact = f"Hall-v0 cannot be created ({error.__name__}: the hall is too small, in {__file__} line "

    assert fact in refused(made, Strict)


def test_a_fault_of_a_simulator_in_a_constructor_is_no_mistake_of_the_configuration(made):
    """A constructor may use a connected robot, and a restarted simulator may respond."""

    class Asking(Hall):
        def __init__(self, robot, scene):
            raise SimulatorDead("collect-0", "its connections were closed")

    with pytest.raises(SimulatorDead):
        made(Asking)


@pytest.mark.parametrize(
    ("name", "fact"),
    [("Nowhere-v0", "cannot be created"), ("no_such_module:Hall-v0", "cannot be imported")],
)
def test_an_unknown_environment_is_refused(name, fact):
    """The job names an environment that is not registered, or a module that does not exist."""
    with pytest.raises(ConfigurationError, match=f"environment.id: {name} {fact}"):
        make_environment(Environment(id=name), *fake_arena())


def test_a_registration_of_nothing_is_refused(made):
    """The author may have renamed the class that the registration refers to."""
    assert "entry point palaestra_trainer.testing:Gone" in refused(made, "palaestra_trainer.testing:Gone")


def test_a_name_without_version_means_the_newest(register):
    """`gymnasium.make` also takes the newest version."""
    register(Hall)

    assert keywords(Environment(id="Hall", options={"size": 2.0})) == {"size": 2.0}


def test_gymnasium_s_own_options_are_its_own(made):
    """`max_episode_steps` is an option of gymnasium and not an argument of the class."""
    env = made(Hall, options={"max_episode_steps": 2})
    env.reset(seed=1)

    assert [env.step(0)[3] for _ in range(2)] == [False, True]


def test_a_registration_that_only_has_a_batched_form_is_refused():
    """The evaluation needs the single environment, which `vector_entry_point` alone does not create."""
    gymnasium.register(id="Hall-v0", vector_entry_point=Hall)
    try:
        with pytest.raises(ConfigurationError, match="Hall-v0 is registered without an entry_point; add one"):
            make_environment(Environment(id="Hall-v0"), *fake_arena())
    finally:
        gymnasium.registry.pop("Hall-v0")
