"""The methods of the master, called without sockets. tests/contract compares them with those of rosmaster."""

import pytest

from palaestra_protocol.xmlrpc.documents import MOST_DEPTH
from palaestra_protocol.xmlrpc.responses import OK, WRONG
from palaestra_trainer.ros_master.api import MasterApi, Update


@pytest.fixture
def api():
    """Return the methods of a master without registrations."""
    return MasterApi("http://master:11311", 7)


@pytest.mark.parametrize(
    ("method", "arguments", "fact"),
    [
        ("lookupNode", ("/a",), "lookupNode: 1 arguments were given; the method takes caller, node"),
        ("getUri", (5,), "getUri: caller: 5 is not a text; give the full name of the node"),
        ("getPublishedTopics", ("/a", 5), "getPublishedTopics: subgraph: 5 is not a text; give a namespace"),
        (
            "setParam",
            ("/a", "/x", None),
            "setParam: value: is missing; to delete a parameter, call",
        ),
        ("setParam", ("/a", "/x" * (MOST_DEPTH + 1), 1), f"key: has more than {MOST_DEPTH} parts"),
        ("setParam", ("/a", "/", 5), "setParam: value: "),
    ],
)
def test_wrong_arguments_are_named_in_the_response(api, method, arguments, fact):
    """A client of another language gets the message that a person can act on, and no fault of XML-RPC."""
    response, updates = api.call(method, arguments)

    assert response.code == WRONG
    assert fact in response.text
    assert updates == []


def test_a_parameter_that_is_deeper_than_a_document_may_be_is_not_set(api):
    """The tree with the parameter could not be sent to any client."""
    api.call("setParam", ("/a", "/x" * (MOST_DEPTH + 1), 1))

    response, _ = api.call("getParamNames", ("/a",))
    assert response.value == []


def test_a_changed_parameter_reaches_all_subscribers_but_the_node_that_changed_it(api):
    """The node itself knows the value; an update would set the value a second time, maybe an old one."""
    for node in ("/a", "/b"):
        api.call("subscribeParam", (node, f"http://{node[1:]}:1", "/speed"))

    response, updates = api.call("setParam", ("/a", "/speed", 5))

    assert response.code == OK
    assert updates == [Update("http://b:1", "paramUpdate", "/speed/", 5, "/b")]


def test_a_deleted_parameter_is_an_empty_namespace_for_its_subscribers(api):
    """XML-RPC has no value for a missing parameter; rosmaster sends an empty dictionary too."""
    api.call("setParam", ("/a", "/speed", 5))
    api.call("subscribeParam", ("/b", "http://b:1", "/speed"))

    _, updates = api.call("deleteParam", ("/b", "/speed"))

    assert [(update.subject, update.value, update.node) for update in updates] == [("/speed/", {}, "/b")]


def test_a_node_that_refused_an_update_gets_no_other(api):
    """The node has unsubscribed itself, or another program has its address now."""
    api.call("subscribeParam", ("/b", "http://b:1", "/speed"))
    _, [update] = api.call("setParam", ("/a", "/speed", 5))

    api.stop_updates(update)

    _, updates = api.call("setParam", ("/a", "/speed", 6))
    assert updates == []
