"""Write a policy package: the exported network, the model to train on, the job, and a manifest of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from palaestra_protocol.package_archive import archived
from palaestra_protocol.policy_package import (
    MANIFEST,
    MODEL,
    NETWORK,
    TRAINING,
    is_package,
    manifest_text,
)
from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.exporting.measurements import own_result, results_of
from palaestra_trainer.exporting.onnx_file import sheet_of
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run.policies import TrainedPolicy

JOB = "job.yaml"  # the TrainingJob; only a run of `palaestra run` has this file
_OURS = frozenset({NETWORK, MODEL, JOB, TRAINING, MANIFEST})
_MS = 1000.0
_ZIP = ".zip"


def write_package(
    place: Path,
    network: bytes,
    policy: TrainedPolicy,
    configuration: Configuration,
    run: RunDirectory,
    results: Path | None = None,
) -> None:
    """Write a package, or replace an older package.

    Args:
        place: the folder of the package; or its zip, if the name ends in `.zip`.
        network: the exported policy, as the content of an ONNX file with its data sheet.
        policy: the exported policy.
        configuration: the configuration of the run.
        run: the run directory.
        results: a file with further results of the policy, as `palaestra-eval --json` prints them.

    Raises:
        ConfigurationError: the place is not a package, the robot's class is unknown, or a result belongs to
            another policy.
        OSError: a file cannot be read or written.
    """
    files = {NETWORK: network, MODEL: run.model.read_bytes(), TRAINING: run.configuration.read_bytes()}
    if (job := run.path / JOB).is_file():
        files[JOB] = job.read_bytes()
    description = _description(sheet_of(network), policy, configuration, run)
    if results is not None:
        description["evaluated"] += results_of(results, run.model)
    files[MANIFEST] = manifest_text(description, files)
    if place.suffix == _ZIP:
        _write_zip(place, files)
    else:
        _write_folder(place, files)


def _write_zip(path: Path, files: Mapping[str, bytes]) -> None:
    if path.exists() and not is_package(path):
        raise ConfigurationError(f"{path}: exists and is not a package; choose another file with --output")
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, partial(_write, archived(files)))


def _write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write the files, the manifest last.

    Until then, a reader refuses the folder, because the checksums in the older manifest do not match.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if others := sorted({path.name for path in folder.iterdir()} - _OURS):
        raise ConfigurationError(
            f"{folder}: contains {others[0]}, which no package has; name a new folder with --output"
        )
    for name, content in files.items():
        replace_file(folder / name, partial(_write, content))
    for name in _OURS - files.keys():
        (folder / name).unlink(missing_ok=True)


def _write(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def _description(
    sheet: Mapping[str, Any], policy: TrainedPolicy, configuration: Configuration, run: RunDirectory
) -> dict[str, Any]:
    """Return the fields of the manifest, except those about its files."""
    robot = policy.robot_class
    attempts = list(read_lines(run.attempts))
    return {
        "palaestra": version("palaestra-trainer"),
        "commit": _commits(attempts),
        "versions": attempts[-1].get("versions", {}) if attempts else {},
        "job": configuration.job,
        "replica": configuration.replica,
        "robot": {"class": policy.robot, "definition": robot.definition, "period_s": robot.period_ms / _MS},
        "policy": dict(sheet),
        "evaluated": own_result(configuration, run),
        "reproduce": f"palaestra run {JOB}" if (run.path / JOB).is_file() else None,
    }


def _commits(attempts: Sequence[Mapping[str, Any]]) -> list[Any]:
    """Return the states of the job's own code, each once, in the order of the attempts."""
    found: list[Any] = []
    for source in (attempt.get("source") for attempt in attempts):
        if source is not None and source not in found:
            found.append(source)
    return found
