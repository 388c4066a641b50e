"""The Webots project around a generated world: files that Webots must find, and files that it must not."""

from dataclasses import replace
from pathlib import Path

import pytest

from palaestra_sim.errors import SidecarError
from palaestra_sim.sidecar import project, world_files
from palaestra_sim.world import RunIdentity, builtin, builtin_path

IDENTITY = RunIdentity(job="j", replica=0, group="collect", index=0)
BALL = b"""#VRML_SIM R2023b utf8
Robot { name "robotino" controller "ros" }
Robot { name "ball" controller "roll" }
"""
RELATIVE = BALL + b'Shape { appearance Appearance { texture ImageTexture { url "a.png" } } }\n'


@pytest.fixture
def source(tmp_path):
    """Return a function that writes a world and other files of its project."""

    def make(*files, world="source/worlds/arena.wbt", content=BALL):
        for name in files:
            path = tmp_path / "source" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(name)
        (tmp_path / world).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / world).write_bytes(content)
        return tmp_path / world

    return make


@pytest.fixture
def named(tmp_path):
    """Return a function that generates a world for Webots in the work folder."""

    def write(world, slot="a"):
        identity = replace(IDENTITY, slot=slot)
        return world_files.named(world, tmp_path / "work", identity, clock=True, as_project=True)

    return write


def read(world, path):
    """Return the text of a file, given by its path relative to a world's folder."""
    return (world.parent / path).read_text()


@pytest.mark.parametrize("folder", project.FOLDERS)
def test_webots_finds_the_folders_of_the_project_from_the_generated_world(source, named, folder) -> None:
    """Webots takes the parent of the world's folder as the project, whatever the folder's name is."""
    world = named(source(f"{folder}/x/x.py", world="source/maps/arena.wbt"))

    assert world.parts[-4:] == ("work", "project", "maps", "collect-0.wbt")
    assert read(world, f"../{folder}/x/x.py") == f"{folder}/x/x.py"


def test_a_project_is_linked_as_a_whole(source, named) -> None:
    """A PROTO may use a texture of the project, and a controller may read a file in the worlds' folder."""
    world = named(source("protos/Box.proto", "textures/a.png", "worlds/map.json"))

    assert read(world, "../textures/a.png") == "textures/a.png"
    assert read(world, "map.json") == "worlds/map.json"


def test_a_world_without_a_project_gets_a_folder_and_no_link(source, named, tmp_path) -> None:
    """A ConfigMap may be mounted next to unrelated folders, even in the root, so these are not linked."""
    world = named(source("secret/key", "worlds/other.wbt"))

    assert sorted(path.name for path in (tmp_path / "work").rglob("*")) == [
        "collect-0.wbt",
        "project",
        "worlds",
    ]
    assert world.parent.name == "worlds"


def test_a_shipped_world_has_no_project(named, tmp_path) -> None:
    """The folder of a built-in world is part of a Python package, whose modules are not linked."""
    named(builtin_path("arena"))

    assert [path.name for path in (tmp_path / "work" / "project").iterdir()] == ["worlds"]


def test_a_second_simulator_of_a_world_is_in_a_project_too(source, tmp_path) -> None:
    """Two simulators of a notebook have no job, and the second also needs the project's controllers."""
    content = builtin("arena")
    world = source("controllers/roll/roll.py", content=content)

    again = world_files.renamed(world, tmp_path / "work", "_2", as_project=True)

    assert again.name == "arena_2.wbt"
    assert read(again, "../controllers/roll/roll.py") == "controllers/roll/roll.py"


def test_other_simulators_get_the_world_alone(source, tmp_path) -> None:
    """The stub starts no controllers, so it needs no files of the project."""
    world = source("controllers/roll/roll.py")

    alone = world_files.named(world, tmp_path / "work", IDENTITY, clock=True)

    assert list((tmp_path / "work").iterdir()) == [alone]


def test_the_standby_keeps_the_links_of_the_first(source, named) -> None:
    """The first simulator may just then read a file through a link, so the links are not replaced."""
    first = named(source("controllers/roll/roll.py"))
    link = first.parents[1] / "controllers"
    made = link.lstat().st_mtime_ns

    second = named(source(), slot="b")

    assert (first.parent, second.name) == (second.parent, "collect-0b.wbt")
    assert link.lstat().st_mtime_ns == made


def test_links_are_renewed_when_the_container_starts_again(source, named) -> None:
    """Before the restart, folders of the source may have been removed and new ones added."""
    first = named(source("controllers/roll/roll.py", "old/x"))
    old = first.parents[2] / "project" / "old"
    assert old.is_symlink()
    old.resolve().rename(first.parents[3] / "source" / "new")

    again = named(source())

    assert not old.is_symlink()
    assert read(again, "../new/x") == "old/x"


def test_a_link_to_another_source_is_replaced(source, named, tmp_path) -> None:
    """A person may use the same work folder for a second world."""
    named(source("controllers/roll/roll.py"))
    (tmp_path / "source").rename(tmp_path / "other")

    world = named(tmp_path / "other" / "worlds" / "arena.wbt")

    assert read(world, "../controllers/roll/roll.py") == "controllers/roll/roll.py"


def test_worlds_of_two_folders_of_one_project_do_not_overwrite_each_other(source, named) -> None:
    """A link to the folder of the second world would let the sidecar write into the source project."""
    first = source("controllers/roll/roll.py")
    second = source(world="source/maps/arena.wbt")
    named(first)

    world = named(second)

    assert not world.parent.is_symlink()
    assert [path.name for path in second.parent.iterdir()] == ["arena.wbt"]


def test_a_source_called_as_a_generated_world_stays_as_it_is(source, named) -> None:
    """The generated world has the same name as the source, and replaces only the link to the source."""
    world = source("controllers/roll/roll.py", world="source/worlds/collect-0.wbt")

    for slot in (*world_files.SLOTS, *world_files.SLOTS):
        named(world, slot)

    assert world.read_bytes() == BALL


def test_the_work_folder_is_not_linked_into_itself(source, tmp_path) -> None:
    """With a link to itself in the folder, a program that follows links would never end."""
    world = source("controllers/roll/roll.py")

    made = world_files.named(
        world, tmp_path / "source" / "runs" / "work", IDENTITY, clock=True, as_project=True
    )

    assert [path.name for path in made.parents[1].iterdir() if path.is_symlink()] == ["controllers"]


def test_a_work_folder_around_the_project_of_the_world_is_refused(source, tmp_path) -> None:
    """The sidecar would write the generated world among the sources and replace them by links."""
    world = source("x").parents[1].rename(tmp_path / "project") / "worlds" / "arena.wbt"

    with pytest.raises(
        SidecarError, match=r"^--work: .*: contains the source project of the world; give another"
    ):
        world_files.named(world, tmp_path, IDENTITY, clock=True, as_project=True)
    assert [path.name for path in world.parent.iterdir()] == ["arena.wbt"]


PROTO = BALL.replace(b"utf8\n", b'utf8\nEXTERNPROTO "../../shared/Box.proto"\n')
MODEL = b"""<mujoco><worldbody><include file="../../shared/Box.proto"/></worldbody>
<actuator><motor joint="hinge"/></actuator></mujoco>"""


@pytest.mark.parametrize("content", [PROTO, MODEL], ids=["wbt", "mjcf"])
def test_files_above_the_project_are_found_from_the_generated_world(source, tmp_path, content) -> None:
    """Some packages share PROTOs and meshes between several projects."""
    world = source("shared/Box.proto", "lab/x", world="source/lab/worlds/arena.wbt", content=content)
    (tmp_path / "source/shared/Box.proto").write_text("<mujocoinclude/>")

    made = world_files.named(world, tmp_path / "work", IDENTITY, clock=True)

    assert made.parent == tmp_path / "work" / "project" / "lab" / "worlds"
    assert read(made, "../../shared/Box.proto") == "<mujocoinclude/>"
    assert read(made, "../x") == "lab/x"
    assert world_files.root_of(world, None) == tmp_path / "source"


@pytest.mark.parametrize(
    ("root", "refusal"),
    [
        ("source/lab", "source/lab: the world refers to files outside of this folder; name "),
        (
            "source/shared",
            r"source/shared: is not a folder above .*arena\.wbt; name a folder that contains the world",
        ),
    ],
)
def test_a_root_that_does_not_hold_all_is_refused(source, tmp_path, root, refusal) -> None:
    """The simulator would not find a file, and its error would not name `--root` as the cause."""
    world = source("shared/Box.proto", world="source/lab/worlds/arena.wbt", content=PROTO)

    with pytest.raises(SidecarError, match=f"^--root: {tmp_path}/{refusal}"):
        world_files.named(world, tmp_path / "work", IDENTITY, clock=True, root=tmp_path / root)
    made = world_files.named(world, tmp_path / "work", IDENTITY, clock=True, root=tmp_path)
    assert made.parent == tmp_path / "work" / "project" / "source" / "lab" / "worlds"


def test_the_world_in_its_own_root_has_only_its_neighbors(source, tmp_path) -> None:
    """With `--root` a person declares that nothing above this folder belongs to the project."""
    world = source("worlds/map.json", "secret", content=RELATIVE)

    made = world_files.named(world, tmp_path / "work", IDENTITY, clock=True, root=world.parent)

    assert read(made, "map.json") == "worlds/map.json"
    assert [it.name for it in (tmp_path / "work" / "project").iterdir()] == ["worlds"]


def test_of_the_root_only_what_is_not_the_system_s_is_linked(tmp_path) -> None:
    """The project of a world in `/worlds` is `/`, whose system folders must not be linked."""
    folder = project.lay_out(Path("/usr/arena.wbt"), tmp_path / "project", Path("/"), linked=True)

    assert (folder / "bin").is_symlink()
    assert not {"etc", "proc", "tmp", "var"} & {path.name for path in (tmp_path / "project").iterdir()}


def test_a_world_in_the_root_has_nothing_outside(tmp_path) -> None:
    """The root folder has no parent, so a world in it has no project."""
    folder = project.lay_out(Path("/arena.wbt"), tmp_path / "project", Path("/"), linked=True)

    assert not project.has_project(Path("/arena.wbt"))
    assert [path.name for path in (tmp_path / "project").iterdir()] == ["worlds"]
    assert not {"etc", "proc", "usr", "tmp"} & {path.name for path in folder.iterdir()}


def test_a_path_with_dots_means_the_folders_that_it_leads_to(source, named, tmp_path, monkeypatch) -> None:
    """A person may type `../arena.wbt` in a folder next to the world."""
    source("controllers/roll/roll.py", "worlds/sub/x")
    monkeypatch.chdir(tmp_path / "source" / "worlds" / "sub")

    world = named(Path("../arena.wbt"))

    assert world.parts[-3:] == ("project", "worlds", "collect-0.wbt")
    assert read(world, "../controllers/roll/roll.py") == "controllers/roll/roll.py"


def test_relative_addresses_need_no_project(source, named) -> None:
    """A relative address counts from the folder of the world, so a texture there is found anyway."""
    world = named(source("worlds/a.png", content=RELATIVE))

    assert read(world, "a.png") == "worlds/a.png"


def test_a_controller_without_a_project_is_named_with_the_remedy(source) -> None:
    """Without the controller Webots starts `<generic>` and reports no error."""
    world = source()

    warning = project.missing_controllers(world, BALL, {})

    assert warning == (
        f"--world: {world}: is not in a Webots project, so Webots starts <generic> for controllers that it "
        'lacks: "ball" (controller "roll"); put the project into spec.simulators[].image and name its world '
        "in spec.simulators[].world.file"
    )


@pytest.mark.parametrize("controller", ["ros", "void", "<none>", "<generic>", "<extern>", ""])
def test_a_controller_of_webots_needs_no_project(source, controller) -> None:
    """Webots finds its own controllers without a project."""
    content = BALL.replace(b"roll", controller.encode())

    assert project.missing_controllers(source(), content, {}) is None


def test_a_robot_without_a_controller_needs_no_project(source) -> None:
    """Webots starts its default controller `<generic>` for such a robot."""
    assert project.missing_controllers(source(), BALL.replace(b'controller "roll"', b""), {}) is None


def test_a_world_in_its_project_warns_of_nothing(source) -> None:
    """In a project, the controller may be in a folder that only Webots knows."""
    assert project.missing_controllers(source("protos/Ball.proto"), BALL, {}) is None


@pytest.mark.parametrize(
    ("variable", "path"),
    [
        ("WEBOTS_EXTRA_PROJECT_PATH", "/no/such:{}/source"),
        ("WEBOTS_HOME", "{}/webots"),
    ],
)
def test_controllers_of_other_projects_are_found(source, tmp_path, variable, path) -> None:
    """A project in the image may have the controllers for a world from a ConfigMap."""
    source("controllers/roll/roll.py", "../webots/projects/default/controllers/roll/roll.py")
    world = source(world="elsewhere/worlds/arena.wbt")

    assert project.missing_controllers(world, BALL, {variable: path.format(tmp_path)}) is None


def test_a_warning_of_many_robots_fits_into_a_line(source) -> None:
    """The log truncates long lines, and the remedy at the end must stay readable."""
    balls = b"".join(b'Robot { name "ball %d" controller "roll" }\n' % number for number in range(100))

    warning = project.missing_controllers(source(), BALL + balls, {})

    assert '"ball 18" (controller "roll") and 81 more; put the project into' in warning
