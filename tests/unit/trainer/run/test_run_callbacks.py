"""Callbacks of a job's author, which run together with those of the training loop."""

from __future__ import annotations

import json
import os
import re
import signal
import textwrap

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Callback
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.callbacks import make_callbacks

SB3 = "stable_baselines3.common.callbacks"
MODULE = """
    from stable_baselines3.common.callbacks import BaseCallback

    from palaestra_trainer.errors import SimulatorDead

    SEEN = []


    class Notes(BaseCallback):
        def __init__(self, word="note", *, stop_at=0, fail_at=0, fail_at_end=False):
            super().__init__()
            if word == "":
                raise ValueError("a word is needed")
            self.word, self.stop_at, self.fail_at, self.fail_at_end = word, stop_at, fail_at, fail_at_end

        def _on_training_start(self):
            SEEN.append((self.word, "start", self.num_timesteps))

        def _on_step(self):
            valid = [info["palaestra"]["valid"] for info in self.locals["infos"]]
            SEEN.append((self.word, "step", self.num_timesteps, valid))
            if self.n_calls == self.fail_at:
                raise RuntimeError("no such plot")
            return self.n_calls != self.stop_at

        def _on_training_end(self):
            SEEN.append((self.word, "end", self.model.num_timesteps))
            if self.fail_at_end == "fault":
                raise SimulatorDead("collect-0", "connection refused")
            if self.fail_at_end:
                raise RuntimeError("no such file")


    class Plain:
        pass


    class Unfinished(BaseCallback):
        pass


    class Demanding(Notes):
        def __init__(self, threshold):
            super().__init__()
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Return the name of a new module with callbacks."""
    name = f"callbacks_{tmp_path.name}".replace("-", "_")
    (tmp_path / f"{name}.py").write_text(textwrap.dedent(MODULE))
    monkeypatch.syspath_prepend(str(tmp_path))
    return name


@pytest.fixture
def seen(module):
    """Return the notes that the callbacks of the module have made."""
    return __import__(module).SEEN


@pytest.fixture
def with_callbacks(job, module):
    """Return a function that makes the configuration of a short run.

    Each set of options is for one callback.
    """

    def make(*options, name="DQN", **changes):
        configuration = job(name, **changes)
        callbacks = tuple(Callback(name=f"{module}:Notes", options=chosen) for chosen in options)
        algorithm = configuration.algorithm.model_copy(update={"callbacks": callbacks})
        return configuration.model_copy(update={"algorithm": algorithm})

    return make


def events(seen, word, event):
    """Return the steps at which a callback had an event."""
    return [entry[2] for entry in seen if entry[:2] == (word, event)]


def test_callbacks_are_called_in_their_order_and_end_last(play, with_callbacks, seen):
    """Callbacks are called at the start of an attempt and at each step.

    Their end comes after the last evaluation and the last checkpoint.
    """
    code, _ = play(with_callbacks({"word": "first"}, {"word": "second"}))

    assert code == 0
    assert [entry[:2] for entry in seen[:4]] == [
        (w, e) for e in ("start", "step") for w in ("first", "second")
    ]
    assert events(seen, "first", "step") == events(seen, "second", "step") == [*range(1, 101)]
    assert seen[-2:] == [("first", "end", 100), ("second", "end", 100)]


def test_a_callback_sees_which_rows_a_fault_spoiled(play, with_callbacks, seen):
    """The infos mark the invalid rows.

    Until the end of the step, these rows count as steps for the callback.
    """
    play(with_callbacks({}, name="PPO"), {"collect-0": {"steps": [5]}})

    valid = [entry[3] for entry in seen if entry[1] == "step"]
    assert valid[4] == [False]
    assert events(seen, "note", "step")[3:7] == [4, 5, 5, 5]


def test_a_run_with_callbacks_learns_the_same(play, job, with_callbacks, directory, tmp_path):
    """A callback only observes the training, so the evaluations must be the same."""
    without = RunDirectory(tmp_path / "without")
    play(with_callbacks({}))
    play(job(), into=without)

    assert directory.evaluations.read_text() == without.evaluations.read_text()


@pytest.mark.parametrize(("name", "kept"), [("DQN", 52), ("PPO", 48)])
def test_a_callback_that_returns_false_ends_training_ordinarily(
    play, with_callbacks, directory, seen, name, kept
):
    """The run ends at the last rollout boundary: the state of that step is evaluated, confirmed and saved."""
    code, _ = play(with_callbacks({"stop_at": 55}, name=name))

    assert code == 0
    assert json.loads(directory.summary.read_text())["steps"] == kept
    assert checkpoint.newest(directory.checkpoints).manifest.step == kept
    assert [line["step"] for line in read_lines(directory.evaluations)][-1] == kept
    assert events(seen, "note", "end") == [kept]


def test_a_run_that_a_callback_ended_does_not_say_that_all_steps_are_done(play, with_callbacks, last_word):
    """Many people read the result and the status of a run, but not its log."""
    play(with_callbacks({"stop_at": 55}))

    assert last_word().reason == "Completed: the training is complete"


def test_a_run_that_a_callback_ended_is_prolonged_as_if_it_had_not(
    play, job, with_callbacks, directory, tmp_path
):
    """The cut rollout is dropped, so the longer run continues as if the callback had not been there."""
    without, longer = RunDirectory(tmp_path / "without"), RunDirectory(tmp_path / "longer")
    play(job("DQN", evaluation={"everySteps": 0}), into=without)
    play(with_callbacks({"stop_at": 55}, evaluation={"everySteps": 0}))
    code, _ = play(job("DQN", resume_from=str(directory.path), evaluation={"everySteps": 0}), into=longer)

    digests = [
        {name: digest for name, digest in newest.manifest.files.items() if name.endswith(".npy")}
        for newest in (checkpoint.newest(run.checkpoints) for run in (without, longer))
    ]
    assert code == 0
    assert digests[0] == digests[1]


def test_an_error_of_a_callback_ends_the_run_with_its_name_its_line_and_a_checkpoint(
    play, with_callbacks, directory, last_word, module, seen
):
    """A retry may help, for example after the failure of a server. The line leads the author to the error."""
    code, members = play(with_callbacks({"fail_at": 55}))

    assert code == 1
    error, place = last_word().reason.split(", in ")
    assert error == f"CallbackFailed: callback {module}:Notes: raised RuntimeError: no such plot"
    assert re.fullmatch(rf"\S+/{module}.py line \d+", place)
    assert checkpoint.newest(directory.checkpoints).manifest.step == 52
    assert members["collect-0"].log[-1] == "stop"
    assert events(seen, "note", "end") == [52]


def test_an_error_at_the_end_is_reported_too(play, with_callbacks, last_word, seen):
    """The other callbacks are ended first, and then the run fails."""
    code, _ = play(with_callbacks({"fail_at_end": True}, {"word": "second"}))

    assert code == 1
    assert "raised RuntimeError: no such file" in last_word().reason
    assert events(seen, "second", "end") == [100]


def test_a_fault_at_the_end_of_a_callback_neither_skips_the_others_nor_hides_the_first_error(
    play, with_callbacks, last_word, seen
):
    """A callback may use a simulator when training ends. The first error is the cause of the run's end."""
    ends = ({"fail_at_end": "fault"}, {"word": "second", "fail_at_end": True}, {"word": "third"})

    play(with_callbacks(*ends))
    reason = last_word().reason
    play(with_callbacks({"word": "breaks", "fail_at": 5}, *ends, steps=200))

    assert reason == "SimulatorUnavailable: collect-0: connection refused"
    assert last_word().reason.partition(", in ")[0].endswith("raised RuntimeError: no such plot")
    assert events(seen, "second", "end") == [100, 104]
    assert events(seen, "third", "end") == [100, 104]


def test_every_error_at_the_end_is_in_the_log(play, with_callbacks, capsys):
    """The reason in the run's status has only the first error."""
    play(with_callbacks({"fail_at_end": "fault"}, {"word": "second", "fail_at_end": True}))

    assert "raised RuntimeError: no such file" in capsys.readouterr().out


def test_a_callback_begins_anew_when_a_run_resumes(play, with_callbacks, last_word, seen):
    """The callback was also ended in the interrupted attempt. The reason of that end is still the signal."""
    configuration = with_callbacks({"fail_at_end": True})
    steps = iter(range(1, 1000))

    play(configuration, on_step=lambda: next(steps) == 42 and os.kill(os.getpid(), signal.SIGTERM))
    reason = last_word().reason
    play(configuration)

    assert reason == "Interrupted: SIGTERM received"
    assert events(seen, "note", "start") == [0, 40]
    assert events(seen, "note", "end") == [40, 100]


def test_a_run_may_resume_with_other_callbacks(play, job, with_callbacks):
    """A callback is no part of the model, so a resume does not compare it."""
    steps = iter(range(1, 1000))
    play(with_callbacks({}), on_step=lambda: next(steps) == 42 and os.kill(os.getpid(), signal.SIGTERM))

    code, _ = play(job(), must_resume=True)

    assert code == 0


@pytest.mark.parametrize(
    ("name", "options", "fact"),
    [
        ("Notes", {}, "[0].name: Notes does not name a class; write it as module:Class"),
        ("nowhere:Notes", {}, "[0].name: nowhere:Notes cannot be imported (ModuleNotFoundError: No module"),
        ("{module}:Note", {}, "{module}:Note cannot be imported (AttributeError"),
        ("{module}:Plain", {}, "{module}:Plain is not a subclass of BaseCallback; name a subclass"),
        ("{module}:SEEN", {}, "{module}:SEEN is not a subclass of BaseCallback"),
        ("{module}:Unfinished", {}, "{module}:Unfinished has no _on_step; add this method"),
        ("{module}:Notes", {"stopat": 1}, "options.stopat: {module}:Notes has no such argument; did you"),
        ("{module}:Demanding", {}, "options.threshold: {module}:Demanding needs this argument; set it"),
        (
            f"{SB3}:EvalCallback",
            {},
            "[0].name: stable_baselines3.common.callbacks:EvalCallback is refused: a run",
        ),
        (f"{SB3}:StopTrainingOnRewardThreshold", {"reward_threshold": 1}, "evaluation.stopAtSuccessRate"),
        (f"{SB3}:StopTrainingOnNoModelImprovement", {}, "it works only inside an EvalCallback; write a"),
        (
            f"{SB3}:CheckpointCallback",
            {},
            "[0].name: a run saves checkpoints without it; set trainer.checkpoint",
        ),
        ("{module}:Notes", {"word": ""}, "refuses its arguments (ValueError: a word is needed, in "),
    ],
)
def test_a_wrong_callback_is_refused_with_field_fact_and_remedy(module, name, options, fact):
    """Each mistake that shows without a simulator is reported before one starts."""
    wanted = Callback(name=name.format(module=module), options=options)

    with pytest.raises(ConfigurationError) as caught:
        make_callbacks([wanted])

    assert "algorithm.callbacks[0]" in str(caught.value)
    assert fact.format(module=module) in str(caught.value)


def test_all_wrong_callbacks_are_reported_at_once_before_a_simulator_starts(
    play, with_callbacks, last_word, directory
):
    """A person corrects all names at once, before an attempt is counted or a simulator starts."""
    code, members = play(with_callbacks({"stopat": 1}, {}, {"wrd": ""}))

    assert code == 2
    assert "callbacks[0].options.stopat" in last_word().reason
    assert "callbacks[2].options.wrd" in last_word().reason
    assert members == {}
    assert not directory.attempts.exists()
