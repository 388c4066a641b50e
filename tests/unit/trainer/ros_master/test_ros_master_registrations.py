"""The registrations of nodes. tests/contract compares the responses with those of rosmaster."""

from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.ros_master.registrations import Kind, Registrations

TOPICS = (Kind.PUBLISHER, Kind.SUBSCRIBER, Kind.PARAMETER)
REGISTERED = st.lists(
    st.tuples(st.sampled_from(TOPICS), st.sampled_from("xyz"), st.sampled_from(["/a", "/b"])), unique=True
)


@given(REGISTERED)
def test_a_node_is_known_exactly_while_it_has_a_registration(registered):
    """If a killed simulator's node remained known, the next simulator could not start."""
    nodes = Registrations()
    for kind, name, node in registered:
        nodes.register(kind, name, node, f"http://h{node}")

    for left in range(len(registered), 0, -1):
        assert {node for _, _, node in registered[:left]} == {it for it in ("/a", "/b") if nodes.knows(it)}
        kind, name, node = registered[left - 1]
        assert nodes.unregister(kind, name, node, f"http://h{node}")
    assert not nodes.knows("/a")
    assert not nodes.knows("/b")
    assert [nodes.listed(kind) for kind in Kind] == [[], [], [], []]


@given(REGISTERED)
def test_a_node_with_another_address_replaces_the_old_one_of_its_name(registered):
    """Topics and services of the old node lead to an address where no program listens."""
    nodes = Registrations()
    for kind, name, node in registered:
        nodes.register(kind, name, node, "http://old")

    replaced = nodes.register(Kind.PUBLISHER, "new", "/a", "http://new")

    assert replaced == ("http://old" if any(node == "/a" for _, _, node in registered) else None)
    assert [name for kind in Kind for name, members in nodes.listed(kind) if "/a" in members] == ["new"]
    assert nodes.uri_of("/a") == "http://new"


def test_a_service_has_the_address_of_the_node_that_registered_last():
    """A restarted simulator registers the same service names. The old node had no other registration."""
    nodes = Registrations()
    nodes.register_service("/s", "/a", "http://a", "rosrpc://a")
    nodes.register_service("/s", "/b", "http://b", "rosrpc://b")

    assert nodes.address_of("/s") == "rosrpc://b"
    assert not nodes.knows("/a")
    assert not nodes.unregister_service("/s", "/a", "rosrpc://a")
    assert nodes.unregister_service("/s", "/b", "rosrpc://b")
    assert nodes.address_of("/s") is None


def test_a_registration_with_another_address_is_not_removed():
    """The registration belongs to a newer node with the same name."""
    nodes = Registrations()
    nodes.register(Kind.PUBLISHER, "/t", "/a", "http://new")

    assert not nodes.unregister(Kind.PUBLISHER, "/t", "/a", "http://old")
    assert nodes.uris(Kind.PUBLISHER, "/t") == ["http://new"]


def test_a_topic_has_the_type_of_its_newest_publisher():
    """A recorder subscribes to any type, `*`, which must not hide the publisher's type."""
    nodes = Registrations()
    declared = []
    for type_name, published in (("*", False), ("a/First", False), ("a/Second", True), ("*", True)):
        nodes.declare_type("/t", type_name, published=published)
        declared.append(nodes.types())

    assert declared == [[], [("/t", "a/First")], [("/t", "a/Second")], [("/t", "a/Second")]]
