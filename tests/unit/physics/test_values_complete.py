"""Every device type and every shape appears among the values that are compared with formulas."""

import re
from pathlib import Path

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.distance_sensor import DistanceSensorType
from palaestra_sim.scene.tree.field_types import field_kinds
from palaestra_sim.scene.visuals import drawn
from tests.values.shapes import FILES, SHAPES
from tests.values.worlds import PHYSICS, Setting

# Nodes that have no reading and move nothing, so that no formula gives a value for them.
WITHOUT_VALUES = {
    "LED": "keeps a number",
    "Speaker": "makes no sound",
    "Pen": "draws nothing",
    "Display": "has pixels, which tests/unit/stub/test_stub_display.py compares",
    "Skin": "has no bones",
}
GEOMETRIES = (
    "Box", "Capsule", "Cone", "Cylinder", "ElevationGrid", "IndexedFaceSet", "IndexedLineSet", "Mesh",
    "Plane", "PointSet", "Sphere",
)  # fmt: skip
HERE = Path(__file__).parent
# Fields that other tests compare with values, by the file of the test.
ELSEWHERE = {
    "controlPID": "physics/test_gains.py",
    "multiplier": "physics/test_gains.py",
    "minPosition": "physics/test_steering.py",
    "maxPosition": "physics/test_steering.py",
    "speedNoise": "stub/test_stub_gps.py",
    "speedResolution": "stub/test_stub_gps.py",
    "spherical": "mujoco/test_mujoco_renderer.py",
    "near": "mujoco/test_mujoco_renderer.py",
    "zoom": "stub/test_stub_arms.py",
    "minAbsoluteRadialSpeed": "physics/test_radar.py",
    "rangeNoise": "physics/test_radar.py",
    "angularNoise": "physics/test_radar.py",
    "minDetectableSignal": "physics/test_radar.py",
    "bufferSize": "stub/test_stub_talking.py",
    "write": "stub/test_stub_devices.py",
}
# Fields of every Solid, fields for people, and fields that Webots ignores.
OF_SOLIDS = {"translationStep", "rotationStep", "description", "locked", "GPS.type", "radarCrossSection"} | {
    "recognitionColors",
    "contactMaterial",
    "immersionProperties",
}
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
        Setting(physics).load(f"Solid {{ boundingObject {nodes(geometry)} }}", files=FILES)
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


@pytest.mark.parametrize("name", [name for name in DEVICES if name not in WITHOUT_VALUES])
def test_each_field_with_an_effect_has_a_value_in_a_test(name):
    """A field that is read and then forgotten would pass every test that only asks whether it is read."""
    fields = set(field_kinds(name)) - OF_SOLIDS - set(DEVICES[name].without_effect.split())
    fields = {field for field in fields if f"{name}.{field}" not in OF_SOLIDS}
    unnamed = {field for field in fields if re.search(rf"\b{field}\b", ROWS) is None}

    assert unnamed <= ELSEWHERE.keys()
    for field in unnamed:
        text = (HERE.parent / ELSEWHERE[field]).read_text(encoding="utf-8")
        assert re.search(rf"\b{field}\b", text), field


@pytest.mark.parametrize("physics", PHYSICS)
def test_a_shape_that_a_bounding_object_may_have_has_rows(physics):
    """If rays met an accepted shape elsewhere than in Webots, a policy would learn from wrong distances."""
    taken = {geometry for geometry in GEOMETRIES if accepted(physics, geometry)}

    assert taken == {shape.type for shape in SHAPES if shape.bounding}


def test_a_shape_that_is_visible_has_rows():
    """Infra-red rays, lidars and cameras see every visible shape, so each shape needs its own values."""
    shapes = " ".join(f"Shape {{ geometry {nodes(geometry)} }}" for geometry in GEOMETRIES)
    simulation = Setting("stub").load(f"Solid {{ children [ {shapes} ] }}", files=FILES)
    things = drawn(simulation.tree.root, simulation.tree.mesh_files)
    seen = {thing.node.nodes("geometry")[0].type_name for thing in things}

    assert seen == {shape.type for shape in SHAPES}
