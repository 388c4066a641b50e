"""Save a model's tensors in a zip of Stable-Baselines3, and load them without unpickling.

If a model normalizes, the zip has one more member: the statistics of observations and rewards, as JSON. So
the policy needs no other file. Stable-Baselines3 ignores this member when it reads the zip.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file, recursive_getattr, recursive_setattr

from palaestra_trainer.algorithms.normalization import normalizer_of
from palaestra_trainer.errors import ConfigurationError

NORMALIZE = "normalize.json"


@dataclass(frozen=True, slots=True)
class Tensors:
    """A copy of all tensors that an update changes; it serves to undo an interrupted update.

    Attributes:
        parameters: tensors of networks and optimizers, by their names in Stable-Baselines3.
        variables: other learned tensors.
    """

    parameters: dict[str, Any]
    variables: dict[str, torch.Tensor]

    @classmethod
    def of(cls, model: BaseAlgorithm) -> Self:
        """Return a copy of a model's tensors."""
        _, names = model._get_torch_save_params()
        variables = {name: recursive_getattr(model, name).detach().clone() for name in names}
        return cls(deepcopy(model.get_parameters()), variables)

    def put_back(self, model: BaseAlgorithm) -> None:
        """Set the model's tensors to the values of this copy."""
        model.set_parameters(self.parameters, exact_match=True, device=model.device)
        _set_variables(model, self.variables)


def save_tensors(path: Path, model: BaseAlgorithm) -> None:
    """Write the zip of a model; include the statistics that its policy needs.

    Raises:
        OSError: the file could not be written.
    """
    model.save(path)
    if normalizer := normalizer_of(model):
        with zipfile.ZipFile(path, "a") as archive:
            archive.writestr(NORMALIZE, json.dumps(normalizer.to_json()))


def load_tensors(path: Path, model: BaseAlgorithm) -> None:
    """Load the file that `save_tensors` wrote into `model`, without unpickling.

    Raises:
        ConfigurationError: the file is of a different model, or of a model with other normalization.
    """
    try:
        _, parameters, variables = load_from_zip_file(path, device=model.device, load_data=False)
        model.set_parameters(parameters, exact_match=True, device=model.device)
        _load_normalization(path, model)
    except (AttributeError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise ConfigurationError(
            f"{path}: does not fit {type(model).__name__} as configured ({error}); "
            "use the configuration it was trained with"
        ) from error
    _set_variables(model, variables or {})


def digest_of_policy(model: BaseAlgorithm) -> str:
    """Return the sha256 of a policy's tensors, as text, including the statistics of its normalization.

    A policy that was saved and loaded, or resumed from a checkpoint, has the digest that it had before.
    """
    digest = hashlib.sha256()
    for name, value in sorted(model.policy.state_dict().items()):
        if isinstance(value, torch.Tensor):
            content = value.detach().cpu()
            digest.update(f"{name} {content.dtype} {tuple(content.shape)}\n".encode())
            digest.update(content.reshape(-1).view(torch.uint8).numpy().tobytes())
    if normalizer := normalizer_of(model):
        digest.update(json.dumps(normalizer.to_json(), sort_keys=True).encode())
    return digest.hexdigest()


def _set_variables(model: BaseAlgorithm, variables: Mapping[str, torch.Tensor | None]) -> None:
    for name, value in variables.items():
        if value is not None:
            recursive_setattr(model, f"{name}.data", value.data)


def _load_normalization(path: Path, model: BaseAlgorithm) -> None:
    normalizer = normalizer_of(model)
    with zipfile.ZipFile(path) as archive:
        known = NORMALIZE in archive.namelist()
        if known != (normalizer is not None):
            raise ValueError(f"algorithm.normalize is {'not ' if known else ''}set, unlike in the checkpoint")
        if normalizer:
            normalizer.learn_from_json(json.loads(archive.read(NORMALIZE)))
