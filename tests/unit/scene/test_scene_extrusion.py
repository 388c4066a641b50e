"""The faces of an Extrusion, as in Webots."""

import math

import pytest

from palaestra_sim.scene.extrusion import faces

SQUARE = (0.5, 0.5, 0.5, -0.5, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5)


def extruded(**fields):
    """Return the faces of an Extrusion with both caps."""
    return faces(
        {"crossSection": SQUARE, "splineSubdivision": (0.0,), **fields}, begin_cap=True, end_cap=True
    )


def test_the_default_spine_gives_a_block_that_stands_on_the_ground():
    """An Extrusion without a spine is 1 m high, along z."""
    found = extruded()

    corners = {tuple(round(it, 9) + 0.0 for it in point) for point in found.points}
    assert corners == {(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)}
    assert found.index[:5] == (0, 1, 2, 3, -1)
    assert found.index.count(-1) == 6


def test_a_bent_spine_tilts_the_cross_section_at_the_bend():
    """As in Webots, the section at the bend keeps its size and lies in the plane that bisects the angle."""
    found = extruded(spine=(0, 0, 0, 0, 0, 2, 2, 0, 2))
    middle = found.points[5:10]

    assert {round(abs(y), 9) for _, y, _ in middle} == {0.5}
    assert {round(math.hypot(x, z - 2.0), 9) for x, _, z in middle} == {0.5}
    assert all(x == pytest.approx(-(z - 2.0)) for x, _, z in middle)


def test_scale_and_orientation_change_from_point_to_point():
    """The last scale applies to all further points of the spine; a missing orientation means no rotation."""
    found = extruded(scale=(2, 2, 0.5, 1), orientation=(0, 0, 1, 0, 0, 0, 1, math.pi / 2))

    assert {(round(abs(x), 9), round(abs(y), 9)) for x, y, _ in found.points[:5]} == {(1.0, 1.0)}
    assert {(round(abs(x), 9), round(abs(y), 9)) for x, y, _ in found.points[5:]} == {(0.5, 0.25)}


@pytest.mark.parametrize(
    "fields",
    [
        {"spine": (0, 0, 0)},
        {"spine": (0, 0, 0, 0, 0, math.inf)},
        {"crossSection": (0, 0, 1, 0, 0, 0)},
        {"spine": (0, 0, 0, 0, 0, 2, 2, 0, 2), "splineSubdivision": (4.0,)},
        {"crossSection": (0.0, 1.0) * 2000},
    ],
)
def test_what_is_incomplete_too_large_or_curved_has_no_faces(fields):
    """Without faces the simulator rejects the Extrusion as a boundingObject."""
    assert extruded(**fields) is None


def test_a_straight_spine_with_a_subdivision_is_the_same_block():
    """A spline through points on a line is that line, so the subdivision changes nothing."""
    assert extruded(splineSubdivision=(4.0,), spine=(0, 0, 0, 0, 0, 1, 0, 0, 2)) == extruded(
        spine=(0, 0, 0, 0, 0, 2)
    )
