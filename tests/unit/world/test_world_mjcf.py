"""MJCF worlds as text: reading, rejections, and the bytes that generation changes."""

import pytest

from palaestra_sim.world import RunIdentity, WorldError, check, generate, rename, robots, suffix
from palaestra_sim.world.mjcf import describe, whole_step_ms
from tests.tables import for_each

IDENTITY = RunIdentity(job="balance", replica=0, group="collect", index=1)
NAMED = b"""<?xml version="1.0"?>
<mujoco model="cart pole">
  <custom>
    <text name="controllerArgs" data='--clock --name=mine --verbose'/>
  </custom>
  <!-- a motor -->
  <actuator><motor joint="x"/></actuator>
</mujoco>
"""
PLAIN = b'<mujoco>\n  <actuator><motor joint="x"/></actuator>\n</mujoco>\n'


def with_custom(inside, top=b""):
    """Return a world with these elements in `custom`, and with others below the root."""
    return PLAIN.replace(b"<mujoco>", b"<mujoco><custom>" + inside + b"</custom>" + top)


def test_only_the_arguments_change():
    """Comments, quotes and blanks elsewhere stay as their author wrote them."""
    made = generate(NAMED, IDENTITY, clock=False)
    (robot,) = robots(made)

    assert robot.robot == "cart pole"
    assert robot.ros_name.startswith("balance_r0_collect_1a_cart_pole_")
    assert robot.synchronize
    assert robot.supervisor
    arguments = f'"--name={robot.ros_name} --synchronize --verbose"'.encode()
    assert made == NAMED.replace(b"'--clock --name=mine --verbose'", arguments)


def test_a_clock_stays_in_the_one_simulator_that_may_keep_it():
    """Two simulators with one ROS master would publish two different times on `/clock`."""
    assert describe(generate(NAMED, IDENTITY, clock=True)).arguments[0] == "--clock"
    assert "--clock" not in describe(generate(NAMED, IDENTITY, clock=False)).arguments


def test_a_world_without_arguments_gets_them_behind_its_root():
    """Most public models have no element for the arguments."""
    made = generate(PLAIN, IDENTITY, clock=False)

    assert made.startswith(b'<mujoco><custom><text name="controllerArgs" data="--name=balance_')
    assert made.endswith(PLAIN.removeprefix(b"<mujoco>"))


@pytest.mark.parametrize("source", [NAMED, PLAIN])
def test_the_world_of_a_generated_world_is_the_same(source):
    """A generated world may be the source of another job, so generating it again must change nothing."""
    made = generate(source, IDENTITY, clock=True)

    assert generate(made, IDENTITY, clock=True) == made


def test_a_standby_has_the_same_name_with_an_ending():
    """The standby uses the same ROS master as the first simulator, so their names must differ."""
    assert robots(rename(NAMED, "_2"))[0].ros_name == "mine_2"


def test_a_standby_of_a_world_without_a_name_is_refused():
    """The suffix is appended to the ROS name, which this world lacks."""
    with pytest.raises(WorldError, match='the robot "robot" has no ROS name; add <text'):
        rename(PLAIN, "_2")


def test_the_end_of_the_file_name_follows_from_the_content():
    """A world from a ConfigMap has no file name, so the content decides between .wbt and .xml."""
    assert suffix(b"\xef\xbb\xbf \n<mujoco/>") == ".xml"
    assert suffix(b"#VRML_SIM R2023b utf8\n") == ".wbt"


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (b"<mujoco>", "world:1:9: the file is not well-formed XML: "),
        (b"<robot/>", "world:1:1: the root of the file is <robot>; write a model of MuJoCo"),
        (
            b"<mujoco/>",
            "world:1:1: the model has no actuator, so a trainer cannot move anything; add <actuator>",
        ),
        (
            b'<!DOCTYPE m [<!ENTITY e SYSTEM "file:///etc/passwd">]>\n<mujoco>&e;</mujoco>',
            r"world:1:\d+: the file has a document type .*; remove it",
        ),
        (b"<a>" * 300 + b"</a>" * 300, "elements are nested more than 200 deep; use fewer"),
        (with_custom(b'<text name="a"/>'), "a text in <custom> has no data; write both"),
        (with_custom(b'<text name="a" data="1"/>' * 2), "a second text is called 'a'; remove one"),
        (with_custom(b'<text name="controllerArgs" data="__name:=x"/>'), "__name:=x in controllerArgs"),
        (
            with_custom(b'<numeric name="basicTimeStep" data="7"/>', b'<option timestep="0.005"/>'),
            "basicTimeStep 7 is not a multiple of the timestep of 0.005 s in whole ms; write 5",
        ),
        (with_custom(b"", b'<option timestep="x"/>'), "the timestep is not a positive number; write seconds"),
        (
            with_custom(b'<text name="device:motor/x" data="y"/>'),
            "'device:motor/x' does not name a device; write",
        ),
    ],
)
def test_a_mistake_is_refused_with_its_place_and_what_to_write(source, message):
    """The operator checks a world before it creates any object, and without MuJoCo."""
    with pytest.raises(WorldError, match=message):
        check(source)


@pytest.mark.parametrize("path", ["/etc/passwd", "file:x", "a\\b.obj"])
@pytest.mark.parametrize(
    "element",
    [
        '<asset><mesh file="{}"/></asset>',
        '<asset><texture fileback="{}"/></asset>',
        '<compiler meshdir="{}"/>',
    ],
)
def test_a_path_that_does_not_count_from_the_world_is_refused(path, element):
    """A model from the internet must not read other files of the pod."""
    source = with_custom(b"", element.format(path).encode())

    with pytest.raises(WorldError, match="is not relative to the folder of the world; write its path from"):
        check(source, relative_addresses=True)


def test_a_path_that_leads_above_the_world_is_fine():
    """Models of one package share meshes. Only the files themselves show where such a path leads."""
    assets = b'<asset><mesh file="../../arm.stl"/></asset>'

    check(with_custom(b"", b'<compiler meshdir="../stls/fetch"/>' + assets), relative_addresses=True)


@pytest.mark.parametrize(
    ("timestep", "near"),
    [("0.00831", "0.008 or 0.009"), ("0.0123", "0.012 or 0.013"), ("1e-09", "1e-05 or 1.0101e-05")],
)
def test_a_timestep_that_makes_no_short_step_is_refused_with_those_that_do(timestep, near):
    """A basic step takes whole milliseconds, at most 100, and has a limited number of MuJoCo's steps."""
    with pytest.raises(WorldError, match=f"fits the timestep of {timestep} s; write {near}"):
        check(with_custom(b"", f'<option timestep="{timestep}"/>'.encode()))


@pytest.mark.parametrize(
    ("timestep", "step_ms"),
    [
        ("0.002", 2),
        ("0.0041666", 25),
        ("0.00416666", 25),
        ("0.0166667", 50),
        ("0.00833333", 25),
        ("0.00333333", 10),
        ("0.0025", 5),
    ],
)
def test_a_rounded_timestep_makes_the_step_that_is_meant(timestep, step_ms):
    """Steps of 1/240, 1/60, 1/120 and 1/300 s have no finite decimal form, so a file rounds them."""
    assert whole_step_ms(float(timestep)) == step_ms


GROWING = [
    ('<replicate count="1000000000"><geom size="1"/></replicate>', "<replicate> has the size 1e+09"),
    ('<replicate count="1000"><replicate count="1000"/></replicate>', "<replicate> has the size 1e+06"),
    ('<flexcomp type="grid" count="3000 3000 3000"/>', "<flexcomp> has the size 2.7e+10"),
    ('<composite count="3000 3000 1"/>', "<composite> has the size 9e+06"),
    ('<hfield nrow="100000" ncol="100000"/>', "<hfield> has the size 1e+10"),
    ('<texture builtin="flat" width="100000" height="100000"/>', "<texture> has the size 1e+10"),
    ('<camera resolution="100000 100000"/>', "<camera> has the size 1e+10"),
    ('<mesh builtin="supersphere" params="100000 1 1"/>', "<mesh> has the size 1e+10"),
    ('<size nuserdata="1000000000"/>', "<size> has the size 1e+09"),
]


@for_each("element, fact", GROWING)
def test_a_line_that_would_take_all_memory_is_refused(element, fact):
    """MuJoCo allocates memory for any size in the file, and could need gigabytes or minutes for one line."""
    with pytest.raises(WorldError) as refused:
        check(with_custom(b"", element.encode()))

    assert fact in str(refused.value)


def test_large_models_are_no_attack():
    """A height field of a few kilometers and a rope of a thousand parts are legitimate."""
    check(with_custom(b"", b'<asset><hfield nrow="2000" ncol="2000"/></asset><replicate count="1000"/>'))


def test_files_beside_the_world_need_a_world_with_a_file():
    """A world from a ConfigMap has no folder in which its files could be."""
    source = with_custom(b"", b'<asset><mesh file="meshes/arm.obj"/></asset>')

    check(source, relative_addresses=True)
    with pytest.raises(
        WorldError, match="relative to the file of the world, and this world is not in a file; give"
    ):
        check(source)
