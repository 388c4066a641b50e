"""The order of trials: the choice of the next trial, and the decision to prune a trial."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from palaestra.sweeps.trial import Trial, TrialFigures, TrialProgress


class Search(Protocol):
    """Chooses trials; the choice may depend on the results of ended trials."""

    @property
    def known(self) -> Sequence[Trial]:
        """Return all known trials, in order."""
        ...

    @property
    def left(self) -> int:
        """Return the number of trials that `next` has not returned yet."""
        ...

    def next(self) -> Trial | None:
        """Return the next trial; None if no trial is left, or if a running trial must end first."""
        ...

    def hopeless(self, trial: Trial, figures: TrialFigures) -> bool:
        """Return whether a running trial should be pruned."""
        ...

    def learn(self, trial: Trial, figures: TrialFigures) -> None:
        """Record the end of a trial."""
        ...


class InTurn:
    """A search that returns the trials of a list in order, without the trials that were completed before."""

    def __init__(self, trials: Iterable[Trial], ended: Mapping[int, TrialFigures]) -> None:
        self.known: Sequence[Trial] = tuple(trials)
        self._left: deque[Trial] = deque(
            trial
            for trial in self.known
            if not (old := ended.get(trial.number)) or old.state is TrialProgress.FAILED
        )

    @property
    def left(self) -> int:
        """Return the number of trials that were not begun."""
        return len(self._left)

    def next(self) -> Trial | None:
        """Return the next trial."""
        return self._left.popleft() if self._left else None

    def hopeless(self, trial: Trial, figures: TrialFigures) -> bool:
        """Return False, because every trial is run to its end."""
        del trial, figures
        return False

    def learn(self, trial: Trial, figures: TrialFigures) -> None:
        """Do nothing, because results do not change the list."""
