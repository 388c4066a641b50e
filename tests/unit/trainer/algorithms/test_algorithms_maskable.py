"""MaskablePPO: each row keeps its mask, and no forbidden action is taken."""

from __future__ import annotations

import json
import re

import numpy as np
import onnxruntime
import pytest
import torch
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st
from sb3_contrib.common.maskable.buffers import MaskableRolloutBuffer

from palaestra_trainer import exporting, load_policy
from palaestra_trainer.algorithms import ModelPolicy, check, make_model
from palaestra_trainer.algorithms.maskable import ValidMaskableDictRolloutBuffer, ValidMaskableRolloutBuffer
from palaestra_trainer.environments.masks import allows
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.episodes.evaluation import evaluate
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError, SimulatorHung
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.job.run_directory import read_lines
from palaestra_trainer.run import attempt
from palaestra_trainer.run.evaluate import measure
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.testing import FakeTask, MaskedTask
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS

NUMBER = spaces.Box(-1e6, 1e6, (1,), np.float32)
FEW = spaces.Discrete(3)
BUFFERS = {
    ValidMaskableRolloutBuffer: NUMBER,
    MaskableRolloutBuffer: NUMBER,
    ValidMaskableDictRolloutBuffer: spaces.Dict({"mark": NUMBER}),
}
OURS = [kind for kind in BUFFERS if kind is not MaskableRolloutBuffer]
ROLLOUTS = {"n_steps": 8, "batch_size": 4, "n_epochs": 2, "policy_kwargs": {"net_arch": [8]}}
NUMBERS = ("Box", "Discrete")  # the spaces of observation and action
MASKED = [(seen, acted) for seen in ("Box", "Dict") for acted in ("Discrete", "MultiDiscrete", "MultiBinary")]


def bits(mark):
    """Return the mask of a row, which is made of the last bits of its mark."""
    return np.array([int(mark) >> place & 1 for place in range(FEW.n)], bool)


def filled(kind, valid):
    """Return a full buffer; a row's mark is its number, plus 100 for each simulator before its own."""
    rows, members = valid.shape
    buffer = kind(rows, BUFFERS[kind], FEW, "cpu", 0.8, 0.9, n_envs=members)
    for row in range(rows):
        marks = row + 100.0 * np.arange(members)
        column = marks[:, None].astype(np.float32)
        seen = {"mark": column} if isinstance(BUFFERS[kind], spaces.Dict) else column
        if kind in OURS:
            buffer.mark(valid[row])
        numbers = torch.from_numpy(marks)
        starts = np.ones(members) if row == 0 else ~valid[row - 1]
        masks = np.stack([bits(mark) for mark in marks])
        buffer.add(seen, np.zeros((members, 1)), marks, starts, numbers, numbers, action_masks=masks)
    buffer.compute_returns_and_advantage(torch.zeros(members), np.zeros(members, bool))
    return buffer


def marks_in(batch):
    """Return the marks of the rows in a batch."""
    seen = batch.observations["mark"] if isinstance(batch.observations, dict) else batch.observations
    return seen.flatten().tolist()


@pytest.mark.parametrize("kind", OURS)
@given(data=st.data())
def test_each_valid_row_is_learned_from_once_with_its_mask_and_no_other(kind, data):
    """With the mask of another row, the probability of the action would be wrong.

    One row has no standard deviation, so a batch has at least two.
    """
    rows, members = data.draw(st.integers(2, 9)), data.draw(st.integers(1, 3))
    marks = data.draw(st.lists(st.booleans(), min_size=rows * members, max_size=rows * members))
    valid = np.array(marks).reshape(rows, members)
    valid[:2, 0] = True

    batches = list(filled(kind, valid).get(data.draw(st.integers(2, 8))))

    wanted = [row + 100.0 * member for row, member in np.argwhere(valid)]
    assert sorted(mark for batch in batches for mark in marks_in(batch)) == sorted(wanted)
    assert min(len(marks_in(batch)) for batch in batches) > 1
    for batch in batches:
        assert batch.action_masks.tolist() == [bits(mark).tolist() for mark in marks_in(batch)]


def test_without_faults_a_rollout_is_what_sb3_contrib_computes():
    """Without faults, a run must learn exactly as with plain sb3-contrib."""
    valid = np.ones((5, 2), bool)
    ours, theirs = (filled(kind, valid) for kind in (ValidMaskableRolloutBuffer, MaskableRolloutBuffer))

    assert ours.advantages.tolist() == theirs.advantages.tolist()
    assert ours.returns.tolist() == theirs.returns.tolist()
    columns = [sorted(map(tuple, next(buffer.get()).action_masks.tolist())) for buffer in (ours, theirs)]
    assert columns[0] == columns[1]


class Asked(MaskedTask):
    """A task that counts the requests for its masks, and fails at some of them."""

    def __init__(self, *arguments, breaks_at=(), **options):
        super().__init__(*arguments, **options)
        self.asked = 0
        self._breaks_at = breaks_at

    def action_masks(self):
        """Return the masks, or fail."""
        assert not self._dead, "asked while it is mended"
        self.asked += 1
        if self.asked in self._breaks_at:
            self._dead = True
            raise SimulatorHung("fake", "does not answer; restart it")
        return super().action_masks()


def with_task(member, task):
    """Return a simulator with the task as its environment; a restart of the simulator restarts the task."""
    revive = member.restart
    member.env = task
    member.restart = lambda: (revive(), task.restart())
    return member


def task_of(kind=MaskedTask, spaces_of=NUMBERS, **options):
    """Return a task with the spaces of these names."""
    seen, acted = spaces_of
    return kind(OBSERVATIONS[seen], ACTIONS[acted], **options)


@pytest.fixture
def learn(make_member):
    """Return a function that makes a model with two simulators.

    The first simulator has the given task. With `held`, it restarts only when the test releases it.
    """

    def make(first, *, held=False):
        members = [with_task(make_member("collect-0", held=held), first)]
        members.append(with_task(make_member("collect-1"), task_of()))
        env = SimulatorsVecEnv([Restarter(member) for member in members], 1)
        wanted = Algorithm(name="MaskablePPO", hyperparameters=ROLLOUTS)
        check(wanted)
        return make_model(wanted, env, seed=1), members, env

    return make


def test_a_broken_simulator_is_not_asked_and_its_rows_allow_everything(learn):
    """Another thread restarts the simulator.

    A call of its environment could disturb the restart or wait for it.
    """
    model, members, env = learn(task_of(Asked, deaths=(5,)), held=True)
    masks, rows = [], []

    def note(locals_, _):
        masks.append(locals_["action_masks"][0].all())
        rows.append(locals_["infos"][0]["palaestra"]["valid"])
        return True

    try:
        model.learn(16, note)
        asked = members[0].env.asked
    finally:
        env.close()

    assert asked == 5
    assert rows == [True] * 4 + [False] * (len(rows) - 4)
    assert all(masks[5:])
    assert not all(masks[:5])
    assert all(bool(tensor.isfinite().all()) for tensor in model.policy.parameters())


def test_a_simulator_that_breaks_while_masks_are_asked_for_ends_its_episode(learn):
    """As after a fault in a step, no row across the fault reaches a loss. The other simulators continue."""
    model, _, env = learn(task_of(Asked, breaks_at=(3, 9), max_steps=50))
    rows = []

    def note(locals_, _):
        said = locals_["infos"][0]["palaestra"]
        fault = said.get("sim_fault", {})
        rows.append((said["valid"], bool(locals_["dones"][0]), fault.get("kind"), fault.get("step")))
        return True

    try:
        model.learn(64, note)
    finally:
        env.close()

    assert rows[:3] == [(True, False, None, None)] * 2 + [(False, True, "hung", 2)]
    assert [kind for _, _, kind, _ in rows if kind] == ["hung"] * 2
    assert rows[-1][0]


def test_the_vector_offers_masks_only_of_environments_that_have_them(make_member):
    """sb3-contrib decides by `has_attr("action_masks")` whether it asks an environment for masks."""
    answers = []
    for kind in (MaskedTask, FakeTask):
        env = SimulatorsVecEnv([Restarter(with_task(make_member(), task_of(kind)))], 1)
        answers.append(env.has_attr("action_masks"))

    assert answers == [True, False]


@pytest.fixture
def run(directory, make_member, make_configuration):
    """Return a function that trains with MaskablePPO.

    It returns the exit code, the simulators and the arguments of the run.
    """

    def play(make_task, *, collectors=2, **changes):
        algorithm = {"name": "MaskablePPO", "hyperparameters": ROLLOUTS} | changes.pop("algorithm", {})
        members = []

        def make_members(given):
            members[:] = [with_task(make_member(entry.name), make_task()) for entry in given.simulators]
            return members

        configuration = make_configuration(
            algorithm=algorithm,
            environment={"id": "MoveToTargetEnv-v0"},  # `load_policy` needs a registered environment
            collectors=collectors,
            evaluation={"everySteps": 16, "episodes": 3, "confirmEpisodes": 4},
            **({"steps": 32} | changes),
        )
        return attempt.run(configuration, directory, make_members), members, (configuration, make_members)

    return play


def test_an_environment_without_masks_is_refused_before_a_simulator_starts(run, last_word):
    """Without masks every action would be allowed, so the job would train with plain PPO unnoticed."""
    code, members, _ = run(lambda: task_of(FakeTask))

    assert code == 2
    assert {entry for member in members for entry in member.log} <= {"stop"}
    assert (
        "environment.id: MoveToTargetEnv-v0 has no method action_masks, which MaskablePPO calls to get the "
        "allowed actions; define action_masks(self), which returns a bool for each action, or use PPO"
    ) in last_word().reason


@pytest.mark.parametrize("given", [{}, {"normalize": {}}, {"name": "sb3_contrib:MaskablePPO"}])
def test_training_evaluations_and_confirmations_take_only_allowed_actions(run, directory, given):
    """The task fails at a forbidden action, so each part of a run must choose among allowed actions.

    `palaestra-eval` is covered too, and an algorithm that is named by its class.
    """
    code, _, (configuration, make_members) = run(task_of, algorithm=given)
    again = measure(configuration, directory.model, make_members, episodes=4, stream="C")

    assert code == 0
    assert len(list(read_lines(directory.evaluations))) == 2
    [confirmed] = read_lines(directory.confirmations)
    figures = ("mean_return", "mean_length", "success_rate")
    assert [confirmed[name] for name in figures] == [again[name] for name in figures]


def test_an_evaluation_outside_a_run_asks_for_masks_too(learn, make_member):
    """`evaluate` finds out from the policy that it needs masks, so a program passes no option for them."""
    model, _, env = learn(task_of())
    member = with_task(make_member(), task_of(Asked))

    evaluation = evaluate(ModelPolicy(model), member, [1, 2, 3])
    env.close()

    assert member.env.asked == sum(episode.length for episode in evaluation.episodes)


def test_palaestra_eval_refuses_an_environment_without_masks_before_a_simulator_starts(run, directory):
    """Without masks the policy would act as it never did in training."""
    _, members, (configuration, make_members) = run(task_of)

    def unmasked(given):
        for member in make_members(given):
            member.env = task_of(FakeTask)
        return members

    with pytest.raises(ConfigurationError, match="MoveToTargetEnv-v0 has no method action_masks"):
        measure(configuration, directory.model, unmasked, episodes=1, stream="B")
    assert "start" not in members[0].log


def test_an_episode_that_is_played_again_ends_before_a_forbidden_action(learn):
    """The environment is not deterministic, so an action of the saved episode may be forbidden now.

    In that case the next episode begins.
    """
    saved = [EpisodeState(0, np.zeros(6, np.int64)), EpisodeState(4, np.array([1]))]
    env = learn(task_of())[2]

    with pytest.raises(AssertionError, match="action 0 is not allowed"):
        env.resume(saved)
    env.resume(saved, masked=True)

    first, second = env.snapshot()
    env.close()
    assert (first.episode, len(first.actions)) == (1, 0)
    assert (second.episode, second.actions.tolist()) == (4, [1])


@pytest.mark.parametrize(
    ("masks", "fact"),
    [
        ([True] * 4, r"3 truth values, one for each choice of Discrete\(3\); got an array of shape \(4,\)"),
        ([False] * 3, "at least one allowed choice; got none"),
        ([0.0, np.nan, 1.0], "got float64 values such as nan"),
        (["yes"] * 3, "got <U3 values such as 'yes'"),
        ([[1], [1, 1]], "got lists of different lengths"),
    ],
)
def test_what_is_no_mask_is_refused_with_what_came(run, last_word, masks, fact):
    """Stable-Baselines3 would fail with a shape error, or take a forbidden action."""

    class Wrong(MaskedTask):
        def action_masks(self):
            return masks

        def step(self, action):
            return FakeTask.step(self, action)

    code, _, _ = run(lambda: task_of(Wrong))

    assert code == 2
    reason = last_word().reason
    assert "environment.id: Wrong: action_masks(self): expected " in reason
    assert re.search(fact, reason)


@pytest.mark.parametrize("spaces_of", MASKED, ids=", ".join)
def test_both_files_act_as_the_policy_with_masks(run, directory, spaces_of):
    """The task fails at a forbidden action. The verification of an export compares the actions too."""
    assert run(lambda: task_of(spaces_of=spaces_of), algorithm={"normalize": {}})[0] == 0
    differences = [exporting.export(directory.path, to).largest_difference for to in exporting.FORMATS]
    policy = load_policy(directory.path)
    session = onnxruntime.InferenceSession(directory.path / "policy.onnx")
    sheet = json.loads(session.get_modelmeta().custom_metadata_map["palaestra"])
    task = task_of(spaces_of=spaces_of)

    assert differences == [0.0, 0.0]
    assert sheet["inputs"][-1] == "action_masks"
    assert sheet["choices"] == {"Discrete": [3], "MultiDiscrete": [2, 3], "MultiBinary": [2, 2]}[spaces_of[1]]
    for seed in range(5):
        seen, over = task.reset(seed=seed)[0], False
        while not over:
            masks = task.action_masks()
            parts = seen if isinstance(seen, dict) else {"observation": seen}
            batch = {key: np.asarray(part)[None] for key, part in parts.items()}
            (actions,) = session.run(["action"], batch | {"action_masks": masks[None]})
            action, _ = policy.predict(seen, action_masks=masks)
            assert actions[0].tolist() == action.tolist()
            assert allows(masks, task.action_space, action)
            seen, _, terminated, truncated, _ = task.step(action)
            over = terminated or truncated


def test_a_policy_with_masks_never_acts_without_them(run, directory, play, job, tmp_path):
    """Other policies accept no masks, because they would ignore them."""
    assert run(task_of)[0] == 0
    seen = OBSERVATIONS["Box"].sample()

    with pytest.raises(ValueError, match=r'action_masks: .* pass env.get_wrapper_attr\("action_masks"\)\(\)'):
        load_policy(directory.path).predict(seen)
    with pytest.raises(ValueError, match="action_masks: expected at least one allowed choice; got none"):
        load_policy(directory.path).predict(seen, action_masks=[False] * 3)

    another = type(directory)(tmp_path / "another")
    corridor = job("PPO", steps=40, environment={"id": "MoveToTargetEnv-v0"})
    assert play(corridor, into=another)[0] == 0
    with pytest.raises(ValueError, match="action_masks: PPO chooses among all actions; leave them out"):
        load_policy(another.path).predict(np.zeros(2, np.float32), action_masks=[True, False])
