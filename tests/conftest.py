"""In which order tests run, on how many threads, and that no unit test is about time."""

import gc
import os

import pytest
from hypothesis import HealthCheck, settings

# Networks of this size learn faster on one thread than on several, which wait for each other; read by torch.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# A property is not about time, and machines are noisy: what is slow is told by --durations.
settings.register_profile("explore", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# The same examples each time: whoever changes something else does not meet what chance has found.
settings.register_profile("repeat", settings.get_profile("explore"), derandomize=True)
settings.load_profile("repeat")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes longest, so that no worker is left alone with it at the end."""
    items.sort(key=_minutes, reverse=True)


def pytest_collection_finish() -> None:
    """Let garbage collections pass over what is imported and collected by now: it stays, and it is much."""
    gc.freeze()


def _minutes(item: pytest.Item) -> float:
    mark = item.get_closest_marker("minutes")
    return mark.args[0] if mark else 0
