"""A new run starts with tensors and statistics of another run's policy; no code in the file is run."""

import io
import os
import pickle
import zipfile

import gymnasium
import numpy as np
import pytest
import structlog
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv

from palaestra_trainer.algorithms import make_model, normalizer_of
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, Normalize
from palaestra_trainer.run.checkpoint import begin_from, save_tensors

SMALL = {"n_steps": 8, "batch_size": 8, "policy_kwargs": {"net_arch": [8]}}


class Numbers(gymnasium.Env):
    """An environment whose observations have a given length."""

    action_space = spaces.Discrete(2)

    def __init__(self, length=4):
        self.observation_space = spaces.Box(-9, 9, (length,), np.float32)

    def reset(self, *, seed=None, options=None):
        """Return a random observation."""
        del options
        super().reset(seed=seed)
        return self._seen(), {}

    def step(self, action):
        """Return a random observation."""
        return self._seen(), float(action), False, False, {}

    def _seen(self):
        return self.np_random.uniform(-9, 9, self.observation_space.shape).astype(np.float32)


def model_of(seed=0, length=4, name="PPO", normalize=None, **changes):
    """Return a new model; the arguments set what differs from the default."""
    algorithm = Algorithm(name=name, hyperparameters=SMALL | changes, normalize=normalize)
    return make_model(algorithm, DummyVecEnv([lambda: Numbers(length)]), seed)


def saved(model, path):
    """Save a model, and return the path of its zip file."""
    save_tensors(path, model)
    return path


def test_all_tensors_of_the_policy_are_the_files(tmp_path):
    """A new run begins at step 0 with a new optimizer, so only the policy is taken from the file."""
    trained = model_of(seed=1)
    trained.learn(16)
    model = model_of(seed=2)

    begin_from(saved(trained, tmp_path / "model.zip"), model)

    for name, tensor in model.policy.state_dict().items():
        assert torch.equal(tensor, trained.policy.state_dict()[name])
    assert model.num_timesteps == 0
    assert model.policy.optimizer.state_dict()["state"] == {}


def test_a_model_of_plain_stable_baselines3_will_do(tmp_path):
    """A person may have trained the policy without Palaestra."""
    plain = PPO("MlpPolicy", Numbers(), **SMALL)
    plain.save(tmp_path / "plain.zip")
    model = model_of()

    begin_from(tmp_path / "plain.zip", model)

    assert torch.equal(model.policy.action_net.weight, plain.policy.action_net.weight)


def test_statistics_come_along_where_both_normalize(tmp_path):
    """A policy needs the mean and the deviation of the observations with which it was trained."""
    trained = model_of(normalize=Normalize())
    trained.learn(16)
    model = model_of(normalize=Normalize(rewards=False, clip_observations=5.0))

    begin_from(saved(trained, tmp_path / "model.zip"), model)

    own, there = normalizer_of(model), normalizer_of(trained)
    assert np.array_equal(own.scales["observations"].mean, there.scales["observations"].mean)
    assert own.scales["observations"].count > 16
    assert own.clip_obs == 5.0


@pytest.mark.parametrize(("before", "now"), [(None, Normalize()), (Normalize(), None)])
def test_a_normalizer_on_one_side_only_is_logged(tmp_path, before, now):
    """The difference may be intended, so it is a warning and not an error."""
    path = saved(model_of(normalize=before), tmp_path / "model.zip")

    with structlog.testing.capture_logs() as logs:
        begin_from(path, model_of(normalize=now))

    assert [line["log_level"] for line in logs] == ["warning", "info"]
    assert "normalize different observations" in logs[0]["event"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"length": 5},
            r"the tensor mlp_extractor\.policy_net\.0\.weight is \(8, 4\), and \(8, 5\) in this run; .*",
        ),
        (
            {"policy_kwargs": {"net_arch": [8, 8]}},
            r"the tensor mlp_extractor\.policy_net\.2\.weight, \(8, 8\) in this run, is missing",
        ),
        (
            {"policy_kwargs": {"net_arch": []}},
            r"the tensor mlp_extractor\.\w+\.0\.\w+ is unknown in this run",
        ),
    ],
    ids=["another shape", "more layers", "fewer layers"],
)
def test_a_mismatch_names_the_tensor_with_both_shapes(tmp_path, changes, message):
    """A person finds the wrong layer by its name and shapes. The model keeps its own tensors."""
    path = saved(model_of(), tmp_path / "model.zip")
    model = model_of(**changes)
    before = [tensor.clone() for tensor in model.policy.state_dict().values()]

    with pytest.raises(ConfigurationError, match=f"^initialPolicy: {path}: .*{message}"):
        begin_from(path, model)

    assert all(map(torch.equal, before, model.policy.state_dict().values()))


class Bomb:
    """An object that makes a folder when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize("member", ["policy.pth", "data"])
def test_nothing_is_unpickled(tmp_path, member):
    """The file may come from somebody else, so no code in it may run.

    The object is in place of the tensors, or among the settings of Stable-Baselines3.
    """
    model, path, content = model_of(), tmp_path / "model.zip", io.BytesIO()
    torch.save(Bomb(tmp_path / "exploded"), content)
    with zipfile.ZipFile(saved(model, path)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members[member] = (
        content.getvalue() if member == "policy.pth" else pickle.dumps(Bomb(tmp_path / "exploded"))
    )
    with zipfile.ZipFile(path, "w") as archive:
        for name, bytes_ in members.items():
            archive.writestr(name, bytes_)

    if member == "policy.pth":
        with pytest.raises(ConfigurationError, match=r"policy.pth has objects other than tensors, which are"):
            begin_from(path, model)
    else:
        begin_from(path, model)

    assert not (tmp_path / "exploded").exists()


@pytest.mark.parametrize("content", [None, b"", b"no zip"])
def test_a_file_that_is_no_model_is_refused(tmp_path, content):
    """The file is missing, empty, or not a zip file."""
    path = tmp_path / "model.zip"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(
        ConfigurationError, match=r"cannot be read as a model of Stable-Baselines3 .*; name a"
    ):
        begin_from(path, model_of())


def changed(model, path, change):
    """Save the model with a changed first weight, and return the path of its zip file."""
    saved(model, path)
    state = model.policy.state_dict()
    name = next(name for name in state if name.endswith("weight"))
    content = io.BytesIO()
    torch.save(state | {name: change(state[name])}, content)
    with zipfile.ZipFile(path) as archive:
        others = {each: archive.read(each) for each in archive.namelist() if each != "policy.pth"}
    with zipfile.ZipFile(path, "w") as archive:
        for member, data in (others | {"policy.pth": content.getvalue()}).items():
            archive.writestr(member, data)
    return path


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        (lambda weight: torch.full_like(weight, torch.nan), "has numbers that are not finite"),
        (lambda weight: weight / 0, "has numbers that are not finite"),
        (lambda weight: weight.to(torch.complex64), "is strided of complex64, and strided of float32"),
        (lambda weight: weight.to_sparse(), "is sparse_coo of float32, and strided of float32"),
    ],
    ids=["nan", "infinite", "complex", "sparse"],
)
def test_weights_that_are_no_plain_numbers_are_refused(tmp_path, change, fact):
    """Without the check, PyTorch would load NaN, drop imaginary parts, and fail at sparse tensors."""
    path = changed(model_of(seed=1), tmp_path / "model.zip", change)

    with pytest.raises(ConfigurationError, match=fact):
        begin_from(path, model_of(seed=2))


@pytest.mark.parametrize("inner", [False, True], ids=["in the zip", "in PyTorch's own zip"])
def test_a_file_that_unpacks_to_gigabytes_is_refused_before_it_does(tmp_path, inner):
    """Without the check, a file of two megabytes could take four gigabytes of memory."""
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("archive/data/0", bytes(64 << 20))
    with zipfile.ZipFile(tmp_path / "model.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("policy.pth", bomb.getvalue() if inner else bytes(64 << 20))

    with pytest.raises(
        ConfigurationError, match=r"unpacks to 67108864 bytes, but the policy of this run has"
    ):
        begin_from(tmp_path / "model.zip", model_of())
