"""The supervisor's facade changes a world, and the observer's facade reads it, in each simulator."""

import av
import pytest
from PIL import Image

from palaestra_trainer.errors import WrongData
from palaestra_trainer.webots import MovieSettings, ViewLabel
from tests.integration.webots.own_world import running
from tests.values.frames import frame, quaternion
from tests.values.worlds import PHYSICS, STEP_MS, Setting, robot

MASS_KG = 2.0
FORCE_N = (3.0, -1.0, 0.5)
BOX = frame((1.0, 2.0, 0.5), (0.0, 0.0, 1.0), 0.6)
WALL = frame((-2.0, 0.0, 0.4))
# Without gravity, the box keeps its place in each simulator.
WORLD = f"""DEF WALL Solid {{ {WALL.fields} name "wall" boundingObject Box {{ size 0.2 1 0.8 }} }}
DEF BOX Solid {{ {BOX.fields} name "box" boundingObject Box {{ size 0.4 0.4 0.4 }} PHYSICS }}
"""
PHYSICS_NODE = f"physics Physics {{ density -1 mass {MASS_KG} }}"


@pytest.fixture(scope="module", params=PHYSICS)
def simulator(request):
    """Return the name of a simulator."""
    return request.param


@pytest.fixture(scope="module")
def world(simulator, master, tmp_path_factory):
    """Yield a facade and a robot in a running simulator; only MuJoCo simulates the mass of the box."""
    del master
    text = WORLD.replace("PHYSICS", PHYSICS_NODE if simulator == "mujoco" else "")
    text = Setting(simulator).text(text + robot(""), "gravity 0").replace("WorldInfo", "DEF INFO WorldInfo")
    with running(text, tmp_path_factory.mktemp("world"), simulator) as started:
        yield started


def test_the_full_pose_of_a_node_is_that_of_the_world_file(world):
    """`pose` has only x, y and the heading, which is not enough for an arm or a drone."""
    webots, _ = world

    position, rotation = webots.observer.full_pose("BOX")

    assert position == pytest.approx(BOX.position)
    assert rotation == pytest.approx(quaternion(BOX.rotation))
    assert webots.observer.type_name("BOX") == "Solid"


def test_a_force_moves_a_mass(world, simulator):
    """The speed after one basic step is F t / m; the stub, which has no forces, refuses the call."""
    webots, onlooker = world
    if simulator == "stub":
        with pytest.raises(WrongData):
            webots.supervisor.add_force("BOX", FORCE_N)
        return

    webots.supervisor.add_force("BOX", FORCE_N)
    onlooker.advance()
    linear, angular = webots.supervisor.velocity("BOX")
    webots.supervisor.stop_inertia("BOX")

    assert linear == pytest.approx([force * STEP_MS / 1000.0 / MASS_KG for force in FORCE_N], rel=0.01)
    assert angular == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_a_torque_turns_a_mass(world, simulator):
    """A cube with the edge a has the inertia m a^2 / 6 about each axis through its middle."""
    webots, onlooker = world
    if simulator == "stub":
        with pytest.raises(WrongData):
            webots.supervisor.add_torque("BOX", (0.0, 0.0, 0.1))
        return

    webots.supervisor.add_torque("BOX", (0.0, 0.0, 0.1))
    onlooker.advance()
    _, angular = webots.supervisor.velocity("BOX")
    webots.supervisor.stop_inertia("BOX")

    assert angular[2] == pytest.approx(0.1 * STEP_MS / 1000.0 / (MASS_KG * 0.4**2 / 6.0), rel=0.01)


def test_a_saved_state_is_restored(world):
    """An experiment may begin again and again in the same state of one object."""
    webots, onlooker = world
    webots.supervisor.save_state("WALL")
    webots.supervisor.set_field("WALL", "translation", (0.0, -3.0, 0.4))
    onlooker.advance()
    moved, _ = webots.observer.full_pose("WALL")

    webots.supervisor.load_state("WALL")
    onlooker.advance()

    assert moved == pytest.approx((0.0, -3.0, 0.4))
    assert webots.observer.full_pose("WALL")[0] == pytest.approx(WALL.position)


def test_nodes_are_inserted_and_removed(world):
    """A program may build its world while the simulation runs."""
    webots, onlooker = world
    text = (
        'DEF POST Solid { translation 4 4 0.5 name "post" boundingObject Cylinder { radius 0.1 height 1 } }'
    )

    webots.supervisor.insert_node("", "children", text)
    onlooker.advance()
    there = webots.observer.full_pose("POST")[0]
    webots.supervisor.remove_node("POST")

    assert there == pytest.approx((4.0, 4.0, 0.5))
    assert not webots.observer.exists("POST")


def test_a_wrong_node_is_refused(world):
    """The program learns at once that the world did not change."""
    webots, _ = world

    with pytest.raises(WrongData):
        webots.supervisor.insert_node("", "children", "Solid { translation 1 }}")


def test_the_view_is_saved_where_the_simulator_renders(world, simulator, tmp_path):
    """The stub renders nothing, and an empty picture would mislead."""
    webots, _ = world
    picture = tmp_path / "view.png"
    if simulator == "stub":
        with pytest.raises(WrongData):
            webots.supervisor.save_image(picture)
        return

    webots.supervisor.save_image(picture)

    with Image.open(picture) as image:
        assert image.size == (800, 600)


def test_a_label_is_accepted(world):
    """Only Webots draws labels; a program that shows one must run in each simulator."""
    webots, _ = world

    webots.supervisor.set_label(ViewLabel(text="episode 3", at=(0.1, 0.9), rgb=0x00FF00))
    webots.supervisor.set_label(ViewLabel(text=""))


def test_a_box_on_a_table_touches_it_at_its_corners(master, tmp_path):
    """The contact points of MuJoCo are those of its physics; the stub has contacts of robots only."""
    del master
    resting = frame((0.0, 0.0, 0.1)).fields
    table = 'Solid { translation 0 0 -0.05 name "table" boundingObject Box { size 1 1 0.1 } }'
    box = f"DEF BOX Solid {{ {resting} boundingObject Box {{ size 0.4 0.4 0.2 }} {PHYSICS_NODE} }}"
    text = Setting("mujoco").text(table + box + robot(""))
    with running(text, tmp_path, "mujoco") as (webots, onlooker):
        for _ in range(20):
            onlooker.advance()
        points = webots.observer.contact_points("BOX")

    assert len(points) == 4
    for x, y, z in points:
        assert (abs(x), abs(y), z) == pytest.approx((0.2, 0.2, 0.0), abs=0.01)


def test_a_movie_has_a_frame_for_each_40_ms_of_simulated_time(world, simulator, tmp_path):
    """The stub, which renders nothing, refuses to record, and leaves no file."""
    webots, onlooker = world
    path, settings = tmp_path / "movie.mp4", MovieSettings(size=(64, 48))
    if simulator == "stub":
        with pytest.raises(WrongData):
            webots.supervisor.start_movie(path, settings)
        assert not path.exists()
        return

    webots.supervisor.start_movie(path, settings)
    for _ in range(50):
        onlooker.advance()
    recording = webots.supervisor.movie_is_ready()
    webots.supervisor.stop_movie()

    assert (recording, webots.supervisor.movie_is_ready(), webots.supervisor.movie_failed()) == (
        False,
        True,
        False,
    )
    with av.open(str(path)) as file:
        frames = [frame.to_ndarray(format="rgb24").shape for frame in file.decode(video=0)]
    assert set(frames) == {(48, 64, 3)}
    assert len(frames) == pytest.approx(50 * STEP_MS / 40, abs=5)


def test_fields_with_several_values_grow_and_shrink(world):
    """`info` of the WorldInfo is such a field."""
    webots, _ = world
    for text, index in (("last", -1), ("first", 0)):
        webots.supervisor.insert_value("INFO", "info", text, index)
    grown = [webots.supervisor.get_field("INFO", "info", index) for index in (0, 1)]
    length = webots.observer.length("INFO", "info")
    webots.supervisor.remove_value("INFO", "info", 0)
    left = webots.supervisor.get_field("INFO", "info")
    webots.supervisor.remove_value("INFO", "info")

    assert (grown, length, left) == (["first", "last"], 2, "last")
    assert webots.observer.length("INFO", "info") == 0
    with pytest.raises(WrongData, match=r"refuses remove for INFO.info"):
        webots.supervisor.remove_value("INFO", "info")


def test_a_value_cannot_be_inserted_into_a_field_with_one_value(world):
    """Webots prints an error on its console, which the program does not see."""
    webots, _ = world

    with pytest.raises(WrongData, match=r"refuses insert_vec3f for WALL.translation"):
        webots.supervisor.insert_value("WALL", "translation", (0.0, 0.0, 0.0))
    assert webots.observer.length("WALL", "translation") == -1


def test_the_nodes_in_a_field_are_named(world):
    """The world itself is the node with the name ""."""
    webots, _ = world

    inside = webots.observer.nodes_in("", "children")

    assert inside == (("INFO", "WorldInfo"), ("WALL", "Solid"), ("BOX", "Solid"), ("R", "Robot"))
    assert webots.observer.nodes_in("WALL", "boundingObject") == (("", "Box"),)
    with pytest.raises(WrongData, match=r"WALL.translation holds values; read it with get_field"):
        webots.observer.nodes_in("WALL", "translation")


def test_a_node_is_exported_as_text_that_can_be_inserted(world):
    """A program may copy an object of its world."""
    webots, onlooker = world
    text = webots.observer.text("WALL").replace('"wall"', '"copy"')

    webots.supervisor.insert_node(
        "",
        "children",
        f"DEF COPY {text.partition(' ')[2]}" if "DEF" not in text else text.replace("DEF WALL", "DEF COPY"),
    )
    onlooker.advance()
    pose = webots.observer.full_pose("COPY")
    webots.supervisor.remove_node("COPY")

    assert pose[0] == pytest.approx(WALL.position)


def test_the_center_of_mass_of_a_box_is_its_middle(world, simulator):
    """A uniform box has its center of mass at its origin; test_values_mass.py compares other shapes."""
    webots, _ = world

    center = webots.observer.center_of_mass("BOX")

    assert center == pytest.approx(webots.observer.full_pose("BOX")[0], abs=1e-6), simulator


def test_a_world_that_does_not_exist_is_refused_and_the_old_one_is_kept(world):
    """The program learns at once that the world did not change."""
    webots, _ = world

    with pytest.raises(WrongData, match=r"refuses world_load for /nowhere\.wbt"):
        webots.supervisor.load_world("/nowhere.wbt")

    assert webots.observer.exists("BOX")


def test_another_world_is_loaded(simulator, master, tmp_path):
    """A program may go through a list of worlds with one simulator."""
    del master
    first, second = tmp_path / "first", tmp_path / "second.wbt"
    first.mkdir()
    gps = f'GPS {{ name "gps" {BOX.fields} }}'
    with running(Setting(simulator).text(robot("")), first, simulator) as (webots, onlooker):
        before = webots.observer.exists("HERE")
        nodes = 'DEF HERE Solid { name "here" }' + robot(gps, name=webots.robot_name)
        second.write_text(Setting(simulator).text(nodes))
        webots.supervisor.load_world(second)
        webots.wait_available()
        onlooker.connect()
        onlooker.advance()
        after = webots.observer.exists("HERE"), webots.observer.device_pose("gps")
        with pytest.raises(WrongData, match=r"the robot has no device .?sonar"):
            webots.observer.device_pose("sonar")

    assert not before
    assert after[0]
    assert after[1][0] == pytest.approx(BOX.position)
    assert after[1][1] == pytest.approx(quaternion(BOX.rotation))
