"""Every recorded plan and every generated file is up to date; `make golden` writes them again."""

import runpy
from difflib import unified_diff
from functools import cache
from itertools import islice

from tests.golden import plans
from tests.tables import for_each

ROOT = plans.HERE.parents[1]
MOST_LINES = 40  # a message shows no more lines, because after `make golden` git shows all of them


@cache
def recorded():
    """Return the content of each generated file, by path."""
    return dict(runpy.run_path(str(plans.HERE / "__main__.py"), run_name="golden")["recorded"]())


def change_of(path):
    """Return the difference between a file and its generated content, as lines; empty if there is none."""
    before, now = path.read_text() if path.exists() else "", recorded()[path]
    return list(unified_diff(before.splitlines(), now.splitlines(), "recorded", "now", lineterm=""))


@for_each("path", recorded)
def test_a_generated_file_is_current(path):
    """A reviewer reads the recorded plans to see which objects a cluster gets, so they must be up to date."""
    change = change_of(path)
    shown = "\n".join(islice(change, MOST_LINES))

    assert not change, f"{path.relative_to(ROOT)} is not current; run `make golden`, read its diff:\n{shown}"


def test_every_recorded_plan_has_its_example_or_case():
    """A reader would trust a recorded plan even though no code produces it any more."""
    assert plans.on_disk() <= recorded().keys()


@for_each("job", plans.cases)
def test_a_case_says_what_it_shows_and_shows_it(job):
    """A reader learns the purpose of a case from its caption. A case without a difference shows nothing."""
    caption, _, fields = job.read_text().partition("\n")

    assert caption.startswith("# ")
    assert fields.startswith("spec:")
    assert "@@" in plans.plan_of(job).read_text()


@for_each("name, layout", lambda: [(name, layout) for name in plans.examples() for layout in plans.LAYOUTS])
def test_the_name_of_a_job_changes_nothing_in_its_plan_but_the_name(name, layout):
    """The recorded difference of an example compares two plans under one name, so only names may differ."""
    smallest = plans.example(plans.SMALLEST)
    whole = plans.comparable(smallest, layout)
    in_ros = name.replace("-", "_")

    plan = plans.comparable(plans.renamed(smallest, name), layout)

    assert plan == whole.replace(f"{plans.SMALLEST}_r", f"{in_ros}_r").replace(plans.SMALLEST, name)
