"""A search by Optuna, which suggests trials based on earlier results, and prunes trials.

The search is stored in a journal file, so the same command continues the search. A trial that was running
when the search was interrupted is suggested again with its old number, and its runs resume.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState

from palaestra.sweeps import grid
from palaestra.sweeps.model import Distribution, Optuna, Sweep
from palaestra.sweeps.trial import Trial, TrialFigures, TrialProgress

JOURNAL = "optuna.journal"
NUMBER = "trial"  # attribute of an Optuna trial: its number in the sweep, which a resumed trial keeps


class OptunaSearch:
    """The trials that Optuna suggests."""

    def __init__(self, sweep: Sweep, folder: Path) -> None:
        """Open the journal in the sweep's folder; create it if it does not exist.

        Raises:
            SpecErrors: the job of a trial is invalid; the error lists every problem.
        """
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._sweep = sweep
        first = grid.trial(sweep, 0, next(grid.probes(sweep)))
        self._every = first.job.spec.trainer.evaluation.every_steps
        self._space = {field: _space(values) for field, values in sweep.spec.random.items()}
        self._study = _study(sweep, folder)
        self._asked: dict[int, optuna.Trial] = {}
        self._reported: dict[int, set[int]] = {}
        self._known: dict[int, Trial] = {}
        for old in self._study.get_trials(deepcopy=False):
            self._know(old.user_attrs.get(NUMBER), _values(old))
        self._suggest_again()

    @property
    def known(self) -> Sequence[Trial]:
        """Return all suggested trials, in order."""
        return [self._known[number] for number in sorted(self._known)]

    @property
    def left(self) -> int:
        """Return the number of trials that the search must still suggest, including interrupted trials."""
        waits = self._study.get_trials(deepcopy=False, states=(TrialState.WAITING,))
        return len(waits) + max((self._sweep.spec.trials or 0) - len(self._known), 0)

    def next(self) -> Trial | None:
        """Return the next trial; None if all trials of the sweep were suggested."""
        if not self.left:
            return None
        asked = self._study.ask(self._space)
        number = asked.user_attrs.get(NUMBER, len(self._known))
        asked.set_user_attr(NUMBER, number)
        self._asked[number] = asked
        return self._know(number, asked.params)

    def hopeless(self, trial: Trial, figures: TrialFigures) -> bool:
        """Report the current medians over the seeds; return whether Optuna prunes the trial."""
        self._report(trial, figures)
        return self._asked[trial.number].should_prune()

    def learn(self, trial: Trial, figures: TrialFigures) -> None:
        """Report the median result to Optuna; a trial without a result counts as failed."""
        self._report(trial, figures)  # a short trial may end before its figures were reported
        asked, value = self._asked.pop(trial.number), figures.median(self._sweep.spec.objective)
        if figures.state is TrialProgress.PRUNED:
            self._study.tell(asked, state=TrialState.PRUNED)
        elif figures.state is TrialProgress.COMPLETE and value is not None:
            self._study.tell(asked, value)
        else:
            self._study.tell(asked, state=TrialState.FAIL)

    def _suggest_again(self) -> None:
        """Enqueue each trial that was running; drop trials without a number, which were never begun."""
        waits = self._study.get_trials(states=(TrialState.WAITING,))
        enqueued = {old.user_attrs.get(NUMBER) for old in waits}
        for running in self._study.get_trials(states=(TrialState.RUNNING,)):
            # If the process is killed between the next two writes to the study, the old and the new trial
            # exist. The next start then ends the old trial.
            if running.user_attrs.get(NUMBER) not in {None, *enqueued}:
                self._study.enqueue_trial(_values(running), user_attrs=running.user_attrs)
            self._study.tell(running.number, state=TrialState.FAIL)

    def _report(self, trial: Trial, figures: TrialFigures) -> None:
        """Report the new medians over the seeds to Optuna.

        Optuna compares a trial only with figures of other trials at an equal step. So all trials report at
        the same steps: the multiples of the job's `evaluation.everySteps`.
        """
        asked, reported = self._asked[trial.number], self._reported.setdefault(trial.number, set())
        objective = self._sweep.spec.objective
        # A user's own program may report success rates although `everySteps` is 0.
        medians = figures.on_grid(self._every, objective) if self._every else figures.common(objective)
        for step, value in medians.items():
            if step not in reported:
                asked.report(value, step)
                reported.add(step)

    def _know(self, number: int | None, values: Mapping[str, Any]) -> Trial | None:
        """Store and return the trial with a number; None if it was interrupted before it got a number."""
        if number is None:
            return None
        self._known[number] = grid.trial(self._sweep, number, dict(values))
        return self._known[number]


def _study(sweep: Sweep, folder: Path) -> optuna.Study:
    storage = JournalStorage(JournalFileBackend(str(folder / JOURNAL)))
    wanted = sweep.spec.optuna or Optuna()
    pruner: optuna.pruners.BasePruner = optuna.pruners.NopPruner()
    if wanted.prune:
        pruner = optuna.pruners.MedianPruner(
            n_startup_trials=wanted.startup_trials, n_warmup_steps=wanted.warmup_steps
        )
    study = optuna.create_study(
        study_name=sweep.metadata.name,
        storage=storage,
        direction="maximize",
        pruner=pruner,
        load_if_exists=True,
    )
    # A resumed search needs another seed: a sampler with the same seed would suggest its first trials again.
    seed = sweep.spec.seed + len(study.get_trials(deepcopy=False))
    study.sampler = optuna.samplers.TPESampler(seed=seed, n_startup_trials=wanted.startup_trials)
    return study


def _values(trial: optuna.trial.FrozenTrial) -> dict[str, Any]:
    """Return the values of a trial, including the fixed values of an enqueued trial."""
    return {**trial.system_attrs.get("fixed_params", {}), **trial.params}


def _space(values: Distribution) -> BaseDistribution:
    if values.choice is not None:
        return CategoricalDistribution(values.choice)
    if values.whole:
        return IntDistribution(int(values.low or 0), int(values.high or 0), log=values.log)
    return FloatDistribution(float(values.low or 0), float(values.high or 0), log=values.log)
