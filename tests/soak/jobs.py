"""The TrainingJobs of the proof: small ones, whose simulators may break as often as they like."""

import copy

import yaml

from tests.local_run import EXAMPLES

# The most that a job can say: a proof is about what a fault costs, not about the budget.
ANY_NUMBER = {"limit": 1000, "withinSeconds": 600}

LITTLE_DQN = {
    "name": "DQN",
    "hyperparameters": {
        "buffer_size": 2000,
        "learning_starts": 40,
        "batch_size": 32,
        "policy_kwargs": {"net_arch": [32]},
    },
}
LITTLE_PPO = {
    "name": "PPO",
    "hyperparameters": {
        "n_steps": 32,
        "batch_size": 32,
        "n_epochs": 2,
        "policy_kwargs": {"net_arch": [32]},
    },
}


def example(name):
    """Return a TrainingJob of manifests/examples."""
    return yaml.safe_load((EXAMPLES / f"{name}.yaml").read_text())


def make_job(*, collect=None, evaluate=None, faults="", seed=1, **trainer):
    """Return manifests/examples/tiny.yaml with other fields.

    Args:
        collect: fields of the group of simulators that collects.
        evaluate: fields of the group that evaluates; leave it out with `evaluation.everySteps` 0.
        faults: what all simulators do wrong, as PALAESTRA_STUB_FAULTS has it.
        seed: of the job.
        trainer: fields of the trainer.
    """
    job = example("tiny")
    spec = job["spec"]
    spec["seed"] = seed
    spec["trainer"] |= copy.deepcopy(trainer)
    groups = {"collect": collect or {}, "evaluate": evaluate or {}}
    for group in spec["simulators"]:
        group.update({"restart": ANY_NUMBER} | groups[group["name"]])
        if faults:
            group["env"] = [{"name": "PALAESTRA_STUB_FAULTS", "value": faults}]
    if not spec["trainer"]["evaluation"]["everySteps"]:
        spec["simulators"] = [group for group in spec["simulators"] if group["role"] == "Collect"]
    return job
