"""The hyperparameters of a run that its job does not set."""

from __future__ import annotations

import inspect
import json
import os
import signal
import zipfile

import pytest
import stable_baselines3 as sb3

from palaestra_trainer.algorithms import ALGORITHMS
from palaestra_trainer.algorithms.make_model import resolve
from palaestra_trainer.episodes.seeds import EVALUATE
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.evaluate import measure

SB3 = {"DQN": sb3.DQN, "SAC": sb3.SAC, "PPO": sb3.PPO, "A2C": sb3.A2C}
ARENA = "MoveToTargetEnv-v0"


@pytest.fixture
def interrupted(play, job):
    """Interrupt a run of DQN whose job sets no discount, and return the run's configuration."""
    calls = iter(range(1, 10_000))

    def interrupt():
        if next(calls) == 60:
            os.kill(os.getpid(), signal.SIGTERM)

    configuration = job("DQN")
    assert play(configuration, on_step=interrupt)[0] == 75
    return configuration


def discount(directory):
    """Return the discount that the model in the newest checkpoint has."""
    with zipfile.ZipFile(checkpoint.newest(directory.checkpoints).path / "model.zip") as archive:
        return json.loads(archive.read("data"))["gamma"]


@pytest.mark.parametrize("name", sorted(SB3))
def test_an_own_environment_has_the_defaults_of_stable_baselines3(name):
    """The defaults for the arena were tuned in the arena, so other environments do not get them."""
    theirs = inspect.signature(SB3[name].__init__).parameters

    resolved = resolve(Algorithm(name=name), "hall:Hall-v0").hyperparameters

    assert resolved == {hyperparameter: theirs[hyperparameter].default for hyperparameter in resolved}
    assert {"learning_rate", "gamma", "policy_kwargs"} <= resolved.keys()


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
@pytest.mark.parametrize("environment", [ARENA, f"palaestra_trainer.environments:{ARENA}"])
def test_the_arena_keeps_its_own_defaults(name, environment):
    """A job may write the id of the arena with or without the package, and must get the same defaults."""
    resolved = resolve(Algorithm(name=name), environment).hyperparameters

    assert resolved.items() >= ALGORITHMS[name].arena.items()
    assert not ALGORITHMS[name].arena or resolved["gamma"] < 0.98


def test_what_a_job_gives_precedes_every_default():
    """A person sets only the hyperparameters that differ, and the others keep their defaults."""
    given = Algorithm(name="DQN", hyperparameters={"gamma": 0.5})

    resolved = resolve(given, ARENA).hyperparameters

    assert (resolved["gamma"], resolved["learning_rate"]) == (0.5, "lin_5e-4")


def test_a_run_goes_on_with_the_hyperparameters_it_began_with(interrupted, play, directory):
    """A later release may have another default of the discount, but a run keeps the first one."""
    kept = json.loads(directory.hyperparameters.read_text())
    assert kept["gamma"] == discount(directory) == 0.99
    directory.hyperparameters.write_text(json.dumps(kept | {"gamma": 0.5}))

    code, _ = play(interrupted)

    assert (code, discount(directory)) == (0, 0.5)
    assert json.loads(directory.hyperparameters.read_text())["gamma"] == 0.5


@pytest.mark.usefixtures("interrupted")
def test_a_run_that_prolongs_another_has_its_hyperparameters(play, job, directory, tmp_path):
    """The new run stores the hyperparameters too, because the old run may be deleted before a resume."""
    kept = json.loads(directory.hyperparameters.read_text())
    directory.hyperparameters.write_text(json.dumps(kept | {"gamma": 0.5}))
    further = RunDirectory(tmp_path / "further")

    play(job("DQN", steps=120, resumeFrom=str(directory.path)), into=further)

    assert discount(further) == 0.5
    assert json.loads(further.hyperparameters.read_text())["gamma"] == 0.5


def test_a_run_whose_hyperparameters_cannot_be_read_is_refused(interrupted, play, directory, last_word):
    """With the defaults of today, the run would continue with other hyperparameters."""
    directory.hyperparameters.write_text("{")

    code, _ = play(interrupted)

    assert code == 2
    assert "hyperparameters.json: cannot be read" in last_word().reason


def test_a_policy_is_measured_with_the_hyperparameters_of_its_run(play, job, directory):
    """The hyperparameters decide the shape of the network, so with others the policy could not be loaded."""
    hyperparameters = {"learning_starts": 10, "batch_size": 8, "buffer_size": 500}
    configuration = job("DQN", algorithm={"name": "DQN", "hyperparameters": hyperparameters})
    _, members = play(configuration)

    measured = measure(
        configuration, directory.model, lambda _: [members["evaluate-0"]], episodes=2, stream=EVALUATE
    )

    assert measured["episodes"] == 2
