"""The world file for a simulator is written as a whole with the simulator's ROS names, or not at all."""

from dataclasses import replace

import pytest

from palaestra_protocol.control import RobotName
from palaestra_sim.errors import SidecarError, WorldError
from palaestra_sim.sidecar import world_files
from palaestra_sim.world import RunIdentity, builtin, ros_name

ARENA = builtin("arena")
IDENTITY = RunIdentity(job="move-to-target", replica=0, group="collect", index=1)
NEIGHBOURS = b"""#VRML_SIM R2023b utf8
EXTERNPROTO "../protos/Box.proto"
Robot { controller "ros" }
Shape { appearance Appearance { texture ImageTexture { url [ "textures/a.png" ] } } }
"""


@pytest.fixture
def source(tmp_path):
    """Return a function that writes a source world into the folder of a project."""

    def make(content=ARENA):
        world = tmp_path / "project" / "worlds" / "arena.wbt"
        world.parent.mkdir(parents=True)
        world.write_bytes(content)
        return world

    return make


def test_a_world_gets_its_own_names_and_its_own_place(source, tmp_path) -> None:
    """The source file stays unchanged, because the worlds of other simulators are generated from it."""
    world = source()

    named = world_files.named(world, tmp_path / "new" / "work", IDENTITY, clock=False)

    assert named == tmp_path / "new" / "work" / "collect-1.wbt"
    assert ros_name(IDENTITY, "robotino").encode() in named.read_bytes()
    assert world.read_bytes() == ARENA


def test_a_world_that_has_its_names_is_written_as_it_is(source, tmp_path) -> None:
    """A person may start a sidecar with a world that already has the names."""
    once = world_files.named(source(), tmp_path / "once", IDENTITY, clock=True)

    twice = world_files.named(once, tmp_path / "twice", IDENTITY, clock=True)

    assert twice.read_bytes() == once.read_bytes()


def test_only_one_simulator_keeps_the_clock(source, tmp_path) -> None:
    """Two simulators with one ROS master would publish two different times on `/clock`."""
    world = source()

    silent = world_files.named(world, tmp_path / "work", IDENTITY, clock=False)

    assert b"--clock" in world.read_bytes()
    assert b"--clock" not in silent.read_bytes()


def test_the_robots_are_listed_by_the_names_that_they_have(source, tmp_path) -> None:
    """The trainer reads the ROS names from /state and never builds a name itself."""
    world = world_files.named(source(), tmp_path, IDENTITY, clock=True)

    robots = world_files.described(world.read_bytes(), "arena")

    name = ros_name(IDENTITY, "robotino")
    assert robots == (RobotName(robot="robotino", ros_name=name, supervisor=True, definition="ROBOTINO"),)


def test_a_robot_without_a_name_is_not_listed() -> None:
    """The controller would build the name from its process id, which is not known before its start."""
    nameless = b'#VRML_SIM R2023b utf8\nRobot { name "r" controller "ros" }\n'

    assert world_files.described(nameless, "world") == ()


def test_what_lies_beside_a_world_lies_beside_its_copy(source, tmp_path) -> None:
    """References in a world are relative to its folder, which may be read-only.

    So the folder of the copy has links to the files next to the source.
    """
    world = source(NEIGHBOURS)
    for folder, name in [(world.parent / "textures", "a.png"), (world.parents[1] / "protos", "Box.proto")]:
        folder.mkdir()
        (folder / name).write_text(name)

    named = world_files.named(world, tmp_path / "work", IDENTITY, clock=False)

    assert (named.parent / "textures" / "a.png").read_text() == "a.png"
    assert (named.parent / "../protos/Box.proto").read_text() == "Box.proto"


def test_a_container_that_starts_again_finds_its_own_links(source, tmp_path) -> None:
    """The work folder survives a restart of the container, so links of the first start are not an error."""
    world = source(NEIGHBOURS)
    (world.parent / "textures").mkdir()

    first = world_files.named(world, tmp_path / "work", IDENTITY, clock=False)
    second = world_files.named(world, tmp_path / "work", IDENTITY, clock=False)

    assert first == second


def test_the_world_of_a_standby_lies_beside_the_first_ones(source, tmp_path) -> None:
    """Both simulators find the same files, and the world of one does not overwrite the world of the other."""
    world = source(NEIGHBOURS)
    (world.parent / "textures").mkdir()

    first, second = (
        world_files.named(world, tmp_path / "work", replace(IDENTITY, slot=slot), clock=False)
        for slot in world_files.SLOTS
    )

    assert (first.name, second.name) == ("collect-1.wbt", "collect-1b.wbt")
    assert first.parent == second.parent
    assert first.read_bytes() != second.read_bytes()


def test_a_broken_world_says_where_and_leaves_nothing(source, tmp_path) -> None:
    """The author of the world gets the line and the column of the mistake."""
    world = source(b"#VRML_SIM R2023b utf8\nRobot {\n")

    with pytest.raises(WorldError, match=r"arena\.wbt:\d+:\d+: "):
        world_files.named(world, tmp_path / "work", IDENTITY, clock=False)
    assert not (tmp_path / "work").exists()


def test_a_missing_world_is_named(tmp_path) -> None:
    """A person who mistyped the path must see it, with the option and the remedy."""
    with pytest.raises(SidecarError, match=r"^--world: .*/no\.wbt: No such file or directory; give a"):
        world_files.named(tmp_path / "no.wbt", tmp_path, IDENTITY, clock=False)


def test_a_world_that_does_not_fit_is_not_there_at_all(source, tmp_path) -> None:
    """A partly written world must not be there at the next start."""
    (tmp_path / "work" / "collect-1.wbt").mkdir(parents=True)

    with pytest.raises(
        SidecarError, match=r"^--work: .*: Is a directory; give a writable folder with space$"
    ):
        world_files.named(source(), tmp_path / "work", IDENTITY, clock=False)
    assert [path.name for path in (tmp_path / "work").iterdir()] == ["collect-1.wbt"]
