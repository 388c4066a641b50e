"""Begin a run with the policy of another run: load its tensors, and the statistics of its normalizer.

The file is the zip of any model of Stable-Baselines3, or a policy package as a zip. This module does not
unpickle, so the file may come from an untrusted source. The run has new optimizers, and all its
counts start at 0.
"""

from __future__ import annotations

import io
import json
import pickle
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import structlog
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_protocol.policy_package import MODEL, PackageError, is_package, read_files
from palaestra_trainer.algorithms.normalization import normalizer_of
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run.checkpoint.tensors import NORMALIZE

log = structlog.get_logger(__name__)

POLICY = "policy.pth"
_SHOWN = 3  # number of mismatches in a message
_OVERHEAD_BYTES = 1 << 20  # bytes for names, statistics, and the overhead of PyTorch's format


def begin_from(path: Path, model: BaseAlgorithm) -> None:
    """Load the policy of a zip into a new model; load its statistics too if both models normalize.

    Raises:
        ConfigurationError: the file cannot be read, or a tensor or statistic does not match this model.
    """
    own = model.policy.state_dict()
    tensors, known = _read(path, model.device, _most_bytes(own))
    if mistakes := list(_mistakes(tensors, own)):
        more = f", and {len(mistakes) - _SHOWN} more" if len(mistakes) > _SHOWN else ""
        facts = "; ".join(mistakes[:_SHOWN]) + more
        raise _refused(path, f"{facts}; use the algorithm, policy and spaces that it was trained with")
    model.policy.load_state_dict(tensors)
    taken = _take_statistics(path, model, known)
    log.info("begins from a policy", file=str(path), tensors=len(own), statistics=taken)


def _most_bytes(own: Mapping[str, torch.Tensor]) -> int:
    """Return an upper limit for the bytes of these tensors in a file, even with twice their precision."""
    return 2 * sum(tensor.nbytes for tensor in own.values()) + _OVERHEAD_BYTES


def _read(path: Path, device: torch.device, most: int) -> tuple[Any, dict[str, Any]]:
    """Return the tensors and the statistics in a zip; refuse more than `most` bytes in total."""
    try:
        with _model(path) as file, zipfile.ZipFile(file) as archive:
            statistics = [NORMALIZE] if NORMALIZE in archive.namelist() else []
            _refuse_larger(path, map(archive.getinfo, [POLICY, *statistics]), most)
            content = io.BytesIO(archive.read(POLICY))
            known = json.loads(archive.read(NORMALIZE)) if statistics else {}
        if zipfile.is_zipfile(content):  # PyTorch's format is a zip too, and its members may be compressed
            with zipfile.ZipFile(content) as inner:
                _refuse_larger(path, inner.infolist(), most)
        content.seek(0)
        return torch.load(content, map_location=device, weights_only=True), known
    except ConfigurationError:
        raise
    except pickle.UnpicklingError as error:  # omit PyTorch's message, which recommends to unpickle the file
        raise _refused(
            path,
            f"{POLICY} has objects other than tensors, which are never unpickled, or is damaged; "
            "name another model.zip",
        ) from error
    except (OSError, KeyError, EOFError, RuntimeError, ValueError, zipfile.BadZipFile) as error:
        fact = f"cannot be read as a model of Stable-Baselines3 ({error}); name a model.zip"
        raise _refused(path, fact) from error


def _model(path: Path) -> BinaryIO:
    """Open the model: the file itself, or the model in a package, after a check of the whole package."""
    if not is_package(path):
        return path.open("rb")
    try:
        return io.BytesIO(read_files(path, MODEL)[1][MODEL])
    except PackageError as error:
        raise ConfigurationError(f"initialPolicy: {error}") from error


def _refuse_larger(path: Path, members: Iterable[zipfile.ZipInfo], most: int) -> None:
    """Refuse members of a zip that would unpack to more bytes than this run's policy can need."""
    unpacked = sum(each.file_size for each in members)
    if unpacked > most:
        raise _refused(
            path,
            f"unpacks to {unpacked} bytes, but the policy of this run has at most {most} bytes; use the "
            "algorithm, policy and spaces that it was trained with",
        )


def _mistakes(tensors: Any, own: Mapping[str, torch.Tensor]) -> Iterator[str]:
    if not isinstance(tensors, Mapping):
        yield f"{POLICY} has no tensors with names"
        return
    for name, tensor in own.items():
        there = tensors.get(name)
        if not isinstance(there, torch.Tensor):
            yield f"the tensor {name}, {_shape(tensor)} in this run, is missing"
        elif there.shape != tensor.shape:
            yield f"the tensor {name} is {_shape(there)}, and {_shape(tensor)} in this run"
        elif there.layout != tensor.layout or there.is_complex() != tensor.is_complex():
            yield f"the tensor {name} is {_kind(there)}, and {_kind(tensor)} in this run"
        elif not bool(torch.isfinite(there).all()):
            yield f"the tensor {name} has numbers that are not finite"
    for name in tensors.keys() - own.keys():
        yield f"the tensor {name} is unknown in this run"


def _take_statistics(path: Path, model: BaseAlgorithm, known: Mapping[str, Any]) -> list[str]:
    normalizer = normalizer_of(model)
    own = {} if normalizer is None else normalizer.scales
    if own.keys() - {"rewards"} != known.keys() - {"rewards", "epsilon"}:
        log.warning(
            "the initial policy and this run normalize different observations, so the policy gets "
            "different values from those it was trained with; set algorithm.normalize as in its run",
            file=str(path),
        )
    if normalizer is None:
        return []
    shared = sorted(own.keys() & known.keys())
    try:
        normalizer.take_over({name: known[name] for name in shared})
    except (KeyError, TypeError, ValueError) as error:
        raise _refused(
            path, f"{NORMALIZE} does not fit this run ({error}); use the environment it was trained with"
        ) from error
    return shared


def _shape(tensor: torch.Tensor) -> str:
    return str(tuple(tensor.shape))


def _kind(tensor: torch.Tensor) -> str:
    return f"{tensor.layout} of {tensor.dtype}".replace("torch.", "")


def _refused(path: Path, fact: str) -> ConfigurationError:
    return ConfigurationError(f"initialPolicy: {path}: {fact}")
