"""Save the hyperparameters with which a run begins, so later changes of defaults do not affect it.

A file in the run directory holds these hyperparameters, including the defaults.
"""

from __future__ import annotations

import json

from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.algorithms.make_model import resolve
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, Configuration
from palaestra_trainer.job.run_directory import RunDirectory


def begin_with(
    configuration: Configuration, directory: RunDirectory, before: RunDirectory | None
) -> Algorithm:
    """Return the algorithm of an attempt with all its hyperparameters.

    Args:
        configuration: the configuration of the run.
        directory: the directory of the run; the run may not have begun yet.
        before: the directory of the run from whose checkpoint the attempt resumes, which may be this run or
            another run; None: the attempt does not resume.

    Raises:
        ConfigurationError: the file in the run directory cannot be read.
    """
    return _kept(configuration, directory) or begun_with(configuration, before or directory)


def begun_with(configuration: Configuration, directory: RunDirectory) -> Algorithm:
    """Return the algorithm of the run in `directory` with all its hyperparameters.

    Raises:
        ConfigurationError: the file in the run directory cannot be read.
    """
    return _kept(configuration, directory) or resolve(configuration.algorithm, configuration.environment.id)


def keep(algorithm: Algorithm, directory: RunDirectory) -> None:
    """Write the hyperparameters with which a run begins into its directory, unless the run has begun.

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
