"""The results of checks of worlds before the plan.

The check of a large world takes seconds, so the operator runs it in another process. A plan only looks up the
result, by a digest of the world and of its field, which is the name of the world in messages.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from palaestra.errors import WorldCheckTooCostly, WorldRefused, WorldUnchecked


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldVerdict:
    """The result of the check of one world.

    Attributes:
        problem: the message of the refusal; "": the world is valid.
        too_costly: whether the check was ended because it exceeded its budget.
    """

    problem: str = ""
    too_costly: bool = False


Verdicts = Mapping[str, WorldVerdict]  # by the digests of worlds


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenWorld:
    """A world that the author of a job wrote: its field in the spec, and its bytes."""

    field: str
    source: bytes

    @property
    def digest(self) -> str:
        """Return the key of its verdict."""
        return hashlib.sha256(b"\0".join((self.field.encode(), self.source))).hexdigest()


def require_fine(worlds: Mapping[str, GivenWorld], verdicts: Verdicts) -> None:
    """Check that every world has a verdict and is not refused; `worlds` are by digest.

    Raises:
        WorldCheckTooCostly: a check exceeded its budget.
        WorldRefused: a world is wrong.
        WorldUnchecked: a world has no verdict yet.
    """
    for digest in worlds:
        verdict = verdicts.get(digest)
        if verdict is not None and verdict.problem:
            raise (WorldCheckTooCostly if verdict.too_costly else WorldRefused)(verdict.problem)
    for digest, world in worlds.items():
        if digest not in verdicts:
            raise WorldUnchecked(world.field)
