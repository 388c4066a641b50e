"""The comparison of end states ignores the values that always differ between two runs."""

from tests.faults.masks import differences, leaves, mask, shaped

UID = "0b1c2d3e-0000-4000-8000-00000000000a"
STATE = {
    "metadata": {"name": "job", "uid": UID, "resourceVersion": "17", "namespace": "place-3-5959"},
    "status": {
        "restarts": {"trainer": 1},
        "activeSeconds": 4,
        "replicas": [{"index": 0, "pod": "job-0-x7k2p", "message": "waited 17 s"}],
        "conditions": [{"type": "Running", "status": "True", "lastTransitionTime": "2026-01-31T12:00:00Z"}],
    },
}


def test_times_uids_and_made_up_names_are_replaced_by_their_shape():
    """Times, uids and generated names are different in every run."""
    assert shaped(f"{UID} at 2026-01-31T12:00:00Z in place-3-5959: pod job-0-x7k2p, 127.90.91.3") == (
        "<uid> at <time> in <namespace>: pod job-0-<pod>, <address>"
    )


def test_leaves_are_named_by_what_a_list_member_is_called():
    """A path contains the type of a condition instead of its index, so the order of conditions is ignored."""
    assert leaves(STATE) == {
        "/metadata/name": "job",
        "/metadata/uid": "<uid>",
        "/metadata/namespace": "<namespace>",
        "/status/restarts/trainer": 1,
        "/status/activeSeconds": "<seconds>",
        "/status/replicas/[0]/index": 0,
        "/status/replicas/[0]/pod": "job-0-<pod>",
        "/status/replicas/[0]/message": "waited <number> s",
        "/status/conditions/[Running]/type": "Running",
        "/status/conditions/[Running]/status": "True",
        "/status/conditions/[Running]/lastTransitionTime": "<time>",
    }


def test_what_differs_between_two_undisturbed_runs_is_masked():
    """A poll changes some fields by chance. The mask is measured, so that nobody has to list these fields."""
    masked = mask({"/step": 3, "/phase": "Failed"}, {"/step": 4, "/phase": "Failed"})

    assert masked == {"/step"}
    assert differences({"/step": 3}, {"/step": 5}, masked) == []


def test_a_counter_that_differs_is_said_with_both_values():
    """The fault tests search for bugs of the operator, such as a restart that is counted twice."""
    assert differences({"/trainer": 1}, {"/trainer": 2}, frozenset()) == ["/trainer: 2 in place of 1"]


def test_what_is_missing_or_new_is_a_difference():
    """A missing field differs from every value, even from null."""
    assert differences({"/a": None}, {}, frozenset()) == ["/a: nothing in place of None"]
    assert differences({}, {"/a": 1}, frozenset()) == ["/a: 1 in place of nothing"]
