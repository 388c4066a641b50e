"""Dynamic solids under MuJoCo: Solids with physics, and stand-ins that have a mass."""

import math

import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.world import builtin

CRATE = b"""
DEF CRATE Solid {
  translation 0.6 0 0.15
  boundingObject Box { size 0.3 0.3 0.3 }
  physics Physics { density -1 mass 2 }
}
"""


@pytest.fixture
def load():
    """`load(text)` returns the built-in arena with the nodes of `text` added, under MuJoCo."""

    def load(text=CRATE):
        return Simulation.load(builtin("arena") + text, MujocoPhysics(), "loose", Mode.FAST)

    return load


def position(simulation, name="CRATE"):
    """Return the position of a node in the world."""
    return simulation.tree.of_def(name).place.world_pose.position


def test_a_robot_pushes_a_crate(load, drive):
    """The robot pushes the crate ahead and hardly slows down, because the crate is light."""
    simulation = load()

    body = drive(simulation, 0.3, 0.0, 0.0, steps=15)

    assert body.x > 0.6
    assert position(simulation)[0] == pytest.approx(body.x + 0.2286 + 0.15, abs=0.03)


def test_a_heavy_crate_holds_a_robot(load, drive):
    """The robot's motors cannot move a crate of two tons."""
    simulation = load(CRATE.replace(b"mass 2", b"mass 2000"))

    body = drive(simulation, 0.3, 0.0, 0.0, steps=15)

    assert body.x < 0.3
    assert position(simulation)[0] == pytest.approx(0.6, abs=0.01)


def test_a_crate_falls_to_the_floor_and_rests(load):
    """After two seconds the crate lies on the floor, within 2 mm."""
    simulation = load(CRATE.replace(b"0.6 0 0.15", b"0.6 0 1.5"))

    simulation.step(192 * 10)

    assert position(simulation) == pytest.approx((0.6, 0.0, 0.15), abs=2e-3)


def test_sensors_see_a_crate_where_it_is_now(load, drive):
    """The ray of an infra-red sensor meets the crate, and `contact_points` reports the crate's contacts."""
    simulation = load(CRATE.replace(b"0.6 0 0.15", b"0.5 0 0.15"))
    simulation.step(192)
    values = simulation.robots[0].sensors
    before = values["ir1"].value
    assert before > 2.0 * values["ir4"].value

    drive(simulation, 0.3, 0.0, 0.0, steps=5)

    assert values["ir1"].value > before
    crate = simulation.tree.of_def("CRATE")
    assert simulation.contact_points(crate, descendants=False)


def test_a_crate_that_came_to_rest_still_has_contact_points(load):
    """MuJoCo's steps leave out contacts of bodies at rest, but the crate still stands on the table."""
    table = b'Solid { translation 3 0 -0.05 name "table" boundingObject Box { size 1 1 0.1 } }'
    simulation = load(CRATE.replace(b"0.6 0 0.15", b"3 0 0.15") + table)
    node = simulation.tree.of_def("CRATE")
    numbers = []
    for _ in range(3):
        simulation.step(1600)
        numbers.append(len(simulation.contact_points(node, descendants=False)))

    assert min(numbers) >= 4


def test_a_supervisor_puts_a_crate_elsewhere(load):
    """An environment places objects at each reset.

    The supervisor writes only the translation, and the crate must rest there with its rotation unchanged.
    """
    simulation = load()
    simulation.step(192)
    node = simulation.tree.of_def("CRATE")
    field = simulation.tree.field_of(node, "translation", simulation)
    field.set(FieldType.VEC3F, 0, (-1.0, 1.5, 0.15))

    simulation.step(192)

    assert position(simulation) == pytest.approx((-1.0, 1.5, 0.15), abs=2e-3)


def test_a_push_moves_a_crate_until_friction_stops_it(load):
    """A supervisor can set the velocity of a dynamic solid, as it sets the velocity of a robot."""
    simulation = load()
    place = simulation.tree.of_def("CRATE").place
    place.push((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    simulation.step(32)
    assert 0.3 < place.course.velocity[0] < 1.0

    simulation.step(192 * 5)

    assert place.course.velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert 0.62 < position(simulation)[0] < 0.75


def test_a_reset_brings_a_crate_back(load, drive):
    """The reset puts the crate back at rest.

    Then the same commands must give the same positions, bit for bit.
    """
    simulation = load()

    def course():
        trace = []
        for _ in range(6):
            drive(simulation, 0.4, 0.05, 0.1, steps=2)
            trace.append(position(simulation))
        return trace

    simulation.reset()
    simulation.advance(32)
    first = course()
    simulation.reset()
    simulation.advance(32)

    assert course() == first


def test_what_is_fixed_to_a_crate_goes_with_it(load):
    """The handle moves with the crate as one body, whose mass is the sum of both masses."""
    handle = b"DEF HANDLE Solid { translation 0 0 0.2 boundingObject Box { size 0.1 0.1 0.1 } }"
    simulation = load(CRATE.rstrip().removesuffix(b"}") + b"children [" + handle + b"] }")
    simulation.tree.of_def("CRATE").place.push((0.0, 0.0, 0.0), (0.0, 0.0, 3.0))

    simulation.step(64)

    handle_place = simulation.tree.of_def("HANDLE").place
    assert handle_place.world_pose.position[2] == pytest.approx(0.35, abs=5e-3)
    assert abs(handle_place.world_pose.heading_rad) > 0.01


def test_a_crate_inside_a_pose_is_where_the_pose_puts_it(load):
    """Clients read the crate's translation relative to the Pose, as the world file has it."""
    inside = b"Pose { translation 0 1 0 rotation 0 0 1 1.5708 children [" + CRATE + b"] }"
    simulation = load(inside)

    simulation.step(192)

    assert position(simulation) == pytest.approx((0.0, 1.6, 0.15), abs=2e-3)
    assert simulation.tree.of_def("CRATE").place.translation == pytest.approx((0.6, 0.0, 0.15), abs=2e-3)


def test_a_crate_that_is_imported_is_loose_too(load, drive):
    """The imported crate must fall, and the import must not move the first crate."""
    simulation = load()
    drive(simulation, 0.3, 0.0, 0.0, steps=10)
    before = position(simulation)
    children = simulation.tree.field_of(simulation.tree.root, "children", simulation)
    simulation.add(CRATE.decode().replace("CRATE", "NEW").replace("0.6 0", "-1 1.5"), children, -1)

    assert position(simulation) == pytest.approx(before, abs=1e-9)
    simulation.step(192)
    assert position(simulation, "NEW") == pytest.approx((-1.0, 1.5, 0.15), abs=2e-3)


def test_a_stand_in_with_a_mass_is_loose(tmp_path):
    """As in Webots, a `WoodenBox` falls if its `mass` is more than 0, and is fixed if the `mass` is 0."""
    world = tmp_path / "boxes.wbt"
    boxes = b"""
    DEF LIGHT WoodenBox { translation 0 0 2 mass 1 name "light" }
    DEF FIXED WoodenBox { translation 1 1 2 name "fixed" }
    """
    world.write_bytes(b"#VRML_SIM R2023b utf8\nWorldInfo { basicTimeStep 32 }\n" + boxes)
    simulation = Loader(physics=MujocoPhysics)(world, Mode.FAST)

    simulation.step(32 * 60)

    assert position(simulation, "LIGHT")[2] == pytest.approx(0.3, abs=2e-3)
    assert position(simulation, "FIXED")[2] == 2.0


def test_a_slope_lets_a_ball_roll(load):
    """The slope is a tilted box: MuJoCo accepts shapes of any rotation."""
    slope = b"""
    Solid { translation 0 1.5 0.3 rotation 0 1 0 0.3 boundingObject Box { size 1 0.5 0.1 } }
    DEF BALL Solid {
      translation -0.3 1.5 0.6 boundingObject Sphere { radius 0.1 } physics Physics { }
    }
    """
    simulation = load(slope)

    simulation.step(192 * 8)

    assert position(simulation, "BALL")[0] > 0.2
    assert math.isfinite(position(simulation, "BALL")[2])


def test_crates_at_rest_sleep(load):
    """Crates at rest keep their positions bit for bit, even on a floor that is an obstacle.

    Two hundred sleeping crates then cost little time.
    """
    crates = [
        CRATE.replace(b"0.6 0 0.15", f"{-1.5 + 0.5 * i} 1.5 0.15".encode()).replace(
            b"CRATE", f"CRATE{i}".encode()
        )
        for i in range(6)
    ]
    simulation = load(b"".join(crates))
    simulation.step(192 * 10)
    before = [position(simulation, f"CRATE{i}") for i in range(6)]

    simulation.step(192 * 10)

    assert [position(simulation, f"CRATE{i}") for i in range(6)] == before


def test_an_obstacle_that_moves_wakes_what_lies_on_it(load):
    """A crate must fall when a supervisor takes its table away.

    After a reset it must fall again, bit for bit.
    """
    table = b"DEF TABLE Solid { translation 1 1.2 0.5 boundingObject Box { size 0.5 0.5 0.1 } }"
    simulation = load(CRATE.replace(b"0.6 0 0.15", b"1 1.2 0.7") + table)

    def fall():
        simulation.reset()
        simulation.advance(32)
        simulation.step(192 * 10)
        assert position(simulation)[2] == pytest.approx(0.7, abs=2e-3)
        node = simulation.tree.of_def("TABLE")
        field = simulation.tree.field_of(node, "translation", simulation)
        field.set(FieldType.VEC3F, 0, (-1.0, -1.2, 0.5))
        trace = []
        for _ in range(5):
            simulation.step(96)
            trace.append(position(simulation))
        return trace

    first = fall()

    assert first[-1][2] < 0.3
    assert fall() == first


@pytest.mark.parametrize("physics", ["", "physics Physics { density -1 mass 3 }"])
def test_a_solid_inside_another_is_one_body_with_it(load, physics):
    """As in Webots, the shelf, its lamp and its legs move as one body, so no part falls off."""
    lamp = """DEF LAMP Solid { translation 0.5 0 0 boundingObject Box { size 0.1 0.1 0.1 }
      physics Physics { density -1 mass 1 } name "lamp" }"""
    legs = """DEF LEGS Solid { translation 0 0 -0.5 boundingObject Box { size 0.4 0.4 0.9 }
      physics Physics { density -1 mass 20 } name "legs" }"""
    shelf = f"""DEF SHELF Solid {{ translation 0.8 0 1 boundingObject Box {{ size 0.4 0.4 0.1 }} {physics}
      children [ {lamp} Group {{ children [ {legs} ] }} ] }}"""
    simulation = load(shelf.encode())

    simulation.step(1600)

    heights = [simulation.tree.of_def(name).place.world_position[2] for name in ("SHELF", "SHELF.LAMP")]
    assert heights == pytest.approx([1.0, 1.0] if not physics else [0.95, 0.95], abs=0.01)
