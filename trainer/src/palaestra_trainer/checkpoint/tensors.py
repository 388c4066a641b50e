"""A model's tensors, in the zip of Stable-Baselines3, of which nothing is unpickled."""

from __future__ import annotations

from pathlib import Path

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr

from palaestra_trainer.errors import ConfigurationError


def load_tensors(path: Path, model: BaseAlgorithm) -> None:
    """Put the tensors of a Stable-Baselines3 zip into `model`; nothing is unpickled.

    Raises:
        ConfigurationError: they are of another kind of model.
    """
    try:
        _, parameters, variables = load_from_zip_file(path, device=model.device, load_data=False)
        model.set_parameters(parameters, exact_match=True, device=model.device)
    except (AttributeError, RuntimeError, ValueError) as error:
        raise ConfigurationError(
            f"{path}: does not fit {type(model).__name__} as configured ({error}); "
            "use the configuration it was trained with"
        ) from error
    for name, value in (variables or {}).items():
        if value is not None:
            recursive_setattr(model, f"{name}.data", value.data)
