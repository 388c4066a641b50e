"""Requests to an API server that misbehaves raise a typed error in time, and no write is repeated."""

import time
from itertools import pairwise

import pytest

from palaestra.cluster import Conflict, Gone, ServerError, TooManyRequests, Unreachable, connect
from palaestra.cluster.resources import CONFIG_MAPS, PODS
from tests.integration.apiserver.conftest import HASTE, write_kubeconfig
from tests.integration.apiserver.server import hang, hang_up, raw, refusal, reply, stream, trickle

POD = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": "p", "namespace": "n"}}


@pytest.mark.parametrize("answer", [hang, trickle], ids=["silent", "byte by byte"])
def test_an_answer_that_does_not_end_is_given_up(rude, answer):
    """A worker must not hang: a call takes at most twice its timeout, which is 1 s here."""
    rude.script.calls = [answer]
    started = time.monotonic()

    with pytest.raises(Unreachable):
        rude.api.get(PODS, "n", "p")

    assert time.monotonic() - started < 2.5


@pytest.mark.parametrize("body", [b"<html>", b"[]", b"", b'"text"', b"\xff\xfe"])
def test_an_answer_that_is_no_object_is_no_answer(rude, body):
    """A proxy between client and server may send anything with the code 200."""
    rude.script.calls = [raw(body)]

    with pytest.raises(Unreachable, match="JSON"):
        rude.api.get(PODS, "n", "p")


def test_a_gateway_that_answers_in_html_is_a_server_error(rude):
    """A gateway's response has no Status object, so the error must come from the HTTP code."""
    rude.script.calls = [raw(b"<html>", 502)]

    with pytest.raises(ServerError, match="502"):
        rude.api.get(PODS, "n", "p")


def test_a_read_on_a_connection_that_broke_is_repeated_once(rude):
    """Servers close idle connections at any time, and a repeated read has no effect on objects."""
    rude.script.calls = [hang_up, reply(obj=POD)]

    assert rude.api.get(PODS, "n", "p") == POD


def test_a_write_on_a_connection_that_broke_is_not_repeated(rude):
    """The server may have executed the write, so the caller must read before it writes again."""
    rude.script.calls = [hang_up, reply(obj=POD)]

    with pytest.raises(Unreachable):
        rude.api.create(PODS, POD)

    assert len(rude.script.asked) == 1


def test_a_write_that_a_busy_server_turned_away_is_repeated_when_it_says(rude):
    """With the code 429 the server has not executed the write, so the client may repeat it."""
    rude.script.calls = [refusal(429, "TooManyRequests", Retry_After="0.3"), reply(obj=POD)]
    started = time.monotonic()

    assert rude.api.create(PODS, POD) == POD

    assert time.monotonic() - started >= 0.3


def test_a_busy_server_that_asks_for_more_time_than_there_is_gets_it_from_the_queue(rude):
    """A worker must not sleep for a minute, because the queue can retry the job later."""
    rude.script.calls = [refusal(429, "TooManyRequests", Retry_After="60")]
    started = time.monotonic()

    with pytest.raises(TooManyRequests) as caught:
        rude.api.create(PODS, POD)

    assert caught.value.retry_after_s == 60
    assert time.monotonic() - started < 0.5


def test_a_busy_server_that_asks_for_no_time_at_all_is_not_hammered(rude):
    """`Retry-After: 0` is legal, but a client that obeys it sends thousands of requests per second."""
    rude.script.calls = [refusal(429, "TooManyRequests", Retry_After="0")]

    with pytest.raises(TooManyRequests):
        rude.api.create(PODS, POD)

    assert 2 <= len(rude.script.asked) <= 8


def test_an_eviction_that_a_disruption_budget_refuses_is_not_waited_for(rude):
    """A budget may refuse for days. Thirty such pods would block a worker for minutes at each reconcile."""
    rude.script.calls = [refusal(429, "TooManyRequests", Retry_After="0")]

    with pytest.raises(TooManyRequests):
        rude.api.evict("n", "p", uid="u")

    assert len(rude.script.asked) == 1


def test_nobody_who_listens_is_unreachable(tmp_path):
    """A user with a wrong address must see that address in the message."""
    kubeconfig = write_kubeconfig(tmp_path / "nobody", "http://127.0.0.1:9", {})

    with pytest.raises(Unreachable, match=r"127\.0\.0\.1:9"):
        connect(kubeconfig, limits=HASTE).version()


def test_a_list_is_read_page_by_page(rude):
    """Each response contains the token with which the client requests the next page."""
    names = ["a", "b", "c"]
    rude.script.calls = [
        reply(
            obj={
                "metadata": {"resourceVersion": "7", **({"continue": following} if following else {})},
                "items": [{"metadata": {"name": name}}],
            }
        )
        for name, following in pairwise([*names, None])
    ]

    found = rude.api.list(PODS, "n", labels="x=y", limit=1)

    assert [item["metadata"]["name"] for item in found] == names
    assert {item["kind"] for item in found} == {"Pod"}
    assert [asked.query.get("continue") for asked in rude.script.asked] == [None, "b", "c"]
    assert {asked.query["labelSelector"] for asked in rude.script.asked} == {"x=y"}


def test_a_list_whose_next_page_is_forgotten_starts_again(rude):
    """A list that mixes pages of two versions would miss objects."""
    first = reply(obj={"metadata": {"continue": "b"}, "items": [{"metadata": {"name": "old"}}]})
    whole = reply(obj={"metadata": {}, "items": [{"metadata": {"name": "new"}}]})
    rude.script.calls = [first, refusal(410, "Expired"), whole]

    assert [item["metadata"]["name"] for item in rude.api.list(PODS, "n")] == ["new"]


def test_a_list_that_is_forgotten_again_and_again_is_an_error(rude):
    """After three attempts, the caller must decide when to retry."""
    rude.script.calls = [refusal(410, "Expired")]

    with pytest.raises(Gone):
        rude.api.list(PODS, "n")

    assert len(rude.script.asked) == 3


def test_every_request_is_counted_with_its_verb_and_its_end(rude):
    """A dashboard must show failed requests too."""
    seen = []
    rude.api.on_request = lambda verb, plural, code, seconds: seen.append((verb, plural, code, seconds >= 0))
    rude.script.calls = [reply(obj=POD), refusal(409, "Conflict"), hang_up]
    rude.api.create(PODS, POD)
    with pytest.raises(Conflict):
        rude.api.merge(PODS, "n", "p", {})
    with pytest.raises(Unreachable):
        rude.api.within(0.5).delete(PODS, "n", "p")

    assert seen == [("create", "pods", 200, True), ("patch", "pods", 409, True), ("delete", "pods", 0, True)]


def test_a_watch_is_counted_when_it_ends_and_when_it_is_refused(rude):
    """A watch that is counted twice would falsify the metrics of requests."""
    seen = []
    rude.api.on_request = lambda *request: seen.append(request[:3])
    rude.script.watches = [stream(), refusal(410, "Expired")]
    assert list(rude.api.watch(PODS, "n", version="1", seconds=60)) == []
    with pytest.raises(Gone):
        rude.api.watch(PODS, "n", version="1", seconds=60)

    assert seen == [("watch", "pods", 200), ("watch", "pods", 410)]


@pytest.mark.parametrize("ends", ["properly", "broken"])
def test_a_watch_that_ends_in_the_middle_of_an_event_did_not_end(rude, ends):
    """A proxy may close the connection as if the response were complete, and an event would be lost."""
    rude.script.watches = [stream(b'{"type": "ADDED", "obj', ends=ends)]

    with pytest.raises(Unreachable):
        list(rude.api.watch(PODS, "n", version="1", seconds=60))


def test_an_error_event_is_raised_as_what_it_is(rude):
    """If no error were raised, the cache would store the Status as an object."""
    status = {"kind": "Status", "code": 500, "reason": "InternalError", "message": "etcd is gone"}
    rude.script.watches = [stream({"type": "ERROR", "object": status})]

    with pytest.raises(ServerError, match="etcd is gone"):
        list(rude.api.watch(PODS, "n", version="1", seconds=60))


def test_contents_stay_with_the_server_where_only_metadata_are_asked_for(rude):
    """A cache of Secrets must not hold their contents."""
    rude.script.calls = [reply(obj={"metadata": {"name": "c"}})]

    rude.api.get(CONFIG_MAPS.only_metadata(), "n", "c")

    assert "as=PartialObjectMetadata;" in rude.script.asked[0].headers["Accept"]
