"""The order in which the worlds of jobs are checked: namespaces take turns, one job each.

Each namespace has at most one job under check, so many jobs in one namespace do not delay other namespaces.
"""

import threading
from collections.abc import Sequence
from dataclasses import dataclass

from palaestra.objects import Key
from palaestra.plan import GivenWorld


@dataclass(slots=True, kw_only=True)
class Turn:
    """The turn of a job; `worlds` is None until the job's next reconcile passes them to `hand_over`."""

    key: Key
    worlds: Sequence[GivenWorld] | None = None


class FairQueue:
    """A queue of jobs for each namespace; safe to use from several threads."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        # The waiting jobs of each namespace. The first namespace has the next turn.
        self._lines: dict[str, dict[Key, None]] = {}
        self._turns: dict[Key, Turn] = {}
        self._closed = False

    def waits(self, key: Key) -> bool:
        """Return whether a job is queued or under check; if not, pass its worlds to `hand_over`."""
        with self._changed:
            turn = self._turns.get(key)
            return turn.worlds is not None if turn is not None else key in self._lines.get(key[0], ())

    def hand_over(self, key: Key, worlds: Sequence[GivenWorld]) -> None:
        """Pass the unchecked worlds of a job; if the job has no turn now, queue it."""
        with self._changed:
            turn = self._turns.get(key)
            if turn is not None and turn.worlds is None:
                turn.worlds = worlds
            elif turn is None and worlds:
                self._lines.setdefault(key[0], {})[key] = None
            elif not worlds:
                self._leave(key)
            self._changed.notify_all()

    def next(self) -> Turn | None:
        """Wait for the next turn, begin it and return it; return None after `close`. Call `end` later."""
        with self._changed:
            while not self._closed:
                busy = {key[0] for key in self._turns}
                namespace = next((name for name in self._lines if name not in busy), None)
                if namespace is not None:
                    return self._begin(namespace)
                self._changed.wait()
            return None

    def handed(self, turn: Turn, deadline_s: float) -> Sequence[GivenWorld]:
        """Return the worlds of a turn; empty if `hand_over` did not pass them within `deadline_s`."""
        with self._changed:
            self._changed.wait_for(lambda: turn.worlds is not None or self._closed, deadline_s)
            return turn.worlds or ()

    def end(self, turn: Turn) -> None:
        """End a turn, so that the next turn of the same namespace can begin."""
        with self._changed:
            self._turns.pop(turn.key, None)
            self._changed.notify_all()

    def close(self) -> None:
        """Close the queue: no further turn begins, and waiting calls return."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _begin(self, namespace: str) -> Turn:
        line = self._lines.pop(namespace)
        turn = Turn(key=next(iter(line)))
        self._turns[turn.key] = turn
        del line[turn.key]
        if line:
            self._lines[namespace] = line  # the namespace is now behind all other namespaces
        return turn

    def _leave(self, key: Key) -> None:
        line = self._lines.get(key[0], {})
        line.pop(key, None)
        if not line:
            self._lines.pop(key[0], None)
