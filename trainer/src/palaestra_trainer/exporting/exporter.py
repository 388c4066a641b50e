"""Export the best policy of a run: convert it, compare the result with the policy, and write the file.

The recorded episodes of a run are exported without its policy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.exporting.metadata import data_sheet
from palaestra_trainer.exporting.policy_module import PolicyModule
from palaestra_trainer.exporting.verify import OBSERVATIONS, Run, compare
from palaestra_trainer.job.configuration import load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.policies import load_policy

PACKAGE = "package"  # a folder or a zip, in which the policy is an ONNX file
BAG = "mcap"  # the recorded episodes, without the policy
FORMATS: Mapping[str, str] = {"onnx": "onnx_file", "safetensors": "safetensors_file"}


class Format(Protocol):
    """The interface of the modules of this package that write a format."""

    def content(self, acting: PolicyModule, sheet: Mapping[str, Any]) -> bytes:
        """Return the bytes of a file."""
        ...

    def runner(self, file: bytes, acting: PolicyModule) -> Run:
        """Return a function that runs the policy in the file."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """The result of an export.

    Attributes:
        path: the file, or the folder or zip of the package, that was written.
        observations: number of observations in the comparison of the file with the policy.
        largest_difference: the largest difference between a number in an action of the file and the same
            number in the policy's action; for continuous actions, as a share of the range.
    """

    path: Path
    observations: int
    largest_difference: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedEpisodes:
    """The result of an export of recorded episodes.

    Attributes:
        path: the file that was written.
        episodes: number of episodes in the file.
        messages: number of messages in the file.
    """

    path: Path
    episodes: int
    messages: int


def export(run: Path, to: str, file: Path | None = None, results: Path | None = None) -> Exported:
    """Write the best policy of a run in the format `to`; by default to `policy.<to>` in its directory.

    A package is a folder, by default `package` in the run directory; or a zip if `file` ends in `.zip`.
    Its manifest also has the results in `results`, a file of JSON lines of `palaestra-eval`.

    Raises:
        ConfigurationError: the model or a library of the extra `export` is missing, or the place of the
            package exists and is not a package.
        ExportError: the file would act differently from the policy, so it was not written.
        OSError: the file could not be written.
    """
    known = _format(to)
    directory = RunDirectory(run)
    loaded = load_policy(run)
    acting = PolicyModule(loaded)
    configuration = load(directory.configuration)
    sheet = data_sheet(acting, configuration, directory)
    content = known.content(acting, sheet)

    def converted(module: PolicyModule) -> Run:
        file = content if module is acting else known.content(module, sheet)
        return known.runner(file, module)

    difference = compare(converted, acting, loaded)
    if to == PACKAGE:
        path = file or run / PACKAGE
        package: Any = import_module(f"{__package__}.package")  # it imports the library for ONNX
        package.write_package(path, content, loaded, configuration, directory, results)
    else:
        path = file or run / f"policy.{to}"
        replace_file(path, lambda name: name.write_bytes(content))
    return Exported(path=path, observations=OBSERVATIONS, largest_difference=difference)


def export_episodes(run: Path, file: Path | None = None) -> ExportedEpisodes:
    """Write the recorded episodes of a run as an MCAP file; by default to `episodes.mcap` in its directory.

    Raises:
        ConfigurationError: the run has no recorded episode, or a library of the extra `deploy` is missing.
        OSError: the file could not be written.
    """
    bag_file = _module("bag_file", BAG, "deploy")
    path = file or run / f"episodes.{BAG}"
    episodes, messages = bag_file.write_bag(RunDirectory(run), path)
    return ExportedEpisodes(path=path, episodes=episodes, messages=messages)


def _format(name: str) -> Format:
    module: Format = _module(FORMATS["onnx" if name == PACKAGE else name], name, "export")
    return module


def _module(module: str, to: str, extra: str) -> Any:
    """Return a module of this package, which imports libraries of an extra."""
    try:
        return import_module(f"{__package__}.{module}")
    except ImportError as error:
        raise ConfigurationError(
            f"--to {to}: cannot be written ({error}); install palaestra-trainer[{extra}]"
        ) from error
