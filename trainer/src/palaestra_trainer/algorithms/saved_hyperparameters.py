"""The hyperparameters that a run began with; the run keeps them even if the defaults change later.

All of them are in a file of the run directory. Releases up to a5276f3 did not write it. Their runs continue
with the values that these releases used for every environment: the arena's, and MlpPolicy even for images.
"""

from __future__ import annotations

import json

from palaestra_trainer.algorithms.make_model import resolve, with_defaults
from palaestra_trainer.algorithms.registry import entry_of
from palaestra_trainer.configuration import Algorithm, Configuration
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run_directory import RunDirectory, replace_file


def begin_with(
    configuration: Configuration, directory: RunDirectory, before: RunDirectory | None
) -> Algorithm:
    """Return the algorithm of an attempt with all its hyperparameters.

    Args:
        configuration: the configuration of the run.
        directory: the directory of the run, which may not have begun.
        before: the run whose checkpoint it resumes from, itself or another; None: it begins without one.

    Raises:
        ConfigurationError: the file in the run directory cannot be read.
    """
    if directory.hyperparameters.exists() or not (before or directory.attempts.exists()):
        return _kept(configuration, directory) or resolve(
            configuration.algorithm, configuration.environment.id
        )
    return begun_with(configuration, before or directory)


def begun_with(configuration: Configuration, directory: RunDirectory) -> Algorithm:
    """Return the algorithm of a run that has begun.

    Raises:
        ConfigurationError: the file in the run directory cannot be read.
    """
    algorithm = configuration.algorithm
    before = {**entry_of(algorithm.name).arena, "policy": "MlpPolicy"}
    return _kept(configuration, directory) or with_defaults(algorithm, before)


def keep(algorithm: Algorithm, directory: RunDirectory) -> None:
    """Write the algorithm with which a run begins into its directory, unless the run has begun.

    Raises:
        OSError: the file could not be written.
    """
    if directory.hyperparameters.exists() or directory.attempts.exists():
        return
    text = json.dumps(algorithm.hyperparameters, indent=2) + "\n"
    replace_file(directory.hyperparameters, lambda path: path.write_text(text, encoding="utf-8"))


def _kept(configuration: Configuration, directory: RunDirectory) -> Algorithm | None:
    path = directory.hyperparameters
    try:
        hyperparameters = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            f"{path}: cannot be read ({error}); restore it, or use another run directory"
        ) from error
    return configuration.algorithm.model_copy(update={"hyperparameters": hyperparameters})
