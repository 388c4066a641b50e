"""How long anything between the operator and the API server may take."""

from dataclasses import dataclass, field

from palaestra.cluster.backoff import Backoff


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Deadlines, in seconds; one place for all of them.

    Attributes:
        connect_s: until a connection stands.
        call_s: for one request and its whole answer, waiting on a busy server included.
        watch_s: shortest and longest life of one watch; between them by chance, so that not all end at once.
        silence_s: longest silence on a watch. An API server sends a bookmark about every 60 s, so more than
            that means a connection that only looks alive.
        again: waits between attempts to list and watch.
        turned_away: waits after an answer 429, added to those that the server asks for, which may be none.
    """

    connect_s: float = 5.0
    call_s: float = 10.0
    watch_s: tuple[float, float] = (300.0, 600.0)
    silence_s: float = 90.0
    again: Backoff = field(default_factory=lambda: Backoff(first_s=0.5, cap_s=30.0))
    turned_away: Backoff = field(default_factory=lambda: Backoff(first_s=0.2, cap_s=2.0))
