"""The difference between two plans is short and readable, and shows every change."""

from functools import cache

from hypothesis import given
from hypothesis import strategies as st

from tests.golden import plans
from tests.golden.difference import difference

TWO = """\
kind: Job
spec:
  containers:
  - name: first
    image: a
    env:
    - name: SIZE
      value: '1'
  - name: second
    image: a
    env:
    - name: SIZE
      value: '1'
"""


def test_a_hunk_is_headed_by_the_place_of_its_first_change():
    """A line number would change whenever a line above is added, in every recorded difference."""
    now = TWO.replace("second\n    image: a", "second\n    image: b")

    assert "".join(difference(TWO, now)) == (
        "@@ Job spec.containers.second @@\n   - name: second\n-    image: a\n+    image: b\n     env:\n"
    )


def test_a_new_container_is_one_hunk():
    """Containers have equal fields, and difflib alone would split the new one among its neighbors."""
    added = "  - name: added\n    image: a\n    env:\n    - name: SIZE\n      value: '1'\n"
    now = TWO.replace("  - name: second\n", f"{added}  - name: second\n")

    [hunk] = difference(TWO, now)

    assert hunk.count("\n+") == added.count("\n")
    assert "\n-" not in hunk


def test_equal_objects_of_a_kind_are_different_places():
    """Each replica has a Job, so a reader must see which Job changed."""
    [hunk] = difference(f"{TWO}---\n{TWO}", f"{TWO}---\n{TWO.replace('image: a', 'image: b', 1)}")

    assert hunk.startswith("@@ Job 2 spec.containers.first @@\n")


def test_equal_plans_have_no_difference():
    """For a plan that equals the smallest job's plan, the recorded file exists and is empty."""
    assert list(difference(TWO, TWO)) == []


@cache
def pairs(name):
    """Return the compared plans of an example, by layout."""
    return plans.plans_of(name)


EDITS = {
    "changed": lambda line: [f"{line}0"],
    "doubled": lambda line: [line, line],
    "indented": lambda line: [f" {line}"],
    "removed": lambda _: [],
}


@given(
    st.sampled_from(plans.examples()),
    st.sampled_from(plans.LAYOUTS),
    st.sampled_from(sorted(EDITS)),
    st.randoms(use_true_random=False),
)
def test_a_change_of_any_line_of_an_example_s_plan_changes_what_is_recorded(name, layout, edit, chance):
    """The tests compare only recorded differences, so each change of a plan must change its difference."""
    before, now = pairs(name)[layout]
    lines = now.splitlines()
    number = chance.choice([number for number, line in enumerate(lines) if line != "---"])
    lines[number : number + 1] = EDITS[edit](lines[number])
    edited = {**pairs(name), layout: (before, "\n".join(lines))}

    assert plans.compared(name, edited) != plans.compared(name, pairs(name))
