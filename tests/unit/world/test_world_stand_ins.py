"""Stand-ins: the bundled ones are complete and plausible, and mistakes in a user's file are located."""

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.world import (
    Item,
    ShapePart,
    StandInError,
    expand,
    load_stand_ins,
    shipped_stand_ins,
)
from palaestra_sim.world.expressions import parse_formula

PAGE = Path(__file__).parents[3] / "docs/reference/simulators.md"
# The most frequent types in public worlds, apart from robots and devices.
COMMON = """
RectangleArena Floor WoodenBox StraightRoadSegment Wall HighwayPole CurvedRoadSegment
RoadIntersection TeslaModel3Simple CardboardBox OilBarrel WoodenChair BmwX5 RangeRoverSportSVRSimple
CitroenCZeroSimple LincolnMKZSimple SpeedLimitSign GenericTrafficLight Cabinet Table SquareManhole
Door PottedTree Sofa Window Forest Sink SolidBox Desk Fridge CeilingLight Carpet Chair HotPlate Oven
Worktop Armchair BunchOfSunFlowers Can LandscapePainting halfTile worldTile SpeedLimitPanel
HazardMap Victim FireSmoke SmallResidentialTower Keyboard Monitor TexturedBackground
TexturedBackgroundLight LegoWall MazeBlock TinkerbotsBase SumoInterface Pedestrian
"""


def parts(name: str, **values: Sequence[Item]) -> tuple[ShapePart, ...]:
    """Return the parts of a stand-in of a bundled type, with these values of its fields."""
    return expand(shipped_stand_ins()[name], values)


def made(text: str, **values: Sequence[Item]) -> tuple[ShapePart, ...]:
    """Return the parts of a stand-in of the only type in a file."""
    (stand_in,) = load_stand_ins(text, "mine.toml").values()
    return expand(stand_in, values)


def refusal(text: str) -> str:
    """Return the message about a file that cannot be used."""
    with pytest.raises(StandInError) as caught:
        load_stand_ins(text, "mine.toml")
    return str(caught.value)


@pytest.mark.parametrize("name", COMMON.split())
def test_what_most_worlds_are_made_of_has_a_stand_in(name: str) -> None:
    """The list of types comes from a count over public worlds."""
    assert name in shipped_stand_ins()


def test_every_solid_that_ships_has_parts_of_a_sensible_size() -> None:
    """The sizes go from a bolt to a tower. A barrier that is off and a tile without walls have no parts."""
    for name, stand_in in shipped_stand_ins().items():
        found = expand(stand_in, {})
        assert bool(found) == (
            stand_in.kind == "solid" and name not in ("CrashBarrier", "worldTile", "halfTile")
        ), name
        assert all(0.001 < length < 100 for part in found for length in part.size), name
        assert all(abs(place) < 60 for part in found for place in part.position), name


def test_every_object_has_a_place_and_a_name() -> None:
    """Each type has the common fields first; its own fields follow, and may replace a common one."""
    barrel = shipped_stand_ins()["OilBarrel"].fields

    assert list(barrel) == [
        "translation",
        "rotation",
        "name",
        "height",
        "radius",
        "physics",
        "immersionProperties",
    ]
    assert barrel["translation"].default.items == (0, 0, 0.44)
    assert barrel["rotation"].type == "SFRotation"
    assert barrel["name"].default.items == ("oil barrel",)


def test_a_box_has_the_size_of_its_field() -> None:
    """A world sets the size of most boxes; only a box without a size gets the default."""
    assert parts("WoodenBox") == (ShapePart(shape="box", size=(0.6, 0.6, 0.6)),)
    assert parts("WoodenBox", size=(1.0, 2.0, 3.0)) == (ShapePart(shape="box", size=(1, 2, 3)),)


@pytest.mark.parametrize("value", [(), (1.0, 2.0), ("a", "b", "c"), (None,)])
def test_a_value_that_does_not_fit_is_the_default(value: Sequence[Item]) -> None:
    """Webots also uses the default, and logs a message."""
    assert parts("WoodenBox", size=value) == parts("WoodenBox")


def test_a_wall_stands_on_its_origin_and_a_box_is_around_it() -> None:
    """The origin of a building is on the ground, while the origin of a movable object is its center."""
    (wall,) = parts("Wall")

    assert wall == ShapePart(shape="box", size=(0.2, 1, 2.4), position=(0, 0, 1.2))


def test_an_arena_is_a_floor_within_four_walls() -> None:
    """The walls stand around the floor, and not on it."""
    floor, front, back, left, right = parts("RectangleArena", floorSize=(3.0, 2.0), wallHeight=(0.4,))

    assert floor == ShapePart(shape="plane", size=(3, 2))
    assert front == ShapePart(shape="box", size=(0.01, 2, 0.4), position=(1.505, 0, 0.2))
    assert back.position == (-1.505, 0.0, 0.2)
    assert left == ShapePart(shape="box", size=(3.02, 0.01, 0.4), position=(0, 1.005, 0.2))
    assert right.position == (0.0, -1.005, 0.2)


def test_a_round_arena_is_closed() -> None:
    """The wall is a ring of boxes that overlap at their corners."""
    floor, *ring = parts("CircleArena", radius=(2.0,))

    assert floor == ShapePart(shape="plane", size=(4, 4))
    assert len(ring) == 24
    assert {round(math.hypot(*box.position[:2]), 2) for box in ring} == {1.99}
    assert math.isclose(sum(box.size[0] - box.size[1] for box in ring), 2 * math.pi * 2.005, rel_tol=0.01)


def test_a_building_has_a_wall_between_each_two_corners() -> None:
    """The last wall leads from the last corner back to the first."""
    corners = (0.0, 0.0, 6.0, 0.0, 6.0, 4.0)

    first, second, third = parts("SimpleBuilding", corners=corners, floorNumber=(2.0,))

    assert first == ShapePart(shape="box", size=(6.2, 0.2, 6), position=(3, 0, 3))
    assert second == ShapePart(shape="box", size=(4.2, 0.2, 6), position=(6, 2, 3), turn=math.pi / 2)
    assert third.position == (3.0, 2.0, 3.0)


def test_a_door_that_is_open_leaves_its_frame() -> None:
    """A robot can drive through an open door; a closed door is like a wall."""
    assert len(parts("Door")) == 4
    assert len(parts("Door", position=(1.2,))) == 3


def test_a_cabinet_is_as_large_as_its_rows_and_columns() -> None:
    """The origin of a cabinet is at its back."""
    (box,) = parts("Cabinet", rowsHeights=(0.5,), columnsWidths=(0.3, 0.3))

    assert box.size == pytest.approx((0.5, 0.66, 0.56))
    assert box.position == pytest.approx((0.25, 0, 0.28))


def test_a_bounding_object_can_be_off() -> None:
    """In Webots, robots drive through such an object too."""
    assert parts("SolidBox", enableBoundingObject=(False,)) == ()


@pytest.mark.parametrize(
    ("name", "kind"), [("Carpet", "flat"), ("RoadIntersection", "flat"), ("Asphalt", "drawn")]
)
def test_what_nothing_runs_into_has_no_parts(name: str, kind: str) -> None:
    """Examples are objects that lie flat on the ground, and purely visual objects."""
    stand_in = shipped_stand_ins()[name]

    assert (stand_in.kind, expand(stand_in, {})) == (kind, ())


def test_a_part_is_placed_turned_and_left_out_by_formulas() -> None:
    """Each number may be computed from fields of the object."""
    text = """
        [Stool]
        fields = "SFFloat height 0.5  SFFloat angle 0.1  SFBool hasBack FALSE"
        parts = [
            { cylinder = { radius = 0.2, height = "height" }, origin = "base" },
            { box = [0.03, 0.4, 0.4], at = [-0.19, 0, "height + 0.2"], turn = "2 * angle", when = "hasBack" },
            { sphere = 0.1, unless = "hasBack" },
        ]
    """

    assert made(text) == (
        ShapePart(shape="cylinder", size=(0.2, 0.5), position=(0, 0, 0.25)),
        ShapePart(shape="sphere", size=(0.1,)),
    )
    assert made(text, hasBack=(True,), height=(0.4,))[1] == ShapePart(
        shape="box", size=(0.03, 0.4, 0.4), position=(-0.19, 0, 0.4 + 0.2), turn=0.2
    )


@pytest.mark.parametrize("height", [0.0, -1.0, math.inf, math.nan])
def test_a_length_that_is_none_makes_no_part(height: float) -> None:
    """Nothing can touch such a part, and a simulator may fail to load it."""
    assert made('[A]\nfields = "SFFloat height 1"\nbox = [1, 1, "height"]', height=(height,)) == ()


def test_a_users_file_is_what_the_manual_shows() -> None:
    """The example in the manual must be valid without changes."""
    text = PAGE.read_text().partition("```toml stand-ins\n")[2].partition("```")[0]

    mine = load_stand_ins(text, "mine.toml")

    assert {name: stand_in.kind for name, stand_in in mine.items()} == {
        "RoadMarking": "flat",
        "NightSky": "drawn",
        "BlueSteel": "drawn",
        "Crate": "solid",
        "Stool": "solid",
    }
    assert expand(mine["Crate"], {}) == (ShapePart(shape="box", size=(0.6, 0.4, 0.3), position=(0, 0, 0.15)),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[A", "mine.toml: this is not TOML: "),
        (
            'flat = "A"',
            'mine.toml: flat: this is not a list of types; write ["Carpet"], before the first table',
        ),
        ("drawn = [1]", "mine.toml: drawn: this is not a list of types"),
        ('flat = ["A"]\n[A]\nbox = [1, 1, 1]', "mine.toml: A: it is also in a list; keep one of the two"),
        ("A = 1", "mine.toml: A: this is not a table; write [A] and its shape"),
        (
            "[A]",
            "mine.toml: A: shape: it has 0 shapes; write one of box, cylinder, plane, ring, sphere, wall",
        ),
        ("[A]\nbox = [1, 1, 1]\nsphere = 1", "mine.toml: A: shape: it has 2 shapes; write one of"),
        (
            "[A]\nsize = 1",
            "mine.toml: A: size: it is not a key of a stand-in; choose from at, box, cylinder, origin",
        ),
        (
            "[A]\nbox = [1, 1]",
            "mine.toml: A: box: it does not have 3 lengths; write them in a list, or the name of a field",
        ),
        ("[A]\nplane = [1, 1, 1]", "mine.toml: A: plane: it does not have 2 lengths"),
        (
            "[A]\nsphere = true",
            "mine.toml: A: sphere: True is not a length; write a number, the name of a field, or a",
        ),
        (
            "[A]\ncylinder = 1",
            "mine.toml: A: cylinder: it is not a table with the right keys; write { radius = 1, height = 1 }",
        ),
        (
            "[A]\nring = { radius = 1, height = 1 }",
            "mine.toml: A: ring: it is not a table with the right keys; write { radius = 1, th",
        ),
        (
            '[A]\nbox = "size"',
            "mine.toml: A: box: A has no field size; declare it in fields, or write a number",
        ),
        (
            '[A]\nfields = "SFVec2f size 1 1"\nbox = "size"',
            "mine.toml: A: box: size.z is not a number of SFVec2f size; name one, such as size.x",
        ),
        (
            '[A]\nfields = "SFVec3f size 1 1 1"\nsphere = "size"',
            "mine.toml: A: sphere: size is not a number of SFVec3f size; name one, such as size.x",
        ),
        ('[A]\nfields = "SFString s \'\'"\nsphere = "s"', "mine.toml: A: fields: in its line 1: "),
        (
            '[A]\nfields = "MFFloat s []"\nsphere = "s"',
            "mine.toml: A: sphere: s is not a number of MFFloat s",
        ),
        (
            "[A]\nfields = 1\nsphere = 1",
            "mine.toml: A: fields: this is not text; declare fields as SFVec3f size 1 1 1",
        ),
        (
            "[A]\nfields = '''\nSFFloat a 1\nSFFloat b x\n'''\nsphere = 1",
            'mine.toml: A: fields: in its line 3: found the end of the file where the "{" of x should be',
        ),
        (
            '[A]\nsphere = "1 +"',
            "mine.toml: A: sphere: '1 +' is not a formula; write numbers and fields with + - * / ( )",
        ),
        (
            '[A]\nsphere = "1 % 2"',
            "mine.toml: A: sphere: '% 2' in '1 % 2' is not part of a formula; write numbers",
        ),
        ('[A]\nsphere = 1\nat = "0"', "mine.toml: A: at: '0.x' is not a formula"),
        (
            '[A]\nsphere = 1\norigin = "top"',
            'mine.toml: A: origin: \'top\' is not an origin; write "center", or "base"',
        ),
        ('[A]\nsphere = 1\nwhen = "on"', "mine.toml: A: when: A has no field on; declare it in fields"),
        (
            "[A]\nflat = false",
            "mine.toml: A: flat: the type also has other keys, or the value is not true; write flat = true",
        ),
        ("[A]\ndrawn = true\nsphere = 1", "mine.toml: A: drawn: the type also has other keys, or the value"),
        (
            "[A]\nparts = 1",
            "mine.toml: A: parts: it is not a list of tables, or the type has other keys; write [ { box =",
        ),
        ("[A]\nparts = [ { } ]", "mine.toml: A: parts[0]: it has 0 shapes; write one of"),
        (
            '[A]\nparts = [ { sphere = 1 }, { sphere = "r" } ]',
            "mine.toml: A: parts[1].sphere: A has no field r",
        ),
        (
            '[A]\nwall = { path = "p", thickness = 1, height = 1 }',
            "mine.toml: A: wall: its path is not a field with a list of points, or closed is not true",
        ),
    ],
)
def test_a_mistake_is_named_with_file_type_field_and_remedy(text: str, message: str) -> None:
    """TOML has no line numbers for keys, so the message has the path of the key."""
    assert refusal(text).startswith(message)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (2, 2),
        ("1.5", 1.5),
        ("a + 2 * b.y - 1", 1 + 2 * 20 - 1),
        ("(a + 2) * -b.x / 4", -7.5),
        ("sum(b) / 3", 20),
        ("a - b.x - b.y", -29),
        ("1 / (a - 1)", 0),
    ],
)
def test_a_formula_is_arithmetic_over_fields(text: object, value: float) -> None:
    """Multiplication comes before addition, from left to right.

    A division by zero must not end a simulator.
    """
    numbers: Mapping[str, Sequence[float]] = {"a": (1.0,), "b": (10.0, 20.0, 30.0)}

    assert parse_formula(text).value(numbers.__getitem__) == value


@given(st.one_of(st.text(max_size=60), st.text("0.5abx+-*/() ", max_size=300), st.floats(), st.none()))
def test_any_formula_is_read_or_refused(written: object) -> None:
    """For any text, the reader raises no other exception than ValueError."""
    try:
        formula = parse_formula(written)
    except ValueError as error:
        message = str(error)
    else:
        message = f"{formula.text}; read"
    assert "; " in message


@given(st.text("[]{}=\"'ab1 \n,.#", max_size=80))
def test_any_file_is_read_or_refused(text: str) -> None:
    """For any file, the reader raises no other exception than StandInError."""
    try:
        found = load_stand_ins(text, "mine.toml")
    except StandInError as error:
        message = str(error)
    else:
        message = f"mine.toml: {len(found)} types"
    assert message.startswith("mine.toml: ")


def test_types_stand_once_in_the_file_that_ships() -> None:
    """TOML rejects a second table of a type, but a list may contain a type twice."""
    lists = tomllib.loads((Path(expand.__code__.co_filename).parent / "stand_ins.toml").read_text())
    names = [*lists["flat"], *lists["drawn"]]

    assert len(names) == len(set(names))
