"""Classes of a job's author: algorithms, policies and parts of policies."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.algorithms import ALGORITHMS, check, make_model
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.simulators.restarter import Restarter

LAB = '''
import sb3_contrib
import stable_baselines3 as sb3
import torch
from sb3_contrib.common.maskable.buffers import MaskableRolloutBuffer
from stable_baselines3.common.buffers import ReplayBuffer, RolloutBuffer
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import FlattenExtractor


class Careful(sb3.PPO):
    """PPO with one more hyperparameter."""

    def __init__(self, *args, care: float = 0.5, **kwargs):
        self.care = care
        super().__init__(*args, **kwargs)


class Search(sb3_contrib.ARS):
    """ARS under another name."""


class Masked(sb3.PPO):
    """PPO with the rollout buffer of MaskablePPO, which nothing gives masks to."""

    def _setup_model(self):
        super()._setup_model()
        self.rollout_buffer = MaskableRolloutBuffer(
            self.n_steps, self.observation_space, self.action_space, n_envs=self.n_envs
        )


class Eager(sb3.DQN):
    """DQN under another name."""


class OwnRollouts(sb3.PPO):
    """PPO with another kind of rollout buffer."""

    def _setup_model(self):
        super()._setup_model()

        class Own(RolloutBuffer):
            pass

        self.rollout_buffer = Own(self.n_steps, self.observation_space, self.action_space, n_envs=self.n_envs)


class OwnReplay(sb3.DQN):
    """DQN with another kind of replay buffer."""

    def _setup_model(self):
        super()._setup_model()
        self.replay_buffer = ReplayBuffer(10, self.observation_space, self.action_space)


def halving(left):
    return 0.01 * 0.5 ** (4 * (1 - left))


def rising(left):
    return -left


def failing(left):
    raise RuntimeError("no rate today")


class Doubled(FlattenExtractor):
    """Twice the observation."""

    def forward(self, observations):
        return 2.0 * super().forward(observations)


class Scribbling(FlattenExtractor):
    """It scales the observation in its place."""

    def forward(self, observations):
        return super().forward(observations.mul_(0.5))


class ScribblingPolicy(ActorCriticPolicy):
    """It scales the observation in its place."""

    def forward(self, obs, deterministic=False):
        return super().forward(obs.mul_(0.5), deterministic)


class Picky(FlattenExtractor):
    """It wants a Dict."""

    def __init__(self, observation_space):
        observation_space["sensors"]


class Hasty(FlattenExtractor):
    """It asks for what is not there yet."""

    def __init__(self, observation_space):
        self.missing


class Lost(FlattenExtractor):
    """It asks for a key that its table lacks."""

    def __init__(self, observation_space):
        {}["units"]


class OwnPolicy(ActorCriticPolicy):
    """The usual policy."""


class Calm(torch.nn.Module):
    """An activation."""

    def forward(self, x):
        return torch.tanh(x / 2)


class Slow(torch.optim.SGD):
    """An optimizer."""


def no_class():
    """Return nothing."""
'''
TINY = {"policy_kwargs": {"net_arch": [8]}}
ROLLOUTS = TINY | {"n_steps": 16, "batch_size": 8}


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """Write a user's module into a folder on the import path, and return the folder."""
    (tmp_path / "my_lab.py").write_text(LAB)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("my_lab", None)


@pytest.fixture
def make(make_member):
    """Return a function that makes a model in the corridor.

    The first simulator dies at the steps `faults`.
    """

    def made(algorithm, faults=()):
        members = [make_member("collect-0", steps=faults), make_member("collect-1")]
        return make_model(algorithm, SimulatorsVecEnv([Restarter(member) for member in members], 1), seed=1)

    return made


def test_a_class_of_ones_own_learns_from_valid_rows_only(lab, make):
    """The class has its own hyperparameter, and passes the others on to its base class."""
    del lab
    algorithm = Algorithm(name="my_lab:Careful", hyperparameters=ROLLOUTS | {"care": 0.25})
    check(algorithm)

    counted = []

    model = make(algorithm, faults=(3, 9)).learn(60, lambda locals_, _: not counted.extend(locals_["infos"]))

    valid = sum(info["palaestra"]["valid"] for info in counted)
    assert model.care == 0.25
    assert model.num_timesteps == valid < len(counted)


def test_its_own_hyperparameter_is_checked_by_its_type(lab):
    """The type comes from the signature, as for all other hyperparameters."""
    del lab
    wrong = Algorithm(name="my_lab:Careful", hyperparameters={"care": "much", "cares": 1})

    with pytest.raises(ConfigurationError) as refusal:
        check(wrong)

    assert "care: 'much' is refused; give a number" in str(refusal.value)
    assert "cares: my_lab:Careful has no such hyperparameter; did you mean care?" in str(refusal.value)


def test_a_run_with_a_class_of_ones_own_is_saved_and_resumed(lab, play, job, directory):
    """The file of the model is loaded by the class itself, without this package."""
    algorithm = {"name": "my_lab:Eager", "hyperparameters": TINY | {"learning_starts": 10, "batch_size": 8}}

    code, _ = play(job(algorithm=algorithm, steps=60), {"collect-0": {"steps": [9]}})
    longer, _ = play(job(algorithm=algorithm, steps=90))

    program = f"""
        import sys
        sys.modules["palaestra_trainer"] = None  # an import of it fails from now on
        sys.path.insert(0, {str(lab)!r})
        import my_lab
        print(my_lab.Eager.load({str(directory.model)!r}, device="cpu").num_timesteps > 0)
    """
    shown = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], check=True, capture_output=True, text=True
    )
    assert (code, longer, shown.stdout) == (0, 0, "True\n")


REFUSED = [
    (
        "sb3_contrib:ARS",
        "sb3_contrib:ARS cannot be used: ARS learns from whole returns, which would include rows",
    ),
    (
        "my_lab:Search",
        "Search is neither an OnPolicyAlgorithm nor an OffPolicyAlgorithm, so it would learn from rows",
    ),
    ("HER", "HER cannot be used: HER is a replay buffer; use SAC"),
    ("my_lab:Doubled", "my_lab:Doubled is not a subclass of BaseAlgorithm; name a subclass"),
    ("my_lab:no_class", "my_lab:no_class is not a subclass of BaseAlgorithm"),
    ("my_lab:Missing", "my_lab:Missing cannot be imported .* has no attribute 'Missing'"),
    ("no_lab:Any", "no_lab:Any cannot be imported .* install its package in the image, or add its folder"),
]


@pytest.mark.parametrize(("name", "fact"), REFUSED, ids=[name for name, _ in REFUSED])
def test_a_class_that_cannot_be_used_is_refused_in_one_sentence(lab, name, fact):
    """The class is checked before a simulator starts, so a person waits only seconds for the error."""
    del lab

    with pytest.raises(ConfigurationError, match=rf"algorithm\.name: {fact}"):
        check(Algorithm(name=name))


@pytest.mark.parametrize(
    ("name", "buffer"),
    [
        ("my_lab:Masked", "MaskableRolloutBuffer"),
        ("my_lab:OwnRollouts", "Own"),
        ("my_lab:OwnReplay", "ReplayBuffer"),
    ],
)
def test_a_class_that_makes_its_own_buffer_is_refused(lab, make, name, buffer):
    """The class would learn from rows that a fault spoiled. The model is made before a simulator starts."""
    del lab
    hyperparameters = {} if "Replay" in name else {"n_steps": 16, "batch_size": 8}
    wanted = Algorithm(name=name, hyperparameters=hyperparameters)
    check(wanted)

    fact = rf"^algorithm\.name: {name.partition(':')[2]} creates its own {buffer}, which would keep rows"
    with pytest.raises(ConfigurationError, match=fact):
        make(wanted)


def test_parts_of_a_policy_may_be_classes_of_ones_own(lab, make):
    """Each part is written as `module:Class`; classes of PyTorch may be written by their names alone."""
    del lab
    parts = {
        "features_extractor_class": "my_lab:Doubled",
        "activation_fn": "my_lab:Calm",
        "optimizer_class": "my_lab:Slow",
        "net_arch": [8],
    }
    wanted = Algorithm(
        name="PPO", policy="my_lab:OwnPolicy", hyperparameters=ROLLOUTS | {"policy_kwargs": parts}
    )
    check(wanted)

    policy = make(wanted).policy

    kinds = {type(part).__name__ for part in (policy, *policy.modules(), policy.optimizer)}
    assert {"OwnPolicy", "Doubled", "Calm", "Slow"} <= kinds


@pytest.mark.parametrize("name", ["PPO", "A2C", "TRPO"])
@pytest.mark.parametrize(
    "parts",
    [
        {"policy_kwargs": {"features_extractor_class": "my_lab:Scribbling"}},
        {"policy": "my_lab:ScribblingPolicy"},
    ],
    ids=["extractor", "policy"],
)
def test_a_network_that_writes_into_its_input_changes_no_row(lab, make, name, parts):
    """Stable-Baselines3 stores the observation only after the network had access to its memory."""
    del lab
    steps = {"n_steps": 16} | ({} if name == "A2C" else {"batch_size": 8})
    named = Algorithm(
        name=name,
        policy=parts.get("policy"),
        hyperparameters=steps | {"policy_kwargs": parts.get("policy_kwargs", {})},
    )
    model = make(named)
    seen = []
    step = model.env.step_wait

    def step_wait():
        row = step()
        seen.append(row[0].copy())
        return row

    model.env.step_wait = step_wait

    model.learn(16)

    played = np.stack(seen, axis=1)  # (simulators, steps, *observation)
    stored = model.rollout_buffer.observations.reshape(played.shape)
    assert np.array_equal(stored[:, 1:], played[:, :-1])


@pytest.mark.parametrize(
    ("algorithm", "fact"),
    [
        ({"policy": "MlpPolice"}, r"algorithm\.policy: PPO has no policy MlpPolice; did you mean MlpPolicy"),
        ({"policy": "my_lab:Calm"}, r"algorithm\.policy: my_lab:Calm is not a subclass of BasePolicy"),
        (
            {"hyperparameters": {"policy_kwargs": {"features_extractor_class": "my_lab:Calm"}}},
            r"policy_kwargs\.features_extractor_class: my_lab:Calm is not a subclass of BaseFeatures",
        ),
        (
            {"hyperparameters": {"policy_kwargs": {"optimizer_class": "my_lab:Fast"}}},
            r"policy_kwargs\.optimizer_class: my_lab:Fast cannot be imported",
        ),
    ],
)
def test_wrong_parts_are_refused_by_field_and_remedy(lab, algorithm, fact):
    """The parts are checked before a simulator starts, so a person waits only seconds for the error."""
    del lab

    with pytest.raises(ConfigurationError, match=fact):
        check(Algorithm(name="PPO", **algorithm))


def test_a_policy_that_the_observation_does_not_fit_is_refused(make):
    """Stable-Baselines3 only has an assertion for this case."""
    with pytest.raises(ConfigurationError, match="algorithm: PPO refuses its hyperparameters or the envir"):
        make(Algorithm(name="PPO", policy="CnnPolicy", hyperparameters=ROLLOUTS))


@pytest.mark.parametrize(
    ("extractor", "fact"),
    [
        ("Picky", "TypeError: 'Box' object is not subscriptable"),
        ("Hasty", "AttributeError: 'Hasty' object has no attribute 'missing'"),
        ("Lost", "KeyError: 'units'"),
    ],
)
def test_a_part_of_a_policy_whose_constructor_raises_is_refused_with_its_line(lab, make, extractor, fact):
    """A retry would raise the same error, so the message has the line of the user's file."""
    parts = {"features_extractor_class": f"my_lab:{extractor}"}
    wanted = Algorithm(name="PPO", hyperparameters=ROLLOUTS | {"policy_kwargs": parts})

    with pytest.raises(ConfigurationError) as refusal:
        make(wanted)

    assert f"the environment's spaces ({fact}, in {lab / 'my_lab.py'} line " in str(refusal.value)


POINTS = [[0, 0.01], [0.5, 0.002], [0.75, 0.004]]
SHARES = {1.0: 0.01, 0.75: 0.006, 0.5: 0.002, 0.375: 0.003, 0.2: 0.004, 0.0: 0.004}


def test_a_schedule_may_have_points(make):
    """Straight lines join the points. Before the first and after the last point the value is constant."""
    wanted = Algorithm(
        name="PPO", hyperparameters=ROLLOUTS | {"learning_rate": POINTS, "clip_range": "lin_0.3"}
    )
    check(wanted)

    model = make(wanted)

    assert {left: model.lr_schedule(left) for left in SHARES} == pytest.approx(SHARES)
    assert model.clip_range(0.5) == pytest.approx(0.15)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_takes_a_schedule(name):
    """Some algorithms declare the learning rate as a bare Callable, without its arguments."""
    for rate in ("lin_0.001", POINTS):
        check(Algorithm(name=name, hyperparameters={"learning_rate": rate}))


def test_plain_stable_baselines_loads_a_schedule_of_points(make, tmp_path):
    """The file refers to a function of NumPy, with the points as its arguments."""
    make(Algorithm(name="PPO", hyperparameters=ROLLOUTS | {"learning_rate": POINTS})).save(
        tmp_path / "model.zip"
    )
    program = f"""
        import sys
        sys.modules["palaestra_trainer"] = None  # an import of it fails from now on
        from stable_baselines3 import PPO
        print(PPO.load({str(tmp_path / "model.zip")!r}, device="cpu").lr_schedule(0.5))
    """

    shown = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], check=True, capture_output=True, text=True
    )

    assert shown.stdout == "0.002\n"


def test_a_schedule_may_be_a_function_of_ones_own_which_the_model_names(lab, make, tmp_path):
    """The file has only the function's name, so a changed function takes effect in the next attempt."""
    wanted = Algorithm(
        name="PPO",
        hyperparameters=ROLLOUTS | {"learning_rate": "my_lab:halving", "clip_range": "my_lab:halving"},
    )
    check(wanted)

    model = make(wanted)
    model.save(tmp_path / "model.zip")

    assert (model.lr_schedule(1.0), model.lr_schedule(0.5)) == pytest.approx((0.01, 0.0025))
    assert model.clip_range(0.75) == pytest.approx(0.005)
    program = f"""
        import my_lab
        my_lab.halving = lambda left: 0.5
        from stable_baselines3 import PPO
        print(PPO.load({str(tmp_path / "model.zip")!r}, device="cpu").clip_range(1.0))
    """
    shown = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], check=True, capture_output=True, text=True, cwd=lab
    )
    assert shown.stdout == "0.5\n"


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("my_lab:rising", "my_lab:rising(1.0) is -1.0; return a finite number of 0 or more"),
        ("my_lab:failing", "my_lab:failing(1.0) cannot be used (RuntimeError: no rate today"),
        ("my_lab:Doubled", "my_lab:Doubled(1.0) cannot be used ("),
        ("my_lab:none", "my_lab:none cannot be imported (AttributeError"),
    ],
)
def test_a_function_that_returns_no_rate_is_refused(lab, name, fact):
    """The first update would fail or increase the loss, after the simulators have started."""
    del lab
    with pytest.raises(ConfigurationError) as refusal:
        check(Algorithm(name="DQN", hyperparameters={"learning_rate": name}))

    assert str(refusal.value).startswith(f"algorithm.hyperparameters.learning_rate: {fact}")


@pytest.mark.parametrize(
    "points", [[], [[0.5, 0.1], [0.5, 0.2]], [[0, 0.1], [2, 0.2]], [[0, "0.1"]], [0, 0.1], "lin_x"]
)
def test_points_that_make_no_schedule_are_refused(points):
    """The shares of the steps must increase from 0 to 1."""
    with pytest.raises(ConfigurationError, match=r"learning_rate: .* or a schedule such as lin_0\.001 or"):
        check(Algorithm(name="PPO", hyperparameters={"learning_rate": points}))


def test_noise_on_actions_is_each_members_own(make_member):
    """Each simulator has its own noise. The hyperparameters have the names of rl-baselines3-zoo."""
    members = [make_member(f"collect-{row}") for row in range(2)]
    for member in members:
        member.env.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
    noisy = {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.5, "learning_starts": 0, "buffer_size": 50}
    wanted = Algorithm(name="TD3", hyperparameters=TINY | noisy)
    check(wanted)

    model = make_model(wanted, SimulatorsVecEnv([Restarter(member) for member in members], 1), seed=1).learn(
        4
    )

    first, second = (noise.noise_prev.item() for noise in model.action_noise.noises)
    assert first != second


@pytest.mark.parametrize(
    ("noise", "fact"),
    [
        ({"noise_type": "normal"}, "noise_std: is missing; noise has a type and a deviation"),
        ({"noise_std": 0.1}, "noise_type: is missing"),
        ({"noise_type": "white", "noise_std": 0.1}, "noise_type: 'white' is not known; use one of normal"),
        ({"noise_type": "normal", "noise_std": -1}, "noise_std: -1 is refused; give a number above 0"),
    ],
)
def test_noise_that_is_half_or_wrong_is_refused(noise, fact):
    """The message has the field, the mistake and the remedy."""
    with pytest.raises(ConfigurationError, match=fact):
        check(Algorithm(name="SAC", hyperparameters=noise))


def test_an_algorithm_without_noise_has_no_such_hyperparameter():
    """The policies of PPO are stochastic, so noise would have no effect."""
    with pytest.raises(ConfigurationError, match="noise_type: PPO has no such hyperparameter"):
        check(Algorithm(name="PPO", hyperparameters={"noise_type": "normal", "noise_std": 0.1}))
