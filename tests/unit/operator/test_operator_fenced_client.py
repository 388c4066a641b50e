"""The client that writes only while the operator leads, and the merge patch of a status."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.operator.fenced_client import FencedClient, NotLeading, difference

LEAVES = st.integers() | st.text(max_size=3) | st.lists(st.integers(), max_size=2)
OBJECTS = st.recursive(
    st.dictionaries(st.sampled_from("abc"), LEAVES, max_size=3),
    lambda inner: st.dictionaries(st.sampled_from("abc"), LEAVES | inner, max_size=3),
    max_leaves=8,
)


def merged(target, patch):
    """Return the result of a merge patch, computed as in an API server (RFC 7386)."""
    if not isinstance(patch, dict):
        return patch
    result = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            result.pop(key, None)
        else:
            result[key] = merged(result.get(key), value)
    return result


@given(OBJECTS, OBJECTS)
def test_a_patch_makes_the_old_status_into_the_new(old, new):
    """A merge patch keeps the fields that it does not contain, so it must set removed fields to null."""
    assert merged(old, difference(old, new)) == new


@given(OBJECTS)
def test_a_status_that_did_not_change_needs_no_patch(status):
    """With an empty patch the operator sends no request."""
    assert difference(status, status) == {}


def test_a_job_without_a_status_gets_all_of_it():
    """Before the first write the API server has no status."""
    assert difference(None, {"phase": "Pending"}) == {"phase": "Pending"}


class Server:
    """An API server that counts deletions."""

    deleted = 0

    def delete(self, *_, **__):
        """Count a deletion."""
        self.deleted += 1


def delete(writer):
    """Delete an object with the fenced client."""
    writer.delete(None, "robots", "job", uid="u", version="1")


@pytest.mark.parametrize("later", [None, 2], ids=["lost", "lost and regained"])
def test_what_was_decided_in_one_tenure_is_not_written_in_another(later):
    """Another operator may have led in the meantime and decided otherwise."""
    api, terms = Server(), [1]
    writer = FencedClient(api, lambda: terms[-1])
    writer.begin()
    delete(writer)
    terms.append(later)

    with pytest.raises(NotLeading):
        delete(writer)

    assert api.deleted == 1


def test_a_look_that_begins_after_the_lease_was_regained_may_write():
    """A reconcile that starts after the lease was regained has read the changes of the other operator."""
    api, terms = Server(), [1]
    writer = FencedClient(api, lambda: terms[-1])
    writer.begin()
    terms.append(2)

    writer.begin()
    delete(writer)

    assert api.deleted == 1
