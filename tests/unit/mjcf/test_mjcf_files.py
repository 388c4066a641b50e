"""Models that consist of several files: the folders in which MuJoCo searches, and the files' content."""

import mujoco
import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.mjcf.loader import load as load_mjcf
from palaestra_sim.scene.mode import Mode

SCENE = """<mujoco model="cell">
  {head}
  <worldbody>
    <body name="link" pos="0 0 1"><joint name="hinge" axis="0 1 0"/><geom size="0.1"/>{body}</body>
  </worldbody>
  <actuator><motor name="push" joint="hinge"/></actuator>
</mujoco>
"""
ARGUMENTS = '<custom><text name="controllerArgs" data="--name=cell --synchronize"/>{}</custom>'


@pytest.fixture
def world(tmp_path):
    """`world(head, body, files)` writes a project with these files, and returns the path of its world."""

    def write(head="", body="", files=()):
        folder = tmp_path / "project" / "worlds"
        for name, text in {"scene.xml": SCENE.format(head=head, body=body), **dict(files)}.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        return folder / "scene.xml"

    return write


def test_files_are_found_where_mujoco_finds_them(world):
    """MuJoCo searches the folder of the world first, then that of the including file.

    A path with `..` may leave a folder and lead back into the project.
    """
    path = world(
        ARGUMENTS.format(""),
        '<include file="arm/arm.xml"/>',
        {
            "arm/arm.xml": '<mujocoinclude><include file="gripper.xml"/></mujocoinclude>',
            "arm/gripper.xml": '<mujocoinclude><include file="../tool.xml"/></mujocoinclude>',
            "tool.xml": '<mujocoinclude><geom name="tool" size="0.01"/></mujocoinclude>',
        },
    )

    simulation = load_mjcf(path, Mode.FAST)

    assert mujoco.MjModel.from_xml_path(str(path)).geom("tool").id > 0
    assert simulation.robots[0].name == "cell"


def test_what_an_included_file_holds_counts(world):
    """The timestep, the basic step and the device names were once read only from the main file."""
    custom = '<numeric name="basicTimeStep" data="6"/><text name="device:actuator/push" data="arm"/>'
    inner = f"<mujocoinclude><option timestep='0.003'/>{ARGUMENTS.format(custom)}</mujocoinclude>"
    path = world('<include file="defaults.xml"/>', files={"defaults.xml": inner})

    simulation = load_mjcf(path, Mode.FAST)

    assert simulation.basic_step_ms == 6
    assert list(simulation.robots[0].motors) == ["arm"]


@pytest.mark.parametrize(
    ("custom", "name", "remedy"),
    [
        (ARGUMENTS.format(""), "text with the name 'controllerArgs'", "remove this one, because"),
        (
            '<custom><numeric name="basicTimeStep" data="4"/></custom>',
            "numeric with the name 'basicTimeStep'",
            "remove one",
        ),
    ],
)
def test_a_name_in_two_files_is_refused_at_its_line(world, custom, name, remedy):
    """MuJoCo refuses it without a line. A sidecar adds `controllerArgs` to the world of each simulator."""
    head = ARGUMENTS.format('<numeric name="basicTimeStep" data="4"/>') + '<include file="defaults.xml"/>'
    inner = f"<mujocoinclude>\n{custom}</mujocoinclude>"

    with pytest.raises(WorldError, match=rf"defaults\.xml:2:9: scene\.xml has a {name} too; {remedy}"):
        load_mjcf(world(head, files={"defaults.xml": inner}), Mode.FAST)


def test_a_basic_step_that_the_whole_model_does_not_fit_is_refused(world):
    """The last `option` element of the whole model applies, in whichever file it is."""
    head = ARGUMENTS.format('<numeric name="basicTimeStep" data="4"/>') + '<include file="defaults.xml"/>'
    inner = '<mujocoinclude><option timestep="0.003"/></mujocoinclude>'

    with pytest.raises(WorldError, match=r"basicTimeStep 4 is not a multiple of the timestep of 0\.003 s"):
        load_mjcf(world(head, files={"defaults.xml": inner}), Mode.FAST)


OUTSIDE = '<mujocoinclude><body name="outside"/></mujocoinclude>'


def test_the_project_is_the_nearest_folder_that_holds_all_files(world, tmp_path):
    """Models of dm_control and gymnasium-robotics refer to files up to four folders above their own."""
    (tmp_path / "shared.xml").write_text(OUTSIDE)
    inner = '<mujocoinclude><include file="../../shared.xml"/></mujocoinclude>'
    path = world(ARGUMENTS.format(""), '<include file="inner.xml"/>', {"inner.xml": inner})

    assert [it.name for it in load_mjcf(path, Mode.FAST).robots] == ["cell"]


def test_a_file_outside_of_the_root_that_the_user_names_is_refused(world, tmp_path):
    """The message names the file that refers to the outside, and the remedy."""
    (tmp_path / "shared.xml").write_text(OUTSIDE)
    inner = '<mujocoinclude><include file="../../shared.xml"/></mujocoinclude>'
    path = world("", '<include file="inner.xml"/>', {"inner.xml": inner})
    root = tmp_path / "project"

    with pytest.raises(
        WorldError, match=rf"inner\.xml:1:16: .*outside of {root}; copy it .* or name a folder"
    ):
        load_mjcf(path, Mode.FAST, root=root)
    load_mjcf(world(ARGUMENTS.format(""), '<include file="inner.xml"/>'), Mode.FAST, root=tmp_path)


def test_the_whole_file_system_is_no_project(world):
    """A model from an unknown author must not read arbitrary files of the pod."""
    path = world("", f'<include file="{"../" * 20}etc/passwd"/>')

    with pytest.raises(WorldError, match="etc/passwd' leads to the root of the file system; copy it"):
        load_mjcf(path, Mode.FAST)


@pytest.mark.parametrize("element", ['<include file="inner.xml"/>', '<geom type="mesh" mesh="inner"/>'])
def test_a_link_out_of_the_project_is_refused(world, tmp_path, element):
    """A symbolic link out of the project is treated like a path that leads out.

    Links within the project are allowed, because a mounted ConfigMap consists of links.
    """
    (tmp_path / "shared.xml").write_text(OUTSIDE)
    path = world(f'<asset><mesh name="inner" file="inner.xml"/></asset>{ARGUMENTS.format("")}', element)
    (path.parent / "inner.xml").symlink_to(tmp_path / "shared.xml")

    with pytest.raises(WorldError, match=rf"'inner\.xml' leads to {tmp_path}/shared\.xml, which is outside"):
        load_mjcf(path, Mode.FAST)

    (path.parent / "..data.xml").write_text(OUTSIDE)
    (path.parent / "inner.xml").unlink()
    (path.parent / "inner.xml").symlink_to("..data.xml")
    if "include" in element:
        load_mjcf(world(ARGUMENTS.format(""), element), Mode.FAST)


def test_a_rounded_timestep_is_made_exact(world):
    """A joint at 1 rad/s must turn by 1 rad in 1 s.

    With a rounded timestep, clock and physics would drift apart.
    """
    turning = """<option timestep="0.0041667" gravity="0 0 0"/>
        <keyframe><key name="home" qvel="1"/></keyframe>
        <sensor><jointpos joint="hinge"/></sensor>"""
    simulation = load_mjcf(
        world(ARGUMENTS.format('<text name="keyframe" data="home"/>') + turning), Mode.FAST
    )

    for _ in range(40):
        simulation.step(25)

    assert simulation.robots[0].sensors["hinge_jointpos"].value == pytest.approx(1.0, abs=1e-9)


def test_a_model_that_attaches_itself_is_refused(world):
    """MuJoCo attached such a model again and again until the process crashed."""
    path = world('<asset><model name="m" file="other.xml"/></asset>')
    for name, other in (("other.xml", "third.xml"), ("third.xml", "other.xml")):
        text = f'<mujoco><asset><model name="m" file="{other}"/></asset></mujoco>'
        (path.parent / name).write_text(text)

    with pytest.raises(WorldError, match=r"the model contains itself: other\.xml, third\.xml; attach fewer"):
        load_mjcf(path, Mode.FAST)


def test_models_that_attach_each_other_twice_are_counted_before_they_are_made(world):
    """Twenty files with one line each can expand to a million copies of the last file."""
    path = world('<asset><model name="m" file="f0.xml"/></asset>')
    for level in range(20):
        twice = "".join(f'<attach model="m" body="b" prefix="{it}"/>' for it in "xy")
        asset = f'<asset><model name="m" file="f{level + 1}.xml"/></asset>'
        text = f'<mujoco>{asset}<worldbody><body name="b">{twice}</body></worldbody></mujoco>'
        (path.parent / f"f{level}.xml").write_text(text)
    (path.parent / "f20.xml").write_text('<mujoco><worldbody><body name="b"/></worldbody></mujoco>')

    with pytest.raises(WorldError, match=r"the attached models have \d+ elements; the limit is 1000000"):
        load_mjcf(path, Mode.FAST)
