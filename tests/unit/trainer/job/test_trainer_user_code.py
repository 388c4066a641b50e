"""Code of the job's author, named as module:Class, is imported in one way with one form of error."""

from __future__ import annotations

import inspect
import itertools

import pytest

from palaestra_trainer.algorithms import check
from palaestra_trainer.environments.make import creator_of, keywords
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, Callback, Environment
from palaestra_trainer.job.user_code.kwargs import named, takes_any
from palaestra_trainer.run.callbacks import make_callbacks
from palaestra_trainer.simulators.robot_registry import robot_class

NUMBERS = itertools.count()
FIELDS = {
    "trainer.robot": lambda module: robot_class(f"{module}:Own"),
    "algorithm.name": lambda module: check(Algorithm(name=f"{module}:Own")),
    "algorithm.policy": lambda module: check(Algorithm(name="PPO", policy=f"{module}:Own")),
    "algorithm.hyperparameters.policy_kwargs.features_extractor_class": lambda module: check(
        Algorithm(
            name="PPO",
            hyperparameters={"policy_kwargs": {"features_extractor_class": f"{module}:Own"}},
        )
    ),
    "algorithm.callbacks[0].name": lambda module: make_callbacks([Callback(name=f"{module}:Own")]),
    "environment.id": lambda module: keywords(Environment(id=f"{module}:Own-v0")),
}
BROKEN = {
    "raise RuntimeError('no display')": "(RuntimeError: no display, in {file} line 1); correct the module",
    "class Own(": "(SyntaxError: '(' was never closed ({name}, line 1)); correct the module",
    "import sys; sys.exit('no file')": "(SystemExit: no file, in {file} line 1); correct the module",
    "import no_such_package": (
        "(ModuleNotFoundError: No module named 'no_such_package', in {file} line 1); "
        "install its package in the image, or add its folder to PYTHONPATH"
    ),
}


@pytest.fixture
def written(tmp_path, monkeypatch):
    """`written(source)` returns the name of a new importable module with this source."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(source):
        name = f"own_{tmp_path.name}_{next(NUMBERS)}".replace("-", "_")
        (tmp_path / f"{name}.py").write_text(source)
        return name

    return write


@pytest.mark.parametrize("source", BROKEN)
@pytest.mark.parametrize("field", FIELDS)
def test_a_module_that_cannot_be_imported_is_a_mistake_of_the_job(written, tmp_path, field, source):
    """A retry would fail in the same way, so any exception is a mistake of the configuration.

    The message has the field, the mistake, the line and the remedy.
    """
    module = written(source)

    with pytest.raises(ConfigurationError) as refusal:
        FIELDS[field](module)

    assert f"{field}: {module}:Own" in str(refusal.value)
    fact = BROKEN[source].format(file=tmp_path / f"{module}.py", name=f"{module}.py")
    assert f"cannot be imported {fact}" in str(refusal.value)


def test_an_entry_point_that_cannot_be_imported_is_a_mistake_of_the_job(written):
    """The entry point is imported later than the module that registers the environment."""
    part = written("raise RuntimeError('no display')")
    module = written(f"import gymnasium\ngymnasium.register(id='Late-v0', entry_point='{part}:Late')\n")

    with pytest.raises(ConfigurationError) as refusal:
        creator_of(f"{module}:Late-v0")

    assert str(refusal.value).startswith(
        f"environment.id: the entry point {part}:Late of {module}:Late-v0 cannot be imported (RuntimeError: "
    )


def test_a_name_that_the_module_lacks_is_to_be_corrected(written):
    """The module exists, so the remedy is to correct the name and not to install a package."""
    module = written("")

    with pytest.raises(ConfigurationError, match=r"has no attribute 'Own'\); correct the name$"):
        robot_class(f"{module}:Own")


def test_an_argument_may_be_given_by_name_if_python_takes_it_by_name():
    """Options of environments and callbacks are checked against these names, as hyperparameters are."""

    def made(first, /, second, *others, third=3, **rest):
        del first, second, others, third, rest

    signature = inspect.signature(made)

    assert list(named(signature)) == ["second", "third"]
    assert takes_any(signature)
    assert not takes_any(inspect.signature(lambda second: second))
