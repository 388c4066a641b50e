"""A run that is interrupted at any step and resumed has the same results as an uninterrupted run, bit by bit.

The compared results are the networks of the last checkpoint and of the best policy, the evaluations, and all
counted episodes. Equal results need a deterministic simulator, such as the stub.
"""

import io
import itertools
import json
import random
import signal
import tempfile
import zipfile
from pathlib import Path

import torch

from tests.local_run import LocalRun, running, send
from tests.soak.jobs import tiny_job

SEED = 11
POINTS = 3
STEPS = 1200
SMALL = {"net_arch": [16]}
REPLAYING = {"buffer_size": 500, "learning_starts": 100, "batch_size": 32, "policy_kwargs": SMALL}
ALGORITHMS = {
    "DQN": REPLAYING,
    "SAC": REPLAYING,
    "PPO": {"n_steps": 64, "batch_size": 32, "n_epochs": 2, "policy_kwargs": SMALL},
    "A2C": {"n_steps": 5, "policy_kwargs": SMALL},
    "REINFORCE": {"episodes_per_update": 2, "policy_kwargs": SMALL},
    "TD3": REPLAYING | {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.1},
    "DDPG": REPLAYING | {"noise_type": "normal", "noise_std": 0.1},
    "QRDQN": REPLAYING | {"tau": 0.5, "target_update_interval": 10},
    "TQC": REPLAYING,
    "CrossQ": REPLAYING,
    "TRPO": {"n_steps": 64, "batch_size": 32, "policy_kwargs": SMALL},
    "RecurrentPPO": {
        "n_steps": 64,
        "batch_size": 32,
        "n_epochs": 2,
        "policy_kwargs": SMALL | {"lstm_hidden_size": 16},
    },
}
CONTINUOUS = ("SAC", "TD3", "DDPG", "TQC", "CrossQ")
COLLECTORS = (1, 2)
AMID = (100, STEPS - 200)
LONGEST_S = 600.0
ASKED, KILLED = WAYS = ("asked to end", "killed")


def measure(scale):
    """Return how many interrupted runs have the uninterrupted run's results, and the other runs."""
    points = max(round(POINTS * scale), 1)
    moments = random.Random(SEED)
    compared = [
        (f"{name} x{collectors} at {step}", difference(name, collectors, wanted, step, way))
        for name in ALGORITHMS
        for collectors in COLLECTORS[: max(round(len(COLLECTORS) * scale), 1)]
        for wanted in [uninterrupted(name, collectors)]
        for step, way in zip(moments.sample(range(*AMID), points), itertools.cycle(WAYS), strict=False)
    ]
    different = [f"{run}: {found}" for run, found in compared if found]
    return {
        "runs": len(compared),
        "different": different,
        "claims": {"all interrupted runs ended as if they had not been": not different},
    }


def uninterrupted(name, collectors):
    """Return the results of an uninterrupted run."""
    with running(job(name, collectors)) as run:
        run.end(LONGEST_S)
        return results(run.directory)


def difference(name, collectors, wanted, step, way):
    """Return the results in which a run that was interrupted after a step differs, or ""."""
    with tempfile.TemporaryDirectory() as folder:
        run = LocalRun(Path(folder), job(name, collectors))
        interrupt(run, step, way)
        with run:
            run.end(LONGEST_S)
        found = results(run.directory)
    different = [what for what in wanted if found[what] != wanted[what]]
    return f"{way} is different in {', '.join(different)}" if different else ""


def interrupt(run, step, way):
    """Start a run, and end it after a step: by an interrupt like Ctrl-C, or by SIGKILL."""
    with run:
        run.wait_for_step(step, LONGEST_S)
        if way == KILLED:
            send(run.trainer(), signal.SIGKILL)


def job(name, collectors):
    """Return a job that evaluates and saves a few times."""
    continuous = {"options": {"max_steps": 50, "actions": "continuous" if name in CONTINUOUS else "discrete"}}
    return tiny_job(
        collect={"count": collectors},
        environment={"id": "MoveToTargetEnv-v0"} | continuous,
        algorithm={"name": name, "hyperparameters": ALGORITHMS[name]},
        steps=STEPS,
        evaluation={"everySteps": 300, "episodes": 3, "confirmEpisodes": 3},
        checkpoint={"everySteps": 150, "keep": 3},
    )


def results(directory):
    """Return the results of a run that must be equal after an interruption; they contain no times."""
    last = max((directory / "checkpoints").glob("[0-9]*"), key=lambda path: int(path.name))
    state = json.loads((last / "state.json").read_text())
    return {
        "steps": last.name,
        "parameters": tensors(last / "model.zip"),
        "best policy": tensors(directory / "model.zip"),
        "evaluations": (directory / "evaluations.jsonl").read_text(),
        "episodes": [(episode["r"], episode["l"]) for episode in state["episodes"]],
        "generators": state["generators"],
        "experience": [it.read_bytes() for it in sorted(last.glob("experience/*"))],
    }


def tensors(path):
    """Return the bytes of every tensor in a Stable-Baselines3 zip, by name."""
    with zipfile.ZipFile(path) as file:
        parts = {name: file.read(name) for name in file.namelist() if name.endswith(".pth")}
    return {
        f"{part} {name}": tensor.detach().numpy().tobytes()
        for part, content in parts.items()
        for name, tensor in flat(torch.load(io.BytesIO(content), weights_only=True))
    }


def flat(value, path=""):
    """Yield the tensors in nested dictionaries and lists with their paths."""
    if isinstance(value, torch.Tensor):
        yield path, value
    elif isinstance(value, dict | list):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in entries:
            yield from flat(entry, f"{path}.{key}")
