"""The parsed form of a world."""

from collections.abc import Callable

import pytest

from palaestra_sim.world import Node, World, parse

SCENE = """EXTERNPROTO "https://example.org/Lamp.proto"
IMPORTABLE EXTERNPROTO "webots://Chair.proto"
WorldInfo { basicTimeStep 32 title "Arena" }
DEF BOX Solid {
  translation 1 -2.5 0   # meters
  children [ DEF SHAPE Shape { castShadows FALSE } Lamp { color [ 1 1 0, 0 0 1 ] } ]
  boundingObject USE SHAPE
  physics NULL
  hidden position_0_0 0.25
}
Robot { controllerArgs [ "--name=a" "--clock" ] supervisor TRUE }
"""


@pytest.fixture
def scene(world: Callable[[str], bytes]) -> World:
    """Return the parsed world."""
    return parse(world(SCENE))


@pytest.fixture
def box(scene: World) -> Node:
    """Return the Solid of the world."""
    return scene.nodes[1]


def test_a_world_has_a_header_and_nodes_in_source_order(scene: World) -> None:
    """The header names the release of Webots for which the world was written."""
    assert scene.header == "#VRML_SIM R2023b utf8"
    assert [node.type_name for node in scene.nodes] == ["WorldInfo", "Solid", "Robot"]


def test_protos_from_elsewhere_are_listed_by_address(scene: World) -> None:
    """A declaration of a PROTO is not a node of the world, so both have lists of their own."""
    assert [token.text for token in scene.externs] == [
        b'"https://example.org/Lamp.proto"',
        b'"webots://Chair.proto"',
    ]


def test_numbers_come_as_floats(box: Node) -> None:
    """A vector is a flat tuple of numbers."""
    assert box.numbers("translation") == (1.0, -2.5, 0.0)
    assert not box.fields["translation"].bracketed


def test_a_list_of_vectors_comes_flat(scene: World) -> None:
    """The type of the field decides how many numbers form a vector, and the reader has no types."""
    lamp = next(node for node in scene.walk() if node.type_name == "Lamp")

    assert lamp.numbers("color") == (1, 1, 0, 0, 0, 1)
    assert lamp.fields["color"].bracketed


def test_a_field_that_is_absent_or_of_another_kind_has_no_numbers(scene: World) -> None:
    """The caller can then use Webots' default of the field."""
    assert scene.nodes[0].numbers("gravity") is None
    assert scene.nodes[0].numbers("title") is None


def test_strings_come_unescaped(scene: World) -> None:
    """A field with one string is read in the same way as a list of strings."""
    assert scene.nodes[0].text("title") == "Arena"
    assert scene.nodes[0].text("basicTimeStep") is None
    assert scene.nodes[2].texts("controllerArgs") == ("--name=a", "--clock")
    assert scene.nodes[2].texts("customData") == ()


def test_a_flag_has_the_default_that_is_asked_for(scene: World) -> None:
    """The reader has no table of Webots' defaults, so the caller passes the default."""
    assert scene.nodes[2].flag("supervisor", default=False)
    assert not scene.nodes[2].flag("selfCollision", default=False)
    assert scene.nodes[2].flag("synchronization", default=True)


def test_nodes_in_a_field_come_in_order(box: Node) -> None:
    """A field with one node is read in the same way as a list of nodes."""
    assert [node.type_name for node in box.nodes("children")] == ["Shape", "Lamp"]
    assert box.nodes("endPoint") == ()


def test_a_use_is_a_node_without_a_type(box: Node) -> None:
    """The reader leaves USE as it is; the loader of the scene finds the node."""
    (use,) = box.nodes("boundingObject")

    assert (use.type_name, use.uses, use.fields) == ("", "SHAPE", {})


def test_null_is_none(box: Node) -> None:
    """The field exists, but it contains no node."""
    assert box.fields["physics"].items == (None,)


def test_a_saved_state_is_a_field_of_its_own_kind(box: Node) -> None:
    """A saved state has its own name, so it cannot be taken for the field itself."""
    assert box.numbers("hidden position_0_0") == (0.25,)


def test_walk_visits_every_node_parents_first(scene: World) -> None:
    """The order is that of the source, and a USE counts as a node."""
    assert [node.type_name or node.uses for node in scene.walk()] == [
        "WorldInfo",
        "Solid",
        "Shape",
        "Lamp",
        "SHAPE",
        "Robot",
    ]


def test_spans_tell_which_bytes_were_read(scene: World, box: Node) -> None:
    """The generator replaces the bytes of these spans.

    A node's bytes go from DEF to the closing brace; a value's bytes include its brackets.
    """
    start, end = box.span
    first, last = box.fields["translation"].span

    assert scene.source[start:end].startswith(b"DEF BOX Solid {")
    assert scene.source[start:end].endswith(b"0.25\n}")
    assert scene.source[first:last] == b"1 -2.5 0"


def test_a_header_may_have_blanks_after_its_hash() -> None:
    """Webots accepts blanks after the #; published PROTOs of drones have one."""
    assert parse(b"# VRML_SIM R2022b utf8\nRobot { }").nodes[0].type_name == "Robot"


def test_a_header_may_be_the_whole_file() -> None:
    """A world may be empty, and older releases of Webots have another form of number."""
    assert parse(b"#VRML_SIM V8.6.2 utf8").nodes == ()
    assert parse(b"#VRML_SIM R2021b utf8\r\n").header == "#VRML_SIM R2021b utf8"
