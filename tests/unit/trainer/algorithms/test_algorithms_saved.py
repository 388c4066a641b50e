"""A saved model refers to code by names only, so another release of Python can load it.

Byte code of another Python raises SystemError or crashes the process, but byte code of the same Python runs.
These tests therefore check the content of the file.
"""

from __future__ import annotations

import base64
import io
import json
import pickle
import zipfile

import pytest

from palaestra_trainer.algorithms import ALGORITHMS, make_model, small_cnn
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.run import checkpoint
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.testing import FakeTask, MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS

POINTS = [[0, 0.01], [0.5, 0.002], [1, 0.001]]
SCHEDULES = {
    "points": {"learning_rate": POINTS, "clip_range": POINTS, "clip_range_vf": POINTS},
    "lines": {"learning_rate": "lin_0.01", "clip_range": "lin_0.2", "clip_range_vf": "lin_0.2"},
}
CLASSES = {"net_arch": [8], "activation_fn": "Tanh", "optimizer_class": "AdamW"}
NOISE = {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.2}
SMALL = {
    "buffer_size": 40, "learning_starts": 4, "batch_size": 4, "n_steps": 8, "episodes_per_update": 1
}  # fmt: skip
# Plain Stable-Baselines3 finds each name of a model in these modules, without this package.
PLAIN = {
    "_codecs", "builtins", "collections", "functools", "gymnasium", "numpy", "sb3_contrib",
    "stable_baselines3", "torch",
}  # fmt: skip


@pytest.fixture
def save(make_member, tmp_path):
    """Return a function that saves a model which has learned for some steps, and returns the file."""

    def made(name, seen="Box", options=None, **more):
        entry = ALGORITHMS[name]
        member = make_member("collect-0")
        acted = "Box" if entry.actions is None or "Box" in str(entry.actions) else "Discrete"
        task = MaskedTask if name == "MaskablePPO" else FakeTask
        member.env = task(OBSERVATIONS[seen], ACTIONS[acted])
        given = SMALL | {"policy_kwargs": CLASSES} | (options or {}) | (NOISE if entry.takes_noise else {})
        hyperparameters = {key: value for key, value in given.items() if key in entry.known}
        if "n_steps" in hyperparameters and entry.replays:
            del hyperparameters["n_steps"]
        algorithm = Algorithm(name=name, hyperparameters=hyperparameters, **more)
        env = SimulatorsVecEnv([Restarter(member)], run_seed=1)
        checkpoint.save_tensors(tmp_path / "model.zip", make_model(algorithm, env, seed=1).learn(12))
        return tmp_path / "model.zip"

    return made


class Named(pickle.Unpickler):
    """An unpickler that records module and name of each object to which a pickle refers."""

    def __init__(self, text):
        super().__init__(io.BytesIO(text))
        self.names = set()

    def find_class(self, module, name):
        """Record a name, and return the object of that name."""
        self.names.add((module, name))
        return super().find_class(module, name)


def named_in(model):
    """Return the names in each pickled value of a model's file, by attribute."""
    with zipfile.ZipFile(model) as archive:
        data = json.loads(archive.read("data"))
    found = {}
    for attribute, value in data.items():
        if isinstance(value, dict) and ":serialized:" in value:
            unpickler = Named(base64.b64decode(value[":serialized:"]))
            unpickler.load()
            found[attribute] = unpickler.names
    return found


@pytest.mark.parametrize("schedules", SCHEDULES)
@pytest.mark.parametrize("name", ALGORITHMS)
def test_no_value_is_byte_code_and_none_needs_this_package(save, name, schedules):
    """Another release of Python could not load byte code in the file.

    The model has a schedule wherever the algorithm accepts one, classes of PyTorch, and noise.
    """
    named = named_in(save(name, options=SCHEDULES[schedules]))

    strange = {
        (attribute, module, called)
        for attribute, names in named.items()
        for module, called in names
        if module.partition(".")[0] not in PLAIN or called == "CodeType"
    }
    assert strange == set()
    assert {"learning_rate", "lr_schedule", "policy_kwargs", "observation_space"} <= named.keys()


SEEING = [
    name for name, entry in ALGORITHMS.items() if any("Cnn" in it for it in entry.original.policy_aliases)
]


@pytest.mark.parametrize("name", SEEING)
def test_the_small_network_is_in_the_file_by_its_name(save, name):
    """Stable-Baselines3 can load such a model where this package is installed."""
    named = named_in(save(name, "image", cnn="small"))

    assert (small_cnn.__name__, "SmallCnn") in named["policy_kwargs"]
    assert "cloudpickle" not in {module.partition(".")[0] for names in named.values() for module, _ in names}
