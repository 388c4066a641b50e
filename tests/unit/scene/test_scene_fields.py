"""Each field of a device is applied, rejected, or reported at the start of the simulator."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType, field_kinds
from palaestra_sim.scene.world_report import differences
from palaestra_sim.stub.physics import StubPhysics

OTHER = {
    FieldType.INT32: "3",
    FieldType.FLOAT: "0.7",
    FieldType.VEC3F: "0.3 0.4 0.5",
    FieldType.ROTATION: "0 0 1 0.3",
    FieldType.COLOR: "0.2 0.3 0.4",
    FieldType.STRING: '"x"',
}
NODES = {
    "physics": "Physics { }",
    "boundingObject": "Box { }",
    "children": "[ Pose { } ]",
    "muscles": "[ Muscle { } ]",
    "lens": "Lens { }",
    "lensFlare": "LensFlare { }",
    "focus": "Focus { }",
    "zoom": "Zoom { }",
    "recognition": "Recognition { }",
    "rotatingHead": "Solid { }",
    "appearance": "[ Appearance { } ]",
    "bones": "[ SolidReference { } ]",
}
# Fields for an editor or for people, and fields that Webots itself ignores.
FOR_PEOPLE = {
    "translationStep",
    "rotationStep",
    "description",
    "locked",
    "GPS.type",
    "TouchSensor.lookupTable",
}
# Only some nodes have a use for these fields, such as a light, another type of bumper, a radar or a fluid.
ELSEWHERE = {
    "LightSensor.occlusion",
    "TouchSensor.resolution",
    "radarCrossSection", "recognitionColors", "contactMaterial", "immersionProperties", "physics",
}  # fmt: skip


def sample(kind, name):
    """Return a value for a field that differs from the field's default."""
    if kind.type is FieldType.NODE:
        return NODES[name]
    if kind.type is FieldType.BOOL:
        return "FALSE" if kind.default == "TRUE" else "TRUE"
    return f"[ {OTHER[kind.type]} ]" if kind.multiple else OTHER[kind.type]


def load(type_name, field, physics):
    """Return the simulation of a robot with a device of that type; the device has the field."""
    kind = DEVICES[type_name]
    device = f"{type_name} {{ {field} }}"
    part = f"HingeJoint {{ device {device} }}" if kind.on_joint else device
    arguments = 'controllerArgs [ "--name=r" "--synchronize" ]'
    robot = f'Robot {{ controller "ros" {arguments} children [ {part} ] }}'
    return Simulation.load(f"#VRML_SIM R2023b utf8\nWorldInfo {{ }} {robot}\n".encode(), physics)


FIELDS = [
    (type_name, name)
    for type_name in DEVICES
    for name in field_kinds(type_name)
    if not {name, f"{type_name}.{name}"} & (FOR_PEOPLE | ELSEWHERE)
]


class Watched(dict):
    """The fields of a node; they record which fields are read."""

    def __init__(self):
        super().__init__()
        self.looked_at = set()

    def get(self, name, default=None):
        """Return the content of a field, and record the field's name."""
        self.looked_at.add(name)
        return super().get(name, default)


@pytest.fixture
def watched(monkeypatch):
    """Let each new node record the fields that are read."""
    begin = SceneNode.__init__

    def begun(node, *given):
        begin(node, *given)
        node.fields = Watched()

    monkeypatch.setattr(SceneNode, "__init__", begun)


@pytest.mark.usefixtures("watched")
@pytest.mark.parametrize("physics", [StubPhysics, MujocoPhysics])
def test_no_field_of_a_device_is_ignored_in_silence(physics):
    """If a field were ignored, a user would train without the noise or delay that the world file sets."""
    ignored = []
    for type_name, name in FIELDS:
        kind = field_kinds(type_name)[name]
        try:
            simulation = load(type_name, f"{name} {sample(kind, name)}", physics())
        except WorldError:
            continue
        nodes = [it for it in simulation.tree.nodes.values() if it.type_name == type_name]
        named = any(f"{type_name}: without effect: {name}" in line for line in differences(simulation))
        if not named and not any(name in node.fields.looked_at for node in nodes):
            ignored.append(f"{type_name}.{name}")

    assert ignored == []


@pytest.mark.parametrize(
    ("type_name", "name"),
    [(kind.node, name) for kind in DEVICES.values() for name in kind.without_effect.split()],
)
def test_a_field_without_effect_is_named_unless_it_has_its_default(type_name, name):
    """A world that Webots has saved contains many fields with their defaults, which would fill the report."""
    kind = field_kinds(type_name)[name]
    line = f"1 {type_name}: without effect: {name}"
    words = {FieldType.STRING: f'"{kind.default}"', FieldType.NODE: "NULL"}.get(kind.type, kind.default)
    default = ("[ ]" if kind.multiple and not kind.default else words) or "NULL"

    assert line in list(differences(load(type_name, f"{name} {sample(kind, name)}", StubPhysics())))
    assert line not in list(differences(load(type_name, f"{name} {default}", StubPhysics())))


def test_fields_of_physics_without_effect_are_named_where_forces_act():
    """`bounce` matters only where forces act, so MuJoCo's report lists it and the stub's does not."""
    bouncing = "ContactProperties { bounce 0.9 softCFM 0.001 } ContactProperties { bounce 0 }"
    world = f"#VRML_SIM R2023b utf8\nWorldInfo {{ contactProperties [ {bouncing} ] }}\n".encode()

    assert list(differences(Simulation.load(world, MujocoPhysics()))) == [
        "1 ContactProperties: without effect: bounce"
    ]
    assert list(differences(Simulation.load(world, StubPhysics()))) == []
