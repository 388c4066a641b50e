"""The loop of a sweep: begin trials where there is room, look at them, note those that have ended."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from palaestra.sweeps import ledger
from palaestra.sweeps.searching import Search
from palaestra.sweeps.trial import Figures, State, Trial


class Place(Protocol):
    """Where trials run."""

    def has_room(self) -> bool:
        """Return whether another trial can begin."""
        ...

    def begin(self, trial: Trial) -> None:
        """Begin a trial, or resume it."""
        ...

    def wait(self) -> None:
        """Return when a trial may have changed."""
        ...

    def look(self, trial: Trial) -> Figures:
        """Return the figures of a trial that was begun."""
        ...

    def prune(self, trial: Trial) -> None:
        """End a trial that is not worth going on."""
        ...


def carry_out(search: Search, place: Place, folder: Path, report: Callable[[str], object]) -> None:
    """Run trials until the search has no more.

    Args:
        search: chooses the trials.
        place: runs them.
        folder: that of the sweep; each trial that ends is noted there.
        report: is called with a line for each trial that begins or ends.
    """
    active: dict[int, Trial] = {}
    while True:
        while place.has_room() and (trial := search.next()) is not None:
            active[trial.number] = trial
            report(f"{trial.name}: {_shown(trial)}")
            place.begin(trial)
        if not active and place.has_room():  # without room, a pruned trial is still ending
            return
        place.wait()
        for trial in tuple(active.values()):
            figures = place.look(trial)
            if figures.state is State.RUNNING and search.hopeless(trial, figures):
                place.prune(trial)
                figures = replace(figures, state=State.PRUNED)
            if figures.state is not State.RUNNING:
                ledger.note(folder, trial.number, figures)
                search.learn(trial, figures)
                report("; ".join([f"{trial.name}: {figures.state}", *figures.reasons()]))
                del active[trial.number]


def _shown(trial: Trial) -> str:
    return ", ".join(f"{field} = {value}" for field, value in trial.changes.items())
