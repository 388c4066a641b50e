"""The common part of all trackers, tested with a tracker that keeps all data in memory."""

from __future__ import annotations

import importlib
import importlib.util
import os
import signal
import sys
import types
from typing import Any, ClassVar

import pytest
from structlog.testing import capture_logs
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Callback
from palaestra_trainer.run import callbacks
from palaestra_trainer.run.callbacks import make_callbacks
from palaestra_trainer.trackers.tracker import Tracker, known_run, remember_run, title_of


class Memory(Tracker):
    """A tracker that keeps the data of all attempts in its class."""

    begun: ClassVar[list[Any]] = []
    points: ClassVar[list[Any]] = []
    ended: ClassVar[list[int]] = []

    def begin(self, directory, configuration):
        """Continue the run that is known from an earlier attempt, or begin a new one."""
        run = known_run(directory, "memory")
        if run is None:
            remember_run(directory, "memory", "the-run")
        self.begun.append((run, configuration))

    def log_scalars(self, step, scalars):
        """Keep the scalars of a step."""
        self.points.append((step, scalars))

    def end(self):
        """Record how many points the tracker had at the end."""
        self.ended.append(len(self.points))


@pytest.fixture
def memory(monkeypatch):
    """Return the tracker, without data and in place of the class of each callback."""
    for name in ("begun", "points", "ended"):
        monkeypatch.setattr(Memory, name, [])
    monkeypatch.setattr(callbacks, "_class", lambda *_: Memory)
    return Memory


@pytest.fixture
def tracked(job):
    """Return a function that makes the configuration of a short run with the tracker."""

    def make(name="DQN", **changes):
        configuration = job(name, **changes)
        algorithm = configuration.algorithm.model_copy(update={"callbacks": (Callback(name="a:Memory"),)})
        return configuration.model_copy(update={"algorithm": algorithm})

    return make


def test_a_tracker_gets_every_scalar_of_tensorboard_at_the_same_step(play, tracked, memory, directory):
    """The last evaluation and the confirmation come after the end of learning.

    The tracker must get them too.
    """
    play(tracked("PPO"))

    points = {(name, step): value for step, scalars in memory.points for name, value in scalars.items()}
    curves = EventAccumulator(str(directory.tensorboard)).Reload()
    names = curves.Tags()["scalars"]
    assert {(name, point.step) for name in names for point in curves.Scalars(name)} == points.keys()
    assert [points["eval/mean_reward", point.step] for point in curves.Scalars("eval/mean_reward")] == (
        pytest.approx([point.value for point in curves.Scalars("eval/mean_reward")])
    )
    assert "confirm/success_rate" in names
    assert memory.ended == [len(memory.points)]


def test_a_tracker_gets_the_configuration_with_every_hyperparameter(play, tracked, memory):
    """The configuration includes defaults, because a later release may have other ones."""
    play(tracked())

    run, configuration = memory.begun[0]
    assert run is None
    assert (configuration["job"], configuration["steps"]) == ("corridor", 100)
    assert configuration["algorithm"]["hyperparameters"].keys() >= {"gamma", "buffer_size", "policy_kwargs"}
    assert title_of(configuration) == "corridor-0"


def test_every_attempt_continues_the_same_run_of_the_tracker(play, tracked, memory):
    """The id of the tracker's run is in the run directory, which outlives an attempt."""
    steps = iter(range(1, 1000))
    play(tracked(), on_step=lambda: next(steps) == 42 and os.kill(os.getpid(), signal.SIGTERM))
    play(tracked())

    assert [run for run, _ in memory.begun] == [None, "the-run"]
    assert len(memory.ended) == 2
    assert max(step for step, _ in memory.points) == 100


@pytest.mark.parametrize("tracker", ["wandb:Wandb", "mlflow:MLflow"])
def test_a_tracker_whose_library_is_missing_is_refused_by_name(tracker):
    """The library is checked before a simulator starts, so a person waits only seconds for the error."""
    library, _, _ = tracker.partition(":")
    if importlib.util.find_spec(library):
        pytest.skip(f"{library} is installed")

    with pytest.raises(ConfigurationError, match=f"No module named '{library}'.*; install its package"):
        make_callbacks([Callback(name=f"palaestra_trainer.trackers.{tracker}")])


class UnreachableService(types.ModuleType):
    """A fake of the library of W&B, whose service cannot be reached at the end."""

    Settings = staticmethod(dict)

    def init(self, settings, **_):
        """Return this module as the run."""
        self.settings = settings
        return self

    def define_metric(self, *_, **__):
        """Do nothing, because no metric is shown."""

    def finish(self):
        """Check that a deadline was set; raise the timeout that the library raises after it.

        Without a deadline, the library would wait for ever.
        """
        assert self.settings["finish_timeout"] > 0
        assert self.settings["finish_timeout_raises"]
        raise TimeoutError("Timed out finishing run.")


@pytest.fixture
def wandb_away(monkeypatch):
    """Return the tracker's class with the fake library, for the time of the test."""
    name = "palaestra_trainer.trackers.wandb"
    monkeypatch.setitem(sys.modules, "wandb", UnreachableService("wandb"))
    monkeypatch.setitem(sys.modules, name, None)
    del sys.modules[name]
    return importlib.import_module(name).Wandb


def test_wandb_that_cannot_upload_in_time_ends_with_a_warning_and_the_remedy(wandb_away, directory):
    """A pod must end before the library's own timeout.

    The data is also in the run directory, from which a person can upload it later.
    """
    tracker = wandb_away(mode="online")
    directory.path.mkdir(exist_ok=True)
    tracker.begin(directory, {"job": "corridor", "replica": 0})

    with capture_logs() as lines:
        tracker.end()

    (line,) = lines
    assert line["log_level"] == "warning"
    assert line["event"] == "W&B has not received all data of the run in time"
    assert line["remedy"] == f"wandb sync {directory.path}/wandb/run-*"
