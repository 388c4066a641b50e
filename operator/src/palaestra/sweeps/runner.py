"""The loop of a sweep: begin trials while the backend accepts them, read their figures, record their ends."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from palaestra.errors import PalaestraError
from palaestra.sweeps import trial_log
from palaestra.sweeps.model import Objective
from palaestra.sweeps.search import Search
from palaestra.sweeps.table import WORDS
from palaestra.sweeps.trial import Trial, TrialFigures, TrialProgress


class TrialBackend(Protocol):
    """The interface of a backend that runs trials."""

    def has_room(self) -> bool:
        """Return whether another trial can begin."""
        ...

    def begin(self, trial: Trial) -> None:
        """Begin a trial, or resume it."""
        ...

    def wait(self) -> None:
        """Wait until the figures of a trial may have changed."""
        ...

    def look(self, trial: Trial) -> TrialFigures:
        """Return the figures of a trial that was begun."""
        ...

    def prune(self, trial: Trial) -> None:
        """End a trial that is not worth continuing."""
        ...


class NoSuccess(PalaestraError):
    """A sweep compares success rates, but its environment does not report success."""


def carry_out(
    search: Search, place: TrialBackend, folder: Path, objective: Objective, report: Callable[[str], object]
) -> None:
    """Run trials until the search has no further trial.

    Args:
        search: chooses the trials.
        place: the backend that runs the trials.
        folder: the folder of the sweep; each trial that ends is recorded there.
        objective: the figure by which trials are compared.
        report: called with a line for each trial that begins or ends.

    Raises:
        NoSuccess: the objective is the success rate, but an evaluated trial has no success rate.
    """
    active: dict[int, Trial] = {}
    for figures in trial_log.ended(folder).values():
        _refuse_without_success(figures, objective)
    while True:
        while place.has_room() and (trial := search.next()) is not None:
            active[trial.number] = trial
            report(f"{trial.name}: {_shown(trial)}")
            place.begin(trial)
        if not active and place.has_room():  # if the backend has no room, a pruned trial still runs
            return
        place.wait()
        for trial in tuple(active.values()):
            figures = place.look(trial)
            if figures.state is TrialProgress.RUNNING and search.hopeless(trial, figures):
                place.prune(trial)
                figures = replace(figures, state=TrialProgress.PRUNED)
            if figures.state is not TrialProgress.RUNNING:
                trial_log.note(folder, trial.number, figures)
                search.learn(trial, figures)
                del active[trial.number]
                report("; ".join(_ending(trial, figures, objective, search.left + len(active))))
            _refuse_without_success(figures, objective)


def _refuse_without_success(figures: TrialFigures, objective: Objective) -> None:
    """Check that the figures can be compared, or do not exist yet; raise NoSuccess otherwise."""
    if objective is Objective.SUCCESS_RATE and figures.lacks(objective):
        raise NoSuccess(
            "spec.objective: is SuccessRate, but the environment reports no success; write "
            "objective: MeanReturn, or set is_success in the info of an episode's last step"
        )


def _ending(trial: Trial, figures: TrialFigures, objective: Objective, left: int) -> Iterator[str]:
    """Yield state, reasons of failed runs, and result of a trial, and the number of remaining trials."""
    yield f"{trial.name}: {figures.state}"
    yield from figures.reasons()
    if (value := figures.median(objective)) is not None:
        yield f"{WORDS[objective]} {value:.3g}"
    yield f"{left} trial{'s' * (left != 1)} left"


def _shown(trial: Trial) -> str:
    return ", ".join(f"{field} = {value}" for field, value in trial.changes.items())
