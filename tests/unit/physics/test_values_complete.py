"""Every device type and every shape appears among the values that are compared with formulas."""

import re
from pathlib import Path

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.distance_sensor import DistanceSensorType
from palaestra_sim.scene.visuals import drawn
from tests.values.shapes import SHAPES
from tests.values.worlds import PHYSICS, Setting

# Nodes that have no reading and move nothing, so that no formula gives a value for them.
WITHOUT_VALUES = {
    "LED": "keeps a number",
    "Speaker": "makes no sound",
    "Pen": "draws nothing",
    "Display": "has pixels, which tests/unit/stub/test_stub_display.py compares",
    "Skin": "has no bones",
    "VacuumGripper": "holds nothing",
}
GEOMETRIES = (
    "Box", "Capsule", "Cone", "Cylinder", "ElevationGrid", "IndexedFaceSet", "IndexedLineSet", "Mesh",
    "Plane", "PointSet", "Sphere",
)  # fmt: skip
HERE = Path(__file__).parent
ROWS = "".join(
    path.read_text(encoding="utf-8")
    for path in (*HERE.glob("test_values_[!c]*.py"), *(HERE.parents[1] / "values").glob("*.py"))
)


def nodes(geometry):
    """Return the text of a geometry of a type: the text in `SHAPES`, or an empty node of the type."""
    return next((shape.node for shape in SHAPES if shape.type == geometry), f"{geometry} {{ }}")


def accepted(physics, geometry):
    """Return whether a simulator accepts a geometry in a boundingObject."""
    try:
        Setting(physics).load(f"Solid {{ boundingObject {nodes(geometry)} }}")
    except WorldError:
        return False
    return True


@pytest.mark.parametrize("name", DEVICES)
def test_a_device_type_has_rows_or_a_reason_to_have_none(name):
    """Without values from formulas, nobody would notice that a device of this type reads wrong values."""
    has_rows = re.search(rf"\b{name} \{{", ROWS) is not None

    assert has_rows != (name in WITHOUT_VALUES), WITHOUT_VALUES.get(name, "add rows to tests/values")


def test_each_type_of_distance_and_touch_sensor_has_rows():
    """Each type of these sensors measures differently, so each needs its own values."""
    kinds = {kind.name.lower().replace("_", "-") for kind in DistanceSensorType}

    assert [kind for kind in (*kinds, "bumper", "force", "force-3d") if f'"{kind}"' not in ROWS] == []


@pytest.mark.parametrize("physics", PHYSICS)
def test_a_shape_that_a_bounding_object_may_have_has_rows(physics):
    """If rays met an accepted shape elsewhere than in Webots, a policy would learn from wrong distances."""
    taken = {geometry for geometry in GEOMETRIES if accepted(physics, geometry)}

    assert taken == {shape.type for shape in SHAPES if shape.bounding}


def test_a_shape_that_is_visible_has_rows():
    """Infra-red rays, lidars and cameras see every visible shape, so each shape needs its own values."""
    shapes = " ".join(f"Shape {{ geometry {nodes(geometry)} }}" for geometry in GEOMETRIES)
    simulation = Setting("stub").load(f"Solid {{ children [ {shapes} ] }}")
    seen = {thing.node.nodes("geometry")[0].type_name for thing in drawn(simulation.tree.root)}

    assert seen == {shape.type for shape in SHAPES}
