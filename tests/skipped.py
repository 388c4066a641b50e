"""A summary of a run's skipped tests: their number, and the command that builds missing programs."""

from collections import Counter
from collections.abc import Iterable, Iterator

# `control_plane.programs` writes this command, followed by names of programs, into reasons to skip.
BUILD = "tests/cluster/programs.sh"
BUILDING = "builds them once, in 15 to 30 minutes"


def lines(reasons: Iterable[str]) -> Iterator[str]:
    """Yield one line for all tests that lack programs of a cluster, and one line for each other reason."""
    counts = Counter(reasons)
    programs = {
        reason: words.split() for reason in counts for words in [reason.partition(f"{BUILD} ")[2]] if words
    }
    if programs:
        number = sum(counts[reason] for reason in programs)
        names = " ".join(dict.fromkeys(name for words in programs.values() for name in words))
        yield f"{number} tests need programs of a cluster; `{BUILD} {names}` {BUILDING}"
    for reason, number in counts.items():
        if reason not in programs:
            yield f"{number} {'test' if number == 1 else 'tests'}: {reason}"
