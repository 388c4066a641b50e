"""The table of stand-ins: its form, its errors, and the solids that it gives."""

import contextlib
import math
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.errors import StandInError
from palaestra_sim.stub.scene.nodes.types import is_base_type
from palaestra_sim.world.stand_ins import Part, load, shipped

CRATE = '[Crate]\nfields = { size = [1, 2, 3] }\nbox = "size"\n'


def parts(text, **given_fields):
    """The parts of the one entry of a table."""
    (entry,) = load(text, "mine.toml").values()
    return entry.parts(given_fields)


def test_a_box_has_the_size_of_its_instance_or_the_default():
    """As a PROTO's field has."""
    assert parts(CRATE) == (Part(kind="Box", size=(1.0, 2.0, 3.0)),)
    assert parts(CRATE, size=(4.0, 5.0, 6.0)) == (Part(kind="Box", size=(4.0, 5.0, 6.0)),)


@pytest.mark.parametrize(
    ("shape", "height"), [("box = [1, 2, 3]", 3.0), ("cylinder = [1, 4]", 4.0), ("sphere = 2", 4.0)]
)
def test_what_stands_on_its_origin_is_lifted_by_half_its_height(shape, height):
    """Furniture has its origin on the floor, crates in their middle."""
    (part,) = parts(f'[A]\norigin = "floor"\nat = [1, 2, 0]\n{shape}')

    assert part.at == (1.0, 2.0, height / 2)


def test_a_size_may_be_a_sum():
    """A cabinet is as wide as its columns and its frame."""
    text = '[A]\nfields = { widths = [1, 2] }\nbox = [1, "sum widths + 0.5", "sum widths"]'

    assert parts(text)[0].size == (1.0, 3.5, 3.0)
    assert parts(text, widths=(1.0, 1.0, 1.0, 1.0))[0].size == (1.0, 4.5, 4.0)


def test_an_arena_has_four_walls_around_its_floor():
    """The inner faces are at the edges of the floor."""
    walls = shipped()["RectangleArena"].parts({"floorSize": (4.0, 2.0), "wallThickness": (0.1,)})

    assert [(wall.at, wall.size) for wall in walls] == [
        ((pytest.approx(2.05), 0.0, 0.05), (0.1, 2.0, 0.1)),
        ((pytest.approx(-2.05), 0.0, 0.05), (0.1, 2.0, 0.1)),
        ((0.0, pytest.approx(1.05), 0.05), (pytest.approx(4.2), 0.1, 0.1)),
        ((0.0, pytest.approx(-1.05), 0.05), (pytest.approx(4.2), 0.1, 0.1)),
    ]


@given(radius=st.floats(0.5, 10), thickness=st.floats(0.01, 0.2))
def test_a_round_arena_has_no_gap_and_nothing_inside(radius, thickness):
    """Every wall touches the circle from outside, and its neighbors."""
    walls = shipped()["CircleArena"].parts({"radius": (radius,), "wallThickness": (thickness,)})
    turn = 2 * math.pi / len(walls)

    for wall in walls:
        assert math.hypot(*wall.at[:2]) - wall.size[0] / 2 == pytest.approx(radius)
        assert wall.size[1] >= 2 * (radius + thickness) * math.tan(turn / 2) - 1e-9


@pytest.mark.parametrize("shape", ["flat", "drawn"])
def test_a_road_and_a_picture_are_nothing_to_run_into(shape):
    """They exist, and touch nothing."""
    assert parts(f"[A]\n{shape} = true") == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[A", "mine.toml: Expected ']'"),
        ("A = 1", "mine.toml: A: is no table; write [A] and its lines below"),
        ("[A]\nbox = [1, 2, 3]\nmass = 1", "mine.toml: A.mass: no such key; use arena, at, box"),
        ("[A]", "mine.toml: A: has 0 shapes; write one of box, cylinder"),
        ("[A]\nbox = [1, 1, 1]\nsphere = 1", "mine.toml: A: has 2 shapes"),
        ("[A]\nbox = [1, 2]", "mine.toml: A.box: has 2 numbers; write 3, in meters"),
        ('[A]\nbox = "size"', "mine.toml: A.box: 'size' is no sum of fields and numbers; add it to fields"),
        ('[A]\nfields = { x = "y" }\nsphere = 1', "mine.toml: A.fields.x: 'y' is not a number"),
        ('[A]\nsphere = 1\norigin = "top"', "mine.toml: A.origin: is 'top'; write center or floor"),
        ("[A]\nsphere = 1\nat = [1, 2]", "mine.toml: A.at: has 2 numbers; write x, y, z in meters"),
        ("[A]\nsphere = nan", "mine.toml: A.sphere: nan is not a number"),
        ("[A]\nsphere = true", "mine.toml: A.sphere: True is not a number"),
    ],
)
def test_a_wrong_table_is_answered_with_entry_fact_and_remedy(text, message):
    """Before a world is read."""
    with pytest.raises(StandInError) as caught:
        load(text, "mine.toml")

    assert str(caught.value).startswith(message)


@given(st.text(max_size=60))
def test_any_text_is_a_table_or_an_error(text):
    """Never another exception."""
    with contextlib.suppress(StandInError):
        assert isinstance(load(text, "any.toml"), dict)


def test_no_entry_that_ships_takes_the_place_of_a_type_of_webots():
    """A Solid stays a Solid."""
    assert not [name for name in shipped() if is_base_type(name)]


def test_every_part_that_ships_has_a_size():
    """A box of no height would be seen by no ray."""
    for entry in shipped().values():
        assert all(min(part.size) > 0.0 for part in entry.parts({}))


def test_the_example_of_the_docs_is_a_table():
    """As a reader copies it."""
    page = (Path(__file__).parents[3] / "docs" / "simulators.md").read_text()
    (example,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)

    table = load(example, "docs")

    assert table["Crate"].parts({})[0].at == (0.0, 0.0, 0.15)
    assert table["Lamp"].parts({})[0].size == (0.15, 1.8)
    assert table["Poster"].parts({}) == ()
