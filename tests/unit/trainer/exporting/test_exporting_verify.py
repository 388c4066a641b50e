"""Verification of an export: the file must act as the policy does, for all spaces."""

from __future__ import annotations

import json
from copy import deepcopy

import numpy as np
import onnx
import pytest
import sb3_contrib
import stable_baselines3 as sb3
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor, CombinedExtractor
from stable_baselines3.common.vec_env import DummyVecEnv

from palaestra_trainer.errors import ExportError
from palaestra_trainer.exporting import onnx_file, safetensors_file, verify
from palaestra_trainer.exporting.policy_module import PolicyModule
from palaestra_trainer.exporting.sample_observations import drawn
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.run.policies import Scale, TrainedPolicy
from palaestra_trainer.testing import MaskedTask

NUMBERS = spaces.Box(-1.0, 1.0, (3,), np.float32)
FEW = spaces.Discrete(3)
SMALL = {"policy_kwargs": {"net_arch": [8]}, "device": "cpu", "seed": 1}
SAME = "takes the same action on all 1000 observations"
FORMATS = (onnx_file, safetensors_file)
LARGEST = {kind: float(np.finfo(kind).max) for kind in (np.float32, np.float64)}


def policy_of(cls, seen=NUMBERS, acted=FEW, scales=None, **options):
    """Return an untrained policy of Stable-Baselines3 for these spaces."""
    name = "MultiInput" if isinstance(seen, spaces.Dict) else "Mlp"
    alias = f"{name}LstmPolicy" if cls is sb3_contrib.RecurrentPPO else f"{name}Policy"
    model = cls(alias, DummyVecEnv([lambda: MaskedTask(seen, acted)]), **deepcopy(SMALL) | options)
    nowhere = Environment(id="nowhere")
    return TrainedPolicy(
        model=model,
        environment_id="",
        environment_options={},
        robot="Robotino",
        environment=nowhere,
        scales=scales or {},
    )


def compared(policy, file_format=onnx_file):
    """Return the largest difference between the actions of the file and of the policy."""

    def convert(module):
        return file_format.runner(file_format.content(module, {}), module)

    return verify.compare(convert, PolicyModule(policy), policy)


@pytest.mark.parametrize("bound", [1e-3, 1_000.0, 20_000.0])
@pytest.mark.parametrize("cls", [sb3.SAC, sb3.PPO])
def test_actions_of_any_range_are_compared_in_their_range(cls, bound):
    """A rounding error is 0.002 at 20,000 and 1e-10 at 0.001, so the tolerance is relative to the range."""
    policy = policy_of(cls, acted=spaces.Box(-bound, bound, (3,), np.float32))

    assert all(compared(policy, file_format) <= 1e-5 for file_format in FORMATS)


@pytest.mark.parametrize("cls", [sb3_contrib.TQC, sb3_contrib.RecurrentPPO])
def test_so_are_those_of_sb3_contrib(cls):
    """The actors of sb3-contrib are other classes, and one of them has a state."""
    assert compared(policy_of(cls, acted=spaces.Box(-20_000.0, 20_000.0, (3,), np.float32))) <= 1e-5


@pytest.mark.parametrize("cls", [sb3.SAC, sb3.PPO])
def test_a_file_that_is_off_by_a_thousandth_of_a_small_range_is_refused(cls):
    """An absolute tolerance would accept every file whose actions are that small."""
    policy = policy_of(cls, acted=spaces.Box(-1e-3, 1e-3, (3,), np.float32))
    acting = PolicyModule(policy)
    right = safetensors_file.runner(safetensors_file.content(acting, {}), acting)

    def wrong(*inputs):
        return tuple(action + np.float32(2e-6) for action in right(*inputs))

    with pytest.raises(ExportError, match=r"acts differently on .* of 3000 numbers, by up to 2e-06"):
        verify.compare(lambda _: wrong, acting, policy)


@pytest.mark.parametrize(
    ("low", "high", "kind"),
    [
        (-np.inf, np.inf, np.float32),
        (0.0, np.inf, np.float64),
        (-LARGEST[np.float32], LARGEST[np.float32], np.float32),
        (-LARGEST[np.float64], LARGEST[np.float64], np.float64),
        (-20_000.0, 20_000.0, np.float32),
        (-100.0, 300.0, np.float32),
        (-(2**63), 2**63 - 1, np.int64),
        (0, 255, np.uint8),
    ],
)
def test_observations_of_any_range_are_drawn_within_it_at_several_scales(low, high, kind):
    """For observations far from the middle, every action is at its bound, and a comparison proves little."""
    space = spaces.Box(low, high, (3,), kind)
    policy = policy_of(sb3.PPO, space, spaces.Box(-1.0, 1.0, (2,), np.float32))

    seen = drawn(PolicyModule(policy), 1_000)["observation"]

    assert all(map(space.contains, seen))
    middle = np.clip(0.0, low, high) if high / 2 - low / 2 > 20_000 else (low + high) / 2
    away = np.abs(seen.astype(np.float64) - middle).max(axis=1)
    assert away.max() > 50
    assert away.min() < 2
    assert compared(policy) <= 1e-5


def test_normalized_observations_are_drawn_from_what_the_run_has_seen():
    """Far from the mean, the normalizer clips all values to the same number."""
    scale = Scale(np.array([5.0, -3.0, 0.0]), np.array([4.0, 0.25, 1e-6]), 10.0, 1e-8)
    wide = spaces.Box(-1e6, 1e6, (3,), np.float32)
    policy = policy_of(sb3.PPO, wide, scales={"": scale})

    seen = drawn(PolicyModule(policy), 1_000)["observation"]

    assert seen.mean(axis=0) == pytest.approx([5.0, -3.0, 0.0], abs=0.3)
    assert (np.abs(seen - scale.mean).max(axis=0) < 6 * np.sqrt(scale.variance)).all()
    assert compared(policy) == 0


def with_bias(policy, number):
    """Add a number to each output of the policy's last layer."""
    with torch.no_grad():
        policy.model.policy.action_net.bias += torch.tensor(number)
    return policy


CLASSES = {sb3.PPO: FEW, sb3.DQN: FEW, sb3_contrib.QRDQN: FEW, sb3.A2C: spaces.MultiDiscrete([2, 3])}


def with_favorite(policy):
    """Let the policy prefer one action for every observation, as after a short training."""
    layers = [part for part in policy.model.policy.modules() if isinstance(part, torch.nn.Linear)]
    outputs = getattr(policy.model.policy, "action_net", layers[1])
    with torch.no_grad():
        outputs.bias.copy_(torch.arange(len(outputs.bias)) % 3 * 5.0)
    return policy


@pytest.mark.parametrize("cls", CLASSES)
@pytest.mark.parametrize("file_format", FORMATS, ids=lambda module: module.__name__.rpartition(".")[2])
def test_a_policy_with_a_favorite_action_is_compared_by_its_scores(cls, file_format):
    """The file always has the right action, but the scores of the actions depend on the observation."""
    policy = with_favorite(policy_of(cls, acted=CLASSES[cls]))

    assert compared(policy, file_format) == 0


def test_a_file_with_the_favorite_action_but_other_scores_is_refused():
    """For every drawn observation, the file has the right action by chance."""
    policy = with_favorite(policy_of(sb3.PPO))

    def convert(module):
        right = safetensors_file.runner(safetensors_file.content(module, {}), module)
        return lambda *inputs: right(*(part * 0 for part in inputs))

    with pytest.raises(ExportError, match=f"{SAME}.* would show nothing; normalize observations, train long"):
        verify.compare(convert, PolicyModule(policy), policy)


@pytest.mark.parametrize(
    "acted", [FEW, spaces.Box(-1.0, 1.0, (2,), np.float32)], ids=["discrete", "continuous"]
)
def test_a_policy_that_sees_nothing_is_not_exported(acted):
    """The policy always returns one action, so a file that ignores observations would pass the comparison."""
    policy = policy_of(sb3.PPO, acted=acted)
    with torch.no_grad():
        policy.model.policy.action_net.weight.zero_()

    with pytest.raises(ExportError, match=SAME):
        compared(policy)


def test_a_policy_whose_actions_are_all_at_their_bounds_is_not_exported():
    """A comparison of such actions compares only their signs."""
    acted = spaces.Box(-1e-6, 1e-6, (2,), np.float32)
    policy = policy_of(sb3.PPO, acted=acted)

    with pytest.raises(ExportError, match=r"at their bounds on \d+ of 1000 observations, so a comp"):
        compared(policy)


class Blind(BaseFeaturesExtractor):
    """A network that uses one of two keys of the observation."""

    def __init__(self, observation_space):
        super().__init__(observation_space, 3)

    def forward(self, observations):
        """Return the features, which are the values of one key."""
        return observations["seen"]


def test_an_input_that_the_network_does_not_use_is_not_in_the_file():
    """PyTorch leaves the input out, and onnxruntime rejects unknown inputs.

    The metadata lists it as unused.
    """
    seen = spaces.Dict({"ignored": NUMBERS, "seen": NUMBERS})
    policy = policy_of(sb3.PPO, seen, policy_kwargs={"net_arch": [8], "features_extractor_class": Blind})
    acting = PolicyModule(policy)

    content = onnx_file.content(acting, {"inputs": acting.inputs})

    model = onnx.load_from_string(content)
    sheet = json.loads(model.metadata_props[0].value)
    assert [value.name for value in model.graph.input] == sheet["inputs"]
    assert (sheet["inputs"], sheet["unused"]) == (["seen"], ["ignored"])
    assert compared(policy) == 0


@pytest.mark.parametrize(
    ("kind", "larger"), [(np.uint16, "int32"), (np.uint32, "int64"), (np.uint64, "int64")]
)
def test_a_type_that_onnx_cannot_have_here_is_refused_by_the_name_of_the_input(kind, larger):
    """PyTorch's own message names neither the input nor a remedy."""
    policy = policy_of(sb3.PPO, spaces.Box(0, 50, (3,), kind))

    with pytest.raises(
        ExportError, match=f"the input observation is {kind.__name__}, .* use {larger} or float32"
    ):
        compared(policy)
    assert compared(policy, safetensors_file) == 0


class Spectrum(CombinedExtractor):
    """A network with complex numbers, for which ONNX has no type."""

    def forward(self, observations):
        """Return the real part of the features' spectrum."""
        return torch.fft.fft(super().forward(observations)).real


def test_a_network_that_onnx_cannot_express_is_refused_with_a_remedy():
    """The exporter's own traceback has a hundred lines about the code of the network."""
    kwargs = {"net_arch": [8], "features_extractor_class": Spectrum}
    policy = policy_of(sb3.PPO, spaces.Dict({"a": NUMBERS}), policy_kwargs=kwargs)

    with pytest.raises(
        ExportError, match=r"cannot be converted to ONNX \(.*--to safetensors, or load_policy"
    ):
        compared(policy)


@pytest.mark.parametrize("acted", [FEW, spaces.MultiDiscrete([2, 3]), spaces.MultiBinary(2)])
def test_a_file_that_ignores_masks_is_refused(acted):
    """With such a file, a robot would take an action that the environment forbids."""
    policy = policy_of(sb3_contrib.MaskablePPO, acted=acted)
    acting = PolicyModule(policy)
    right = onnx_file.runner(onnx_file.content(acting, {}), acting)

    def unmasked(*inputs):
        return right(*inputs[:-1], np.ones_like(inputs[-1]))

    assert compared(policy) == compared(policy, safetensors_file) == 0
    with pytest.raises(ExportError, match=r"acts differently on \d+ of \d+ numbers"):
        verify.compare(lambda _: unmasked, acting, policy)


def test_actions_that_differ_by_their_masks_alone_show_nothing():
    """A file with any other network would take the same actions."""
    policy = policy_of(sb3_contrib.MaskablePPO)
    with torch.no_grad():
        policy.model.policy.action_net.weight.zero_()
        policy.model.policy.action_net.bias.copy_(torch.tensor([3.0, 2.0, 1.0]))

    with pytest.raises(ExportError, match=SAME):
        compared(policy)


def test_an_observation_with_the_name_of_the_masks_is_refused():
    """Each input of a file needs a name of its own, and the masks have this name."""
    policy = policy_of(sb3_contrib.MaskablePPO, spaces.Dict({"action_masks": NUMBERS}))

    with pytest.raises(ExportError, match=r"the observation has a key action_masks, .* rename the key"):
        PolicyModule(policy)
