"""A text in YAML is read back unchanged, so the texts of a job's author stay texts."""

import re

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from palaestra.plan.yaml_text import as_yaml, literal

BREAKS = ["\n", "\r", "\r\n", "\x85", "\u2028", "\u2029"]
WORDS = st.sampled_from(
    [*BREAKS, "a: b", "- c", "}", '"', "'", "# d", "|", "\t", " ", "é", "\ufeff", "5e-4", "no"]
)


@given(st.lists(WORDS | st.text(max_size=3), max_size=8).map("".join))
def test_a_text_is_read_back_as_it_was(text):
    """A text may be a key, and may contain any character that YAML treats as a line break."""
    document = {"text": text, text: [text]}

    assert yaml.safe_load(as_yaml([document])) == document


@pytest.mark.parametrize("end", BREAKS)
def test_no_end_of_a_line_ends_the_text(end):
    """After a line break the rest of the text would become another field of the plan."""
    document = {"options": [f"a{end}simulators: []"]}

    assert yaml.safe_load(as_yaml([document])) == document


def expanded(text):
    """Return a text after a kubelet's expansion of variables.

    Source: k8s.io/kubernetes/third_party/forked/golang/expansion.
    """
    return re.sub(r"\$(\$)|\$\(([^)]*)\)", lambda found: found[1] or "of another", text)


@given(st.text(alphabet="$()aB_ ", max_size=12))
def test_a_text_comes_through_a_kubelet_as_it_is(text):
    """A kubelet would replace `$(NAME)` in the text by the value of a variable."""
    assert expanded(literal(text)) == text
