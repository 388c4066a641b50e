"""Integer observations: each algorithm trains on them, evaluates, and exports its policy.

PyTorch, ONNX and NumPy convert mixed types of numbers by different rules.
"""

from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from gymnasium import spaces

from palaestra_trainer import exporting, load_policy
from palaestra_trainer.algorithms import ALGORITHMS
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run import attempt
from palaestra_trainer.testing import FakeTask, MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS

pytestmark = pytest.mark.minutes(1)

WHOLE = {
    "uint8": spaces.Box(0, 255, (3,), np.uint8),  # one dimension, so it is not an image
    "int8": spaces.Box(-5, 5, (3,), np.int8),
    "int16": spaces.Box(-5, 5, (2, 2), np.int16),
    "int32": spaces.Box(-50, 50, (3,), np.int32),
    "int64": spaces.Box(-(2**40), 2**40, (3,), np.int64),
}
TOGETHER = spaces.Dict(WHOLE)
OFF_POLICY = {"learning_starts": 6, "batch_size": 4, "buffer_size": 40, "train_freq": 4, "gradient_steps": 1}
ON_POLICY = {"n_steps": 8, "batch_size": 8}
SMALL = {"net_arch": [8]}
HYPERPARAMETERS = {
    "PPO": ON_POLICY,
    "A2C": {},
    "TRPO": ON_POLICY | {"cg_max_steps": 3},
    "MaskablePPO": ON_POLICY,
    "RecurrentPPO": ON_POLICY | {"policy_kwargs": SMALL | {"lstm_hidden_size": 4}},
    "REINFORCE": {"episodes_per_update": 1},
}
CASES = [
    *(
        (name, "together")
        for name, entry in ALGORITHMS.items()
        if "MultiInput" in str(entry.original.policy_aliases)
    ),
    ("CrossQ", "int32"),
    *(("SAC", kind) for kind in WHOLE),
]


class Counting(FakeTask):
    """A task whose integers stay within 300, whatever its space allows."""

    def _observe(self):
        numbers = np.random.default_rng(self._past)

        def seen(part):
            few = (np.clip(bound, -300.0, 300.0) for bound in (part.low, part.high))
            return np.rint(numbers.uniform(*few)).astype(part.dtype)

        space = self.observation_space
        if isinstance(space, spaces.Dict):
            return {key: seen(part) for key, part in space.items()}
        return seen(space)


class CountingMasked(Counting, MaskedTask):
    """The same task with forbidden actions."""


@pytest.fixture
def train(make_member, make_configuration, tmp_path):
    """Return a function that trains for some steps with an evaluation; it returns the run directory."""

    def run(name, space, **algorithm):
        entry = ALGORITHMS[name]
        kind = "Box" if spaces.Box in (entry.actions or ()) else "Discrete"
        counting = CountingMasked if name == "MaskablePPO" else Counting

        def make_members(given):
            members = [make_member(entry.name) for entry in given.simulators]
            for member in members:
                member.env = counting(space, ACTIONS[kind])
            return members

        hyperparameters = {"policy_kwargs": SMALL} | HYPERPARAMETERS.get(name, OFF_POLICY)
        configuration = make_configuration(
            algorithm={"name": name, "hyperparameters": hyperparameters, "normalize": {"rewards": False}}
            | algorithm,
            environment={"id": "MoveToTargetEnv-v0"},  # `load_policy` needs a registered environment
            steps=16,
            evaluation={"everySteps": 8, "episodes": 1, "confirmEpisodes": 0},
        )
        directory = RunDirectory(tmp_path / "run")
        assert attempt.run(configuration, directory, make_members) == 0
        return directory

    return run


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_they_are_trained_on_and_evaluated_and_both_files_act_as_the_policy(train, name, kind):
    """The file is also tested with an observation of the task, besides those that the export draws."""
    space = TOGETHER if kind == "together" else WHOLE[kind]
    directory = train(name, space)

    differences = [exporting.export(directory.path, to).largest_difference for to in exporting.FORMATS]

    assert len(list(read_lines(directory.evaluations))) == 2
    assert max(differences) <= 1e-5
    policy = load_policy(directory.path)
    session = onnxruntime.InferenceSession(directory.path / "policy.onnx")
    task = Counting(space, policy.model.action_space)
    seen, _ = task.reset(seed=5)
    parts = seen if isinstance(seen, dict) else {"observation": seen}
    batch = {key: part[None] for key, part in parts.items()}
    masks = {"action_masks": np.array([True, False, True])} if name == "MaskablePPO" else {}
    batch |= {key: mask[None] for key, mask in masks.items()}
    if name == "RecurrentPPO":
        batch |= {state: np.zeros((1, 1, 4), np.float32) for state in ("hidden", "cell")}
    assert np.allclose(session.run(["action"], batch)[0][0], policy.predict(seen, **masks)[0], atol=1e-5)


@pytest.mark.parametrize("shape", [(36, 40, 3), (3, 36, 40)])
def test_a_file_takes_images_in_the_layout_of_the_environment(train, shape):
    """Stable-Baselines3 transposes images with channels last, and leaves those with channels first."""
    space = spaces.Box(0, 255, shape, np.uint8)
    directory = train("A2C", space, normalize=None, cnn="small", hyperparameters={})

    exporting.export(directory.path, "onnx")

    policy = load_policy(directory.path)
    session = onnxruntime.InferenceSession(directory.path / "policy.onnx")
    seen = np.random.default_rng(3).integers(256, size=shape).astype(np.uint8)
    action = session.run(["action"], {"observation": seen[None]})[0][0]
    assert np.allclose(action, policy.predict(seen)[0], atol=1e-5)
