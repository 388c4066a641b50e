"""Create the data sheet in an exported file: inputs, actions, and the run that trained the policy."""

from __future__ import annotations

from typing import Any

from palaestra_trainer.environments.data_sheet import environment_sheet
from palaestra_trainer.exporting.policy_module import Normalizer, PolicyModule
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.best_record import measured

KEY = "palaestra"  # the key of the data sheet in a file's metadata


def data_sheet(acting: PolicyModule, configuration: Configuration, directory: RunDirectory) -> dict[str, Any]:
    """Return the data sheet of a run's best policy, as JSON data."""
    result = measured(directory)
    environment = configuration.environment
    return {
        "format": 1,
        "environment": environment.model_dump(mode="json", exclude_none=True),
        "algorithm": configuration.algorithm.name,
        "seed": configuration.seed,
        "steps": result.get("step"),
        "success_rate": result.get("success_rate"),
        "success_interval": result.get("success_interval"),
        "inputs": acting.inputs,
        "outputs": acting.outputs,
        "normalized": {
            name: {"clip": known.clip, "epsilon": known.epsilon}
            for name, known in zip(acting.spaces, acting.normalizers, strict=True)
            if isinstance(known, Normalizer)
        },
        "choices": acting.choices or None,
        "state_shape": acting.state_shape,
        **environment_sheet(acting.spaces, acting.action_space, environment),
    }
