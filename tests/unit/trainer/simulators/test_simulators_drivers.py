"""The simulator of a run is replaced by another simulator program."""

from __future__ import annotations

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.simulators.drivers import in_driver


def simulator(**changes):
    """Return a simulator of a run."""
    fields = {"name": "e-0", "group": "e", "index": 0, "role": "Evaluate", "options": ("--seed=1",)}
    return SimulatorConfiguration(**(fields | {"world": "/run/worlds/e.wbt", "driver": "stub"} | changes))


@pytest.mark.parametrize(
    ("driver", "into", "kept"), [("stub", "mujoco", True), ("stub", "stub", True), ("webots", "stub", False)]
)
def test_options_are_kept_where_the_other_program_has_them(driver, into, kept):
    """The stub and MuJoCo have the same options; Webots has other options."""
    made = in_driver(simulator(driver=driver), into)

    assert made.driver == into
    assert made.options == (("--seed=1",) if kept else ())


def test_a_model_of_mujoco_is_refused_by_name_before_anything_starts():
    """The stub would report a syntax error in the first line of the model."""
    with pytest.raises(ConfigurationError, match=r"--in stub: arm.xml is a model of MuJoCo.*use --in mujoco"):
        in_driver(simulator(world="/run/worlds/arm.xml", driver="mujoco"), "stub")


def test_a_program_that_is_not_installed_is_named(monkeypatch):
    """Without the check, the simulator would be restarted until its budget is spent."""
    monkeypatch.setenv("PATH", "")

    with pytest.raises(ConfigurationError, match="--in webots: webots is not a program on this machine"):
        in_driver(simulator(), "webots")
