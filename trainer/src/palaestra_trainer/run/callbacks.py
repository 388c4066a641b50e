"""Run the Stable-Baselines3 callbacks of a job's author, in addition to `TrainingCallback`.

A mistake in the job's list of callbacks is found before a simulator starts. The callbacks are called after
`TrainingCallback`, in the order of the job. An exception of a callback ends the run with an error that names
the callback. The state of a callback is not saved, because that would need pickling. So each attempt creates
new callbacks.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import structlog
from stable_baselines3.common.callbacks import (
    BaseCallback,
    CallbackList,
    CheckpointCallback,
    EvalCallback,
    StopTrainingOnNoModelImprovement,
    StopTrainingOnRewardThreshold,
)

from palaestra_trainer.errors import CallbackFailed, ConfigurationError, TrainerError, fact_of
from palaestra_trainer.job.configuration import Callback
from palaestra_trainer.job.user_code import imports
from palaestra_trainer.job.user_code.kwargs import AcceptedArguments

log = structlog.get_logger(__name__)

FIELD = "algorithm.callbacks"
# These callbacks of Stable-Baselines3 evaluate the model, or need an EvalCallback. Each text gives the reason
# of the refusal, and the alternative.
_OF_EVALUATION: Mapping[type[BaseCallback], str] = {
    EvalCallback: "a run evaluates on simulators of its own; set trainer.evaluation",
    StopTrainingOnRewardThreshold: "a run ends at a success rate; set trainer.evaluation.stopAtSuccessRate",
    StopTrainingOnNoModelImprovement: "it works only inside an EvalCallback; write a callback of your own",
}
_CHECKPOINTS = "a run saves checkpoints without it; set trainer.checkpoint.everySteps, or give its arguments"


def make_callbacks(wanted: Sequence[Callback]) -> JobCallbacks:
    """Create the callbacks of a job.

    Raises:
        ConfigurationError: a class cannot be imported, is not a callback, or refuses its options; the message
            has one line for each mistake.
    """
    mistakes: list[str] = []
    made: list[_Named] = []
    for index, callback in enumerate(wanted):
        field = f"{FIELD}[{index}]"
        try:
            cls = _class(f"{field}.name", callback.name)
            _refuse(_about_arguments(field, cls, callback))
            made.append(_Named(callback.name, _made(f"{field}.options", cls, callback)))
        except ConfigurationError as error:
            mistakes.append(str(error))
    _refuse(mistakes)
    return JobCallbacks(made)


class JobCallbacks(CallbackList):
    """The callbacks of a job as one callback.

    `end` calls `_on_training_end` of each callback after the last evaluation and checkpoint, not at the end
    of `learn`. So a callback gets every logged scalar, and is also called at the end of an interrupted
    attempt.

    Attributes:
        stopped_by: name of the callback that ended training by returning False; None: no callback returned
            False.
    """

    def __init__(self, callbacks: Sequence[_Named]) -> None:
        super().__init__(list(callbacks))
        self._named = callbacks
        self._begun = False

    @property
    def stopped_by(self) -> str | None:
        """Name of the first callback that has returned False."""
        return next((callback.name for callback in self._named if callback.stopped), None)

    def end(self) -> None:
        """Call `_on_training_end` of each callback, if training has begun.

        Raises:
            TrainerError: the first error of a callback. The other callbacks are called too, and their errors
                are logged.
        """
        failed = self._end_each()
        _log(failed[1:])
        if failed:
            raise failed[0]

    def end_after_error(self) -> None:
        """Call `_on_training_end` of each callback after another error; only log errors of the callbacks."""
        _log(self._end_each())

    def _end_each(self) -> Sequence[TrainerError]:
        """Call `_on_training_end` of each callback; return their errors in order."""
        failed: list[TrainerError] = []
        for callback in self._named if self._begun else ():
            try:
                callback.on_training_end()
            except TrainerError as error:
                failed.append(error)
        return failed

    def _on_training_start(self) -> None:
        self._begun = True
        super()._on_training_start()

    def _on_training_end(self) -> None:
        """Do nothing, because `end` calls the callbacks."""


class _Named(CallbackList):
    """A wrapper around one callback that adds the callback's name to its errors.

    Attributes:
        name: class of the callback, as the job names it.
        stopped: whether the callback has returned False.
    """

    def __init__(self, name: str, callback: BaseCallback) -> None:
        super().__init__([callback])
        self.name = name
        self.stopped = False

    def _init_callback(self) -> None:
        self._call(super()._init_callback)

    def _on_training_start(self) -> None:
        self._call(super()._on_training_start)

    def _on_rollout_start(self) -> None:
        self._call(super()._on_rollout_start)

    def _on_step(self) -> bool:
        goes_on = bool(self._call(super()._on_step))
        self.stopped = self.stopped or not goes_on
        return goes_on

    def _on_rollout_end(self) -> None:
        self._call(super()._on_rollout_end)

    def _on_training_end(self) -> None:
        self._call(super()._on_training_end)

    def _call(self, method: Callable[[], Any]) -> Any:
        with _naming(self.name):
            return method()


def _log(failed: Iterable[TrainerError]) -> None:
    for error in failed:
        log.error("callback failed after the end of training", fact=str(error), exc_info=error)


@contextmanager
def _naming(name: str) -> Iterator[None]:
    try:
        yield
    except TrainerError:
        raise  # the cause is not the callback, but for example a fault or a signal
    except (Exception, SystemExit) as error:  # code of the job's author may raise anything
        raise CallbackFailed(f"callback {name}: raised {fact_of(error)}") from error


def _refuse(mistakes: Iterable[str]) -> None:
    if lines := list(mistakes):
        raise ConfigurationError("\n".join(lines))


def _about_arguments(field: str, cls: type[BaseCallback], callback: Callback) -> Iterator[str]:
    found = list(AcceptedArguments(cls, callback.name).mistakes(f"{field}.options", callback.options))
    if found and cls is CheckpointCallback:
        yield f"{field}.name: {_CHECKPOINTS}"
    yield from found


def _class(field: str, name: str) -> type[BaseCallback]:
    if not imports.names_class(name):
        raise ConfigurationError(f"{field}: {name} does not name a class; write it as module:Class")
    cls = imports.class_named(name, field, BaseCallback)
    if cls in _OF_EVALUATION:
        raise ConfigurationError(f"{field}: {name} is refused: {_OF_EVALUATION[cls]}")
    if inspect.isabstract(cls):
        raise ConfigurationError(f"{field}: {name} has no _on_step; add this method")
    return cls


def _made(field: str, cls: type[BaseCallback], callback: Callback) -> BaseCallback:
    try:
        return cls(**callback.options)
    except Exception as error:  # a constructor of the job's author may raise anything
        raise ConfigurationError(
            f"{field}: {callback.name} refuses its arguments ({fact_of(error)}); change them"
        ) from error
