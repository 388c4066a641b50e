"""Every recorded plan is what the plan is now; `make golden` records them anew."""

import runpy
from pathlib import Path

import pytest

HERE = Path(__file__).parent
RECORDED = dict(runpy.run_path(str(HERE / "__main__.py"), run_name="golden")["recorded"]())


@pytest.mark.parametrize("path", RECORDED, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_generated_file_is_current(path):
    """A plan is read in review as what it is: the objects that a cluster will get."""
    assert path.read_text() == RECORDED[path], "not current; run `make golden` and read the diff"


def test_no_recorded_plan_is_without_its_example():
    """A plan that nothing makes any more would be believed."""
    assert set(HERE.glob("*.yaml")) <= RECORDED.keys()
