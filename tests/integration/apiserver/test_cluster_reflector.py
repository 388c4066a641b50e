"""The cache survives an API server that misbehaves: it finds the true state, without too many requests."""

import threading
import time

import pytest

from palaestra.cluster import Reflector
from palaestra.cluster.resources import CONFIG_MAPS, PODS
from tests.integration.apiserver.server import hang, raw, refusal, reply, stream


def pod(name, version="1"):
    """Return a pod as the API server sends it; a pod with the name `bad` causes an error in `keep`."""
    return {"metadata": {"name": name, "namespace": "n", "resourceVersion": version, "labels": {}}}


def listed(*names, version="10"):
    """Return the response to a list request, with pods of these names."""
    return reply(obj={"metadata": {"resourceVersion": version}, "items": [pod(name) for name in names]})


def added(name, version):
    """Return the event for a new pod."""
    return {"type": "ADDED", "object": pod(name, version)}


def bookmark(version):
    """Return an event that contains only the current version."""
    return {"type": "BOOKMARK", "object": {"metadata": {"resourceVersion": version}}}


EXPIRED = {
    "type": "ERROR",
    "object": {"kind": "Status", "code": 410, "reason": "Expired", "message": "too old"},
}


class Followed:
    """A reflector of pods; it records the reports."""

    def __init__(self, rude, resource=PODS):
        self.script, self.names, self.labels = rude.script, [], []
        self.more = threading.Condition()
        self.reflector = Reflector(rude.api, resource, namespace="n", keep=self.keep, changed=self.changed)

    def keep(self, obj):
        """Keep every object, but raise an error for a pod with the name `bad`."""
        if obj["metadata"]["name"] == "bad":
            raise ValueError("nobody foresaw this")
        return obj

    def changed(self, obj):
        """Record the name and the job of a reported object."""
        with self.more:
            self.names.append(obj["metadata"]["name"])
            self.labels.append(obj["metadata"]["labels"].get("palaestra.dev/job"))
            self.more.notify_all()

    def wait_reported(self, *names):
        """Wait until all these names have been reported."""
        with self.more:
            assert self.more.wait_for(lambda: set(names) <= set(self.names), timeout=5), self.names

    def wait_asked(self, count, *, watches):
        """Wait until the server has received this many watches or lists, and return them."""
        ends = time.monotonic() + 5
        while len(asked := self.script.of(watches=watches)) < count:
            assert time.monotonic() < ends, f"only {len(asked)} of {count}"
            threading.Event().wait(0.01)  # the server cannot notify the test
        return asked

    def known(self):
        """Return the names in the cache."""
        keys = self.reflector.store.keys()
        return {name for _, name in keys}


@pytest.fixture
def follow(rude):
    """Return a function that starts a reflector with a list and watches; the last watch is silent."""
    started = []

    def start(*watches, lists=(), resource=PODS):
        rude.script.calls, rude.script.watches = (
            list(lists) or [listed("a", "b")],
            [*watches, stream(ends="silent")],
        )
        followed = Followed(rude, resource)
        followed.reflector.start()
        started.append(followed)
        return followed

    yield start
    for followed in started:
        followed.reflector.stop(2)


def test_what_is_listed_and_what_is_added_is_known(follow):
    """In this test, the server makes no mistake. Each of the tests below changes one response."""
    followed = follow(stream(added("c", "11"), ends="silent"))

    followed.wait_reported("a", "b", "c")

    assert followed.reflector.synced
    assert followed.known() == {"a", "b", "c"}


def test_an_object_whose_label_changes_is_reported_for_the_old_label_too(follow):
    """The job of the old label has lost the object, so the operator must reconcile that job too.

    The current state is reported last, because a program that counts reports would otherwise keep the old
    state.
    """
    first, later = added("c", "11"), {**added("c", "12"), "type": "MODIFIED"}
    first["object"]["metadata"]["labels"] = {"palaestra.dev/job": "one"}
    later["object"] = pod("c", "12")
    later["object"]["metadata"]["labels"] = {"palaestra.dev/job": "other"}

    followed = follow(stream(first, later, added("d", "13"), ends="silent"))
    followed.wait_reported("d")

    assert [label for label in followed.labels if label] == ["one", "one", "other"]


def test_a_watch_that_is_silent_for_too_long_is_given_up_and_continued(follow):
    """A half-open connection looks alive forever, so the next watch must continue from the last version."""
    followed = follow(stream(added("c", "11"), ends="silent"), stream(added("d", "12"), ends="silent"))

    followed.wait_reported("d")

    versions = [asked.query["resourceVersion"] for asked in followed.script.of(watches=True)]
    assert versions[:2] == ["10", "11"]
    assert len(followed.script.of(watches=False)) == 1


def test_a_watch_whose_answer_never_begins_is_given_up(follow):
    """The server accepts the connection and then sends nothing.

    Without a timeout, the cache would miss all later changes.
    """
    followed = follow(hang, stream(added("c", "11"), ends="silent"))

    followed.wait_reported("c")


@pytest.mark.parametrize(
    "forgotten", [refusal(410, "Expired"), stream(EXPIRED)], ids=["as a status", "as an event"]
)
def test_a_forgotten_version_means_a_new_list_and_no_missed_deletion(follow, forgotten):
    """Pod `b` was deleted while no watch was open, and only a new list shows that."""
    followed = follow(forgotten, lists=[listed("a", "b"), listed("a", "c", version="90")])

    followed.wait_reported("c")
    followed.wait_asked(2, watches=True)

    assert followed.known() == {"a", "c"}
    assert followed.names == ["a", "b", "c", "b"]
    assert followed.script.of(watches=True)[1].query["resourceVersion"] == "90"


def test_a_version_that_is_forgotten_again_and_again_does_not_become_a_storm(follow, rude):
    """After repeated 410 errors, some other clients send 3,000 requests per second, and some stop forever."""
    followed = follow()
    rude.script.watches = [refusal(410, "Expired")]
    followed.wait_reported("a", "b")
    threading.Event().wait(1.0)  # the time in which requests are counted

    assert 2 <= len(rude.script.of(watches=False)) <= 10


@pytest.mark.parametrize(
    "trouble", [refusal(500, "InternalError"), raw(b"garbage"), stream(), stream(b"garbage\n")],
    ids=["500", "garbage", "ends at once", "garbage lines"],
)  # fmt: skip
def test_trouble_that_lasts_is_met_with_patience(follow, rude, trouble):
    """Without growing waits, a lasting error would flood the API server with requests.

    The reflector waits 0.05 to 0.2 s between requests here, and 0.5 to 30 s in a cluster.
    """
    follow()
    rude.script.watches = [trouble]
    rude.script.calls = [listed("a")]
    threading.Event().wait(1.0)  # the time in which requests are counted

    assert len(rude.script.of(watches=True)) <= 10


def test_an_event_that_was_cut_is_never_seen(follow):
    """The client must drop half of an event, because the next watch brings the whole event."""
    followed = follow(stream(added("c", "11"), ends="broken"), stream(added("d", "12"), ends="silent"))

    followed.wait_reported("d")

    assert followed.known() == {"a", "b", "c", "d"}
    assert followed.script.of(watches=True)[1].query["resourceVersion"] == "11"


def test_bookmarks_alone_move_the_version_on(follow):
    """Even if no object changes for an hour, the version must not expire."""
    followed = follow(stream(bookmark("50")), stream(bookmark("60"), ends="silent"))

    asked = followed.wait_asked(3, watches=True)

    assert [each.query["resourceVersion"] for each in asked[:3]] == ["10", "50", "60"]
    assert asked[0].query["allowWatchBookmarks"] == "true"
    assert 300 <= int(asked[0].query["timeoutSeconds"]) <= 600
    assert len(followed.script.of(watches=False)) == 1


def test_lists_that_fail_are_tried_until_one_succeeds(follow):
    """The API server may start later than the operator."""
    followed = follow(lists=[refusal(503, "ServiceUnavailable"), raw(b"garbage"), listed("a")])

    assert followed.reflector.wait_synced(5)
    assert followed.known() == {"a"}


def test_before_the_first_whole_list_nothing_is_in_step(follow):
    """An empty cache does not show that no objects exist, so the operator must not act on it."""
    followed = follow(lists=[hang])

    assert not followed.reflector.wait_synced(0.2)


def test_one_object_that_nobody_foresaw_hides_no_other(follow):
    """An error for one object must not delay the others."""
    followed = follow(stream(added("bad", "11"), added("c", "12"), ends="silent"), lists=[listed("bad", "a")])

    followed.wait_reported("a", "c")

    assert followed.known() == {"a", "c"}


def test_a_change_that_leaves_what_is_kept_as_it_was_is_not_reported(follow):
    """A heartbeat changes only fields that the cache drops, so no worker need reconcile."""
    same = {"type": "MODIFIED", "object": pod("a", "1")}
    followed = follow(stream(same, added("c", "12"), ends="silent"))

    followed.wait_reported("c")

    assert followed.names == ["a", "b", "c"]


def test_metadata_are_kept_under_the_name_of_their_kind(follow):
    """The API server names their kind PartialObjectMetadata, which no other code of the operator expects."""
    followed = follow(stream(added("c", "11"), ends="silent"), resource=CONFIG_MAPS.only_metadata())

    followed.wait_reported("a", "c")

    assert {followed.reflector.store.get("n", name)["kind"] for name in "ac"} == {"ConfigMap"}


@pytest.mark.parametrize("watch", [stream(ends="silent"), hang], ids=["watching", "not answered"])
def test_stopping_takes_no_longer_than_it_may(follow, rude, watch):
    """The operator must end within two seconds, even during a request without a response."""
    followed = follow(watch)
    followed.wait_asked(1, watches=True)
    started = time.monotonic()

    followed.reflector.stop(1)

    assert time.monotonic() - started < 1.5
    assert len(rude.script.of(watches=True)) == 1
