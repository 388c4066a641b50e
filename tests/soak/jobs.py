"""The small TrainingJobs of `make soak`; their simulators may fail any number of times."""

import copy

from tests.jobs import example

# This is the largest limit that a job can have, because these tests measure faults and not the budget.
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


def tiny_job(*, collect=None, evaluate=None, faults="", seed=1, **trainer):
    """Return manifests/examples/tiny.yaml with other fields.

    Args:
        collect: fields of the group of simulators that collects.
        evaluate: fields of the group that evaluates; with `evaluation.everySteps` 0, this group is removed.
        faults: the faults of all simulators, in the syntax of PALAESTRA_STUB_FAULTS.
        seed: the seed of the job.
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
