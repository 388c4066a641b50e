"""Friction, gravity and masses of a world, under MuJoCo."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.world import builtin

G = 9.81


def contact(one, other, coefficient):
    """Return the ContactProperties of two materials."""
    return f'ContactProperties {{ material1 "{one}" material2 "{other}" coulombFriction [ {coefficient} ] }}'


def box(name, material, where, size="0.2 0.2 0.2"):
    """Return a dynamic box of a material."""
    return f"""DEF {name} Solid {{ translation {where} name "{name}" contactMaterial "{material}"
      boundingObject Box {{ size {size} }} physics Physics {{ density -1 mass 1 }} }}"""


def load(*things, contacts=(), info=""):
    """Return the simulation of a world with these objects and contact properties."""
    head = f"WorldInfo {{ basicTimeStep 8 contactProperties [ {' '.join(contacts)} ] {info} }}"
    source = "\n".join(("#VRML_SIM R2023b utf8", head, *things))
    return Simulation.load(source.encode(), MujocoPhysics(), "materials", Mode.FAST)


def slide(simulation, name, speed=2.0):
    """Return the distance that a box slides after a push along x."""
    place = simulation.tree.of_def(name).place
    simulation.step(400)
    start = place.world_pose.position[0]
    place.push((speed, 0.0, 0.0), (0.0, 0.0, 0.0))
    simulation.step(8000)
    return place.world_pose.position[0] - start


@settings(max_examples=8, deadline=None)
@given(coefficient=st.floats(0.1, 0.6))
def test_a_box_slides_as_far_as_its_friction_lets_it(coefficient):
    """A box that starts at v = 2 m/s slides v^2 / (2 mu g). The box is flat, so it does not tip over."""
    flat = box("PUCK", "ice", "0 0 0.025", "0.3 0.3 0.05")

    distance = slide(load(flat, contacts=[contact("ice", "default", coefficient)]), "PUCK")

    assert distance == pytest.approx(4.0 / (2.0 * coefficient * G), rel=0.05)


def test_each_pair_of_materials_has_its_own_friction():
    """Ice slides on the floor but not on rubber, so one friction value per material would not be enough."""
    contacts = [
        contact("ice", "default", 0.1),
        contact("ice", "rubber", 3.0),
        contact("rubber", "default", 0.3),
    ]
    sheet = """Solid { translation 0 3 0.05 contactMaterial "rubber" name "sheet"
      boundingObject Box { size 9 1 0.1 } }"""
    puck = box("PUCK", "ice", "0 0 0.025", "0.3 0.3 0.05")
    held = box("HELD", "ice", "0 3 0.125", "0.3 0.3 0.05")
    tire = box("TIRE", "rubber", "0 -3 0.025", "0.3 0.3 0.05")
    simulation = load(sheet, puck, held, tire, contacts=contacts)

    assert slide(simulation, "PUCK", 1.0) == pytest.approx(1.0 / (2.0 * 0.1 * G), rel=0.05)
    assert slide(simulation, "HELD", 1.0) < 0.1
    assert slide(simulation, "TIRE", 1.0) == pytest.approx(1.0 / (2.0 * 0.3 * G), rel=0.05)


def test_the_floor_has_a_material():
    """The material of the floor is that of the Plane in the floor's boundingObject."""
    floor = 'Solid { boundingObject Plane { size 20 20 } contactMaterial "lino" name "floor" }'
    puck = box("PUCK", "default", "0 0 0.025", "0.3 0.3 0.05")

    distance = slide(load(floor, puck, contacts=[contact("lino", "default", 0.2)]), "PUCK")

    assert distance == pytest.approx(4.0 / (2.0 * 0.2 * G), rel=0.05)


def test_things_fall_as_the_gravity_of_the_world_says():
    """With the Moon's gravity, an object falls 1.62 t^2 / 2 meters in t seconds."""
    simulation = load(box("STONE", "default", "0 0 5"), info="gravity 1.62")

    simulation.step(1000)

    assert simulation.tree.of_def("STONE").place.world_pose.position[2] == pytest.approx(4.19, abs=0.01)


@pytest.mark.parametrize(("mass_kg", "moves"), [(5.0, False), (200.0, True)])
def test_a_heavy_robot_pushes_what_a_light_one_does_not(drive, mass_kg, moves):
    """The servos that move a base get stronger with the robot's mass, so the heavy robot moves the box."""
    crate = b"""DEF CRATE Solid { translation 0.6 0 0.15 boundingObject Box { size 0.3 0.3 0.3 }
      physics Physics { density -1 mass 100 } }"""
    source = builtin("arena").replace(b"mass 20\n", f"mass {mass_kg}\n".encode())
    simulation = Simulation.load(source + crate, MujocoPhysics(), "masses", Mode.FAST)

    drive(simulation, 0.3, 0.0, 0.0, steps=15)

    crate_x = simulation.tree.of_def("CRATE").place.world_pose.position[0]
    assert (crate_x > 0.7) is moves
