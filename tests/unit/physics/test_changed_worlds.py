"""Worlds that a supervisor changes while they run: a change acts on the physics too, or is refused."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.devices.step_timer import StepTimer
from palaestra_sim.scene.tree.field_types import FieldType
from tests.tables import for_each
from tests.values.worlds import PHYSICS, STEP_MS, Setting, robot

MUJOCO = Setting("mujoco")
CRATE = """DEF CRATE Solid { translation 0 0 0.15 physics Physics { density -1 mass 1 }
  boundingObject DEF B Box { size 0.3 0.3 0.3 }
  children [ DEF TOWER Solid { translation 0 0 0.2 boundingObject Box { size 0.1 0.1 0.1 } } ] }"""
DOOR = """DEF FRAME Pose { children HingeJoint {
  jointParameters DEF P HingeJointParameters { axis 0 0 1 }
  endPoint DEF DOOR Solid { translation 0.5 0 0.5 physics Physics { density -1 mass 1 }
    boundingObject DEF B Box { size 1 0.1 1 } } } }"""
FLOOR = "DEF FLOOR Solid { boundingObject Plane { size 20 20 } }"
SHELF = 'DEF SHELF Solid { translation 0.3 0 0.1 name "shelf" boundingObject Box { size 0.1 0.1 0.1 } }'
ARM = """HingeJoint { jointParameters DEF P HingeJointParameters { axis 0 0 1 position 0.25 }
  device RotationalMotor { name "pan" maxVelocity 100 } endPoint Solid { name "end" } }"""


def field(simulation, name, which):
    """Return a field of the node with a DEF name."""
    return simulation.tree.field_of(simulation.tree.of_def(name), which, simulation)


@for_each(
    "world, name, which, value",
    [
        (CRATE, "B", "size", (0.5, 0.5, 0.5)),
        (DOOR, "B", "size", (0.5, 0.1, 1.0)),
        (CRATE, "TOWER", "translation", (0.0, 0.1, 0.2)),
        (robot(SHELF), "SHELF", "translation", (0.6, 0.0, 0.1)),
    ],
)
def test_a_shape_on_an_object_that_moves_keeps_its_size_and_place(world, name, which, value):
    """The physics reads such shapes once, so pictures would show another object than collides."""
    simulation = MUJOCO.load(FLOOR + world)

    with pytest.raises(UnsimulatedError, match=f"{which}.* cannot be changed while the simulator runs"):
        field(simulation, name, which).set(FieldType.VEC3F, 0, value)


def test_nothing_is_added_to_an_object_that_moves_or_removed_from_it():
    """A tower that is removed from a cart would still collide, and a new one would stand still beside it."""
    simulation = MUJOCO.load(FLOOR + CRATE)
    children = field(simulation, "CRATE", "children")

    with pytest.raises(UnsimulatedError, match="cannot be added to a robot, or to a Solid that moves"):
        simulation.add("Solid { boundingObject Box { } }", children, -1)
    with pytest.raises(UnsimulatedError, match="cannot be removed from a robot, or from a Solid that moves"):
        simulation.remove(simulation.tree.of_def("TOWER"))
    simulation.remove(simulation.tree.of_def("CRATE"))
    assert simulation.scene.loose == []


def test_a_door_follows_the_frame_that_carries_it():
    """A robot would collide with the old place of the door, and drive through the new one."""
    simulation = MUJOCO.load(FLOOR + DOOR)
    simulation.step(STEP_MS)

    field(simulation, "FRAME", "translation").set(FieldType.VEC3F, 0, (3.0, 0.0, 0.0))
    simulation.step(STEP_MS)

    [door] = simulation.scene.doors
    built = simulation.scene.physics.built()
    assert built.data.geom_xpos[:, 0].max() == pytest.approx(3.5, abs=0.01)
    assert door.place.world_position[0] == pytest.approx(3.5, abs=0.01)


def test_a_loaded_state_is_at_rest():
    """Two episodes that begin in one state would differ by the speed at the end of the one before."""
    simulation = MUJOCO.load(FLOOR + CRATE)
    simulation.step(STEP_MS)
    crate = simulation.tree.of_def("CRATE")
    simulation.save_state(crate, "start")
    simulation.motion.set_velocity(crate, (2.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    simulation.step(STEP_MS)

    simulation.load_state(crate, "start")
    simulation.step(STEP_MS)

    assert crate.place.world_position == pytest.approx((0.0, 0.0, 0.15), abs=1e-3)


@pytest.mark.parametrize("physics", PHYSICS)
def test_a_field_shows_the_position_of_its_joint(physics):
    """Webots updates `position` at each step, so a supervisor reads where the joint is now."""
    simulation = Setting(physics).load(robot(ARM))
    assert field(simulation, "P", "position").get(FieldType.FLOAT) == 0.25

    simulation.robots[0].motors["pan"].set_position(1.0)
    simulation.step(60 * STEP_MS)

    assert field(simulation, "P", "position").get(FieldType.FLOAT) == pytest.approx(1.0)


def test_an_inserted_and_a_removed_value_take_effect_like_a_written_one():
    """A client that reads a color back expects that a camera recognizes the object."""
    simulation = Setting("stub").load('DEF S Solid { recognitionColors [ 1 0 0 ] name "s" }')
    colors = field(simulation, "S", "recognitionColors")

    assert colors.insert(FieldType.COLOR, -1, (0.0, 1.0, 0.0))
    assert colors.count == 2
    simulation.step(STEP_MS)
    assert simulation.tree.of_def("S").numbers("recognitionColors") == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)

    assert colors.remove(0)
    simulation.step(STEP_MS)
    assert simulation.tree.of_def("S").numbers("recognitionColors") == (0.0, 1.0, 0.0)


def test_twins_of_one_node_have_the_same_value():
    """A node that is used twice (USE) is one node, whichever of its two places a client asks."""
    shape = "Shape {{ appearance {} geometry Box {{ }} }}"
    looks = shape.format("DEF L PBRAppearance { roughness 0.1 }") + shape.format("USE L")
    simulation = Setting("stub").load(f"Solid {{ children [ {looks} ] }}")
    first, second = (
        simulation.tree.field_of(node, "roughness", simulation)
        for node in simulation.tree.root.descendants()
        if node.type_name == "PBRAppearance"
    )

    first.set(FieldType.FLOAT, 0, 0.7)
    simulation.step(STEP_MS)

    assert (first.get(FieldType.FLOAT), second.get(FieldType.FLOAT)) == (0.7, 0.7)


def test_a_reset_is_noticed_before_a_longer_step():
    """The time after a longer step is later than before the reset, so a timer cannot compare times alone."""
    simulation = Setting("stub").load(robot(""))
    timer = StepTimer(simulation.robots[0])
    simulation.step(STEP_MS)
    assert timer.elapsed() == (STEP_MS / 1000.0, False)

    simulation.reset()
    simulation.step(3 * STEP_MS)  # the reset is at the end of the first basic step

    assert timer.elapsed() == (2 * STEP_MS / 1000.0, True)


def test_a_distance_sensor_whose_rays_have_no_weight_is_refused():
    """Its average would be a division by 0; the message names the number."""
    sensor = "DistanceSensor { numberOfRays 2 aperture 0.5 gaussianWidth 0 }"

    with pytest.raises(WorldError, match="with the gaussianWidth 0, no ray has a weight; write a larger"):
        Setting("stub").load(robot(sensor))
