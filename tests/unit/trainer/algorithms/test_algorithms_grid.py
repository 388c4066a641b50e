"""Each algorithm trains despite faults with each pair of spaces that it supports, and resumes exactly."""

from __future__ import annotations

import io
import json
import os
import signal
import threading
import zipfile

import numpy as np
import pytest
import torch

from palaestra.api.fields import ALGORITHMS as NAMES
from palaestra_trainer import load_policy
from palaestra_trainer.algorithms import ALGORITHMS
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run import attempt, checkpoint
from palaestra_trainer.testing import FakeTask, MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS
from tools.algorithms import refusal

pytestmark = pytest.mark.minutes(3)

COLLECTORS = 2
PATIENCE_S = 30.0
STEPS = 26  # on-policy algorithms make three rollouts
# At this step of the first of two simulators, on-policy algorithms are in their second rollout. Off-policy
# algorithms have begun to learn.
SIGNAL_AT = 7
OFF_POLICY = {
    "learning_starts": 6,
    "batch_size": 8,
    "buffer_size": 40,
    "train_freq": 3,
    "gradient_steps": 1,
}
# A soft update of the target comes between the end of the rollout and the signal, so a repeated update would
# be noticed.
SOFT = {"target_update_interval": 4, "tau": 0.5}
NOISE = {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.2}
ON_POLICY = {"n_steps": 4, "batch_size": 8}
SMALL = {"net_arch": [8]}
HYPERPARAMETERS = {
    "DQN": OFF_POLICY | SOFT,
    "QRDQN": OFF_POLICY | SOFT,
    "SAC": OFF_POLICY,
    "TD3": OFF_POLICY | NOISE,
    "DDPG": OFF_POLICY | NOISE,
    "TQC": OFF_POLICY,
    "CrossQ": OFF_POLICY,
    "PPO": ON_POLICY | {"n_epochs": 2},
    "A2C": {},
    "TRPO": ON_POLICY | {"cg_max_steps": 3},
    "RecurrentPPO": ON_POLICY | {"n_epochs": 2, "policy_kwargs": SMALL | {"lstm_hidden_size": 4}},
    "MaskablePPO": ON_POLICY | {"n_epochs": 2},
    "REINFORCE": {"episodes_per_update": 1},
}
CELLS = [(name, seen, acted) for name in ALGORITHMS for seen in OBSERVATIONS for acted in ACTIONS]
WORKING = [cell for cell in CELLS if not refusal(*cell)]
# A checkpoint's content depends on the pair of algorithm and observation, and on the pair of algorithm and
# action. These cells cover each such pair.
PAIRS = [
    cell
    for place, cell in enumerate(WORKING)
    if not any(cell[:2] == before[:2] for before in WORKING[:place])
    or not any((cell[0], cell[2]) == (before[0], before[2]) for before in WORKING[:place])
]


@pytest.fixture
def play(make_member, make_configuration, tmp_path):
    """Return a function that trains into a folder.

    The first simulator dies at each of `deaths` and sends a signal at step `signal_at`.
    """

    def run(folder, cell, *, signal_at=0, deaths=(), steps=STEPS, **more):
        name, seen, acted = cell
        algorithm = {"name": name, "hyperparameters": {"policy_kwargs": SMALL} | HYPERPARAMETERS[name]}
        algorithm |= more
        taken = iter(range(1, 10_000))
        task, first_task = KINDS.get(name, (FakeTask, Interrupted))

        def make_members(given):
            members = [make_member(entry.name) for entry in given.simulators]
            for member in members:
                member.env = task(OBSERVATIONS[seen], ACTIONS[acted])
            first = members[0]
            first.env = first_task(OBSERVATIONS[seen], ACTIONS[acted], deaths, taken, signal_at)
            first.restart = first.env.restart
            for other in members[1:]:
                other.env.step = after_restart(first, other.env.step)
            return members

        configuration = make_configuration(
            algorithm=algorithm,
            environment={"id": "MoveToTargetEnv-v0"},  # `load_policy` needs a registered environment
            steps=steps,
            collectors=COLLECTORS,
            evaluation={"everySteps": STEPS // 2, "episodes": 1, "confirmEpisodes": 0},
            checkpoint={"everySteps": 8, "keep": 1},
        )
        directory = RunDirectory(tmp_path / folder)
        return attempt.run(configuration, directory, make_members), directory

    return run


class Interrupted(FakeTask):
    """A task that sends SIGTERM to the trainer at one of its steps."""

    def __init__(self, seen, acted, deaths, taken, signal_at):
        super().__init__(seen, acted, deaths)
        self._taken, self._signal_at = taken, signal_at

    def step(self, action):
        """Send the signal if it is due, and take a step."""
        if next(self._taken) == self._signal_at:
            os.kill(os.getpid(), signal.SIGTERM)
        return super().step(action)


class MaskedInterrupted(Interrupted, MaskedTask):
    """A task with action masks that sends SIGTERM to the trainer at one of its steps."""


KINDS = {"MaskablePPO": (MaskedTask, MaskedInterrupted)}


def after_restart(member, step):
    """Return a step function that first waits until a broken simulator has restarted.

    On a slow machine, the other simulator would otherwise take all steps of the run before the restart ends.
    """

    def patient(action):
        for thread in threading.enumerate():
            if thread.name == f"restarter-{member.name}":
                thread.join(PATIENCE_S)
                assert not thread.is_alive()
        return step(action)

    return patient


def tensors(path):
    """Return the tensors of a model's file by name, as bytes, and the statistics for normalization."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist() if name.endswith(".pth")}
        normalized = [name for name in archive.namelist() if name == "normalize.json"]
        parts_as_json = {name: json.loads(archive.read(name)) for name in normalized}
    return parts_as_json | {
        f"{part}{place}": tensor.detach().numpy().tobytes()
        for part, content in parts.items()
        for place, tensor in flat(torch.load(io.BytesIO(content), weights_only=True))
    }


def flat(value, place=""):
    """Yield the tensors in nested mappings and lists."""
    if isinstance(value, torch.Tensor):
        yield place, value
    elif isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from flat(part, f"{place}.{key}")


def outcome(directory):
    """Return all results of a run by name: tensors, state, experience and evaluations."""
    found = checkpoint.newest(directory.checkpoints)
    state = json.loads((found.path / "state.json").read_text())
    state["episodes"] = [episode | {"t": 0} for episode in state["episodes"]]
    with np.load(found.path / "state.npz", allow_pickle=False) as arrays:
        state |= {name: array.tolist() for name, array in arrays.items()}
    experience = {name: digest for name, digest in found.manifest.files.items() if "experience" in name}
    evaluations = [line | {"seconds": 0} for line in read_lines(directory.evaluations)]
    return tensors(found.path / "model.zip") | state | experience | {"evaluations": evaluations}


def test_the_job_names_the_algorithms_of_the_table():
    """The operator must accept exactly the algorithms that the trainer has."""
    assert set(NAMES) == set(ALGORITHMS)


def test_what_is_refused_is_refused_before_a_model_is_made(play):
    """Such a job can never train, so its exit code is 2, which Kubernetes does not retry."""
    for cell in (("RecurrentPPO", "Box", "MultiBinary"), ("PPO", "Tuple", "Box"), ("CrossQ", "image", "Box")):
        assert play("refused", cell)[0] == 2


@pytest.mark.parametrize("name", ["PPO", "SAC", "RecurrentPPO"])
@pytest.mark.parametrize("seen", ["Dict", "Dict with image"])
def test_a_dict_is_normalized_by_key_and_resumes_exactly(play, name, seen):
    """Each Box of numbers has its own statistics; images and discrete values have none."""
    cell, normalize = (name, seen, "Box"), {"normalize": {}}
    whole, reference = play("whole", cell, **normalize)
    interrupted, directory = play("cut", cell, signal_at=SIGNAL_AT, **normalize)
    resumed, _ = play("cut", cell, **normalize)

    wanted, found = outcome(reference), outcome(directory)
    assert (whole, interrupted, resumed) == (0, 75, 0)
    assert [name for name in wanted.keys() | found.keys() if wanted.get(name) != found.get(name)] == []
    assert set(wanted["normalize.json"]) == {"observations/numbers", "rewards", "epsilon"}
    policy = load_policy(directory.path)
    assert set(policy.scales) == {"numbers"}
    assert policy.predict(OBSERVATIONS[seen].sample())[0].shape == ACTIONS["Box"].shape


@pytest.mark.parametrize("cell", WORKING, ids=", ".join)
def test_it_trains_and_survives_faults(play, cell):
    """If a row of a fault reached a loss, a number would be wrong or the run would end."""
    code, directory = play("broken", cell, deaths=(3, 8), steps=STEPS - 6)

    assert code == 0
    assert json.loads(directory.summary.read_text())["faults"] == 2


@pytest.mark.parametrize("cell", PAIRS, ids=", ".join)
def test_it_resumes_exactly(play, cell):
    """If the checkpoint lacked a part of the state, the resumed run would end with other results."""
    whole, reference = play("whole", cell)
    interrupted, directory = play("cut", cell, signal_at=SIGNAL_AT)
    resumed, _ = play("cut", cell)

    wanted, found = outcome(reference), outcome(directory)
    assert (whole, interrupted, resumed) == (0, 75, 0)
    assert [name for name in wanted.keys() | found.keys() if wanted.get(name) != found.get(name)] == []
