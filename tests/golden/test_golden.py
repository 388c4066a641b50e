"""Every recorded plan is what the plan is now; `make golden` records them anew."""

import runpy
from functools import cache
from pathlib import Path

from tests.tables import for_each

HERE = Path(__file__).parent


@cache
def recorded():
    """Return the text that belongs into each generated file, by its path."""
    return dict(runpy.run_path(str(HERE / "__main__.py"), run_name="golden")["recorded"]())


@for_each("path, text", lambda: recorded().items())
def test_a_generated_file_is_current(path, text):
    """A plan is read in review as what it is: the objects that a cluster will get."""
    assert path.read_text() == text, "not current; run `make golden` and read the diff"


def test_no_recorded_plan_is_without_its_example():
    """A plan that nothing makes any more would be believed."""
    assert set(HERE.glob("*.yaml")) <= recorded().keys()
