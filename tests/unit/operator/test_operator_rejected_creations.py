"""The operator remembers a refusal until the request succeeds, and ignores temporary errors."""

import pytest

from palaestra.cluster import Forbidden, Invalid, ServerError, TooManyRequests, Unreachable
from palaestra.observe.json_access import MOST_TEXT
from palaestra.operator.unwatched_facts import RejectedCreations

KEY, UID = ("robots", "job"), "u"
QUOTA = Forbidden(403, "Forbidden", "exceeded quota")
BUDGET = "Cannot evict pod as it would violate the pod's disruption budget."
WEBHOOK = "Internal error occurred: failed calling webhook x"


@pytest.mark.parametrize(
    "error",
    [
        QUOTA,
        Invalid(400, "BadRequest", "denied"),
        ServerError(500, "InternalError", WEBHOOK),
        TooManyRequests(429, "TooManyRequests", BUDGET),
    ],
)
def test_a_refusal_that_a_person_has_to_fix_is_kept_until_the_request_succeeds(error):
    """Until the cause is gone, the status must quote the message of the API server or the webhook."""
    denials = RejectedCreations()

    denials.learn(KEY, UID, {1: error})
    assert denials.known(KEY, UID) == {1: error.message}
    denials.learn(KEY, UID, {})

    assert denials.known(KEY, UID) == {}


@pytest.mark.parametrize(
    "error",
    [
        TooManyRequests(429, "TooManyRequests", "busy"),
        Unreachable(0, "Unreachable", "no answer"),
        ServerError(500, "InternalError", "etcdserver: leader changed"),
    ],
)
def test_what_passes_by_itself_changes_nothing(error):
    """A temporary error is not shown to the user, and does not replace an earlier refusal."""
    denials = RejectedCreations()

    denials.learn(KEY, UID, {1: error})
    assert denials.known(KEY, UID) == {}
    denials.learn(KEY, UID, {1: QUOTA})
    denials.learn(KEY, UID, {1: error})

    assert denials.known(KEY, UID) == {1: "exceeded quota"}


def test_words_are_kept_as_long_as_the_status_shows_them():
    """A webhook may send a whole page, of which the status shows only the beginning."""
    denials = RejectedCreations()

    denials.learn(KEY, UID, {0: Forbidden(403, "Forbidden", "no " * 100_000)})

    assert len(denials.known(KEY, UID)[0]) == MOST_TEXT
