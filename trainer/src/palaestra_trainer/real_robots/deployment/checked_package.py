"""Read a policy package for a deployment, and refuse a package that cannot drive the robot."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import gymnasium
import yaml

from palaestra_protocol.policy_package import MANIFEST, NETWORK, TRAINING, PackageError, read_files
from palaestra_trainer.environments.data_sheet import environment_sheet, parts_of
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Environment, parse
from palaestra_trainer.real_robots.deployment.onnx_policy import OnnxPolicy

ROBOT: Final = "Robotino"
_PERIODS_S: Final = (0.02, 2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedPackage:
    """A package that can drive a Robotino.

    Attributes:
        policy: its policy.
        environment: the environment in which the policy learned.
        period_s: seconds between two actions.
        manifest: the manifest, as data.
    """

    policy: OnnxPolicy
    environment: Environment
    period_s: float
    manifest: dict[str, Any]

    @property
    def image_size(self) -> tuple[int, int] | None:
        """Width and height of the images that the policy sees; None if it sees none."""
        for space in self._spaces():
            match space:
                case {"dtype": "uint8", "shape": [int(height), int(width), int()]}:
                    return width, height
        return None

    def _spaces(self) -> list[Any]:
        match self.manifest.get("policy"):
            case {"observations": {"spaces": dict(spaces)}}:
                return list(spaces.values())
        return []

    def refuse_other(self, env: gymnasium.Env[Any, Any]) -> None:
        """Refuse an environment whose numbers differ from those that the policy learned with.

        Another release, or another version of a user's module, may order or scale the numbers in another way.

        Raises:
            ConfigurationError: a space or a table of the data sheet differs.
        """
        made = environment_sheet(parts_of(env.observation_space), env.action_space, self.environment)
        sheet = self.manifest.get("policy") or {}
        for part, found in json.loads(json.dumps(made)).items():
            if sheet.get(part) != found:
                raise ConfigurationError(
                    f"{self.environment.id}: its {part} differ from those that the policy learned with; "
                    "deploy with the release and the modules of the training, or train and export again"
                )


def read(place: Path) -> CheckedPackage:
    """Return the package in a folder or a zip, after a check of every file.

    Raises:
        ConfigurationError: a file is missing or has changed, the policy drives another robot, or its rate
            is unknown.
    """
    try:
        manifest, contents = read_files(place, NETWORK, TRAINING)
    except PackageError as error:
        raise ConfigurationError(str(error)) from error
    match manifest.get("robot"):
        case {"class": str(name), "period_s": float() | int() as period_s}:
            pass
        case other:
            raise ConfigurationError(f"{place / MANIFEST}: robot: {other!r} names no class and period_s")
    if name != ROBOT:
        raise ConfigurationError(f"{place}: the policy drives a {name}; only a {ROBOT} can be deployed to")
    if not _PERIODS_S[0] <= period_s <= _PERIODS_S[1]:
        raise ConfigurationError(
            f"{place}: the policy acts every {period_s:g} s, but a robot is driven with"
            f" {_PERIODS_S[0]} to {_PERIODS_S[1]} s; train one with another rate"
        )
    return CheckedPackage(
        policy=OnnxPolicy(contents[NETWORK], place / NETWORK, manifest.get("policy") or {}),
        environment=_environment(contents[TRAINING], place / TRAINING),
        period_s=float(period_s),
        manifest=manifest,
    )


def _environment(text: bytes, file: Path) -> Environment:
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{file}: is not YAML: {error}") from error
    return parse(content, source=TRAINING).environment
