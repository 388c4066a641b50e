"""`palaestra-stub --check` reports how the stub changes a world, before anything starts."""

import pytest

from palaestra_sim.stub.cli import main
from palaestra_sim.world import builtin

HEAD = "#VRML_SIM R2023b utf8\n"


@pytest.fixture
def check(tmp_path, capsys):
    """`check(world)` returns the exit code and the printed lines."""

    def run(world, *options):
        path = tmp_path / "my.wbt"
        path.write_bytes(world if isinstance(world, bytes) else f"{HEAD}{world}".encode())
        code = main([str(path), "--check", *options])
        out, err = capsys.readouterr()
        return code, (out or err).splitlines()

    return run


def test_a_world_that_can_start_is_described(check):
    """The report lists the robots with their drives and devices; it needs no ROS master."""
    assert check(builtin("arena")) == (
        0,
        [
            (
                'robot "robotino": controller "ros", omnidirectional drive on 3 wheels,'
                " 9 DistanceSensor, 3 PositionSensor, 3 RotationalMotor, 1 TouchSensor"
            )
        ],
    )


def test_an_old_world_is_turned_and_the_check_says_so(check):
    """A fifth of public worlds have such old axes, which the stub converts."""
    old = b"#VRML_SIM R2020a utf8\nWorldInfo { } WoodenBox { }"

    code, lines = check(old)

    assert code == 0
    assert lines[-1] == "a world of R2020a: its nodes are converted to the current axes, as in Webots"


def test_stand_ins_and_controllers_that_do_not_run_are_named(check):
    """Stand-ins and controllers that do not run differ from Webots, so the report names both."""
    code, lines = check('E-puck { name "a" controller "patrol" } WoodenBox { } WoodenBox { } Floor { }')

    assert code == 0
    assert lines[0].startswith(
        'robot "a": controller "patrol" does not run here, differential drive on 2 wheels'
    )
    assert lines[1:] == ["stand-ins, which stand still: 1 Floor, 2 WoodenBox"]


def test_all_that_the_stub_lacks_is_listed_at_once(check):
    """A person can see all problems before a start; the exit code is that of a failed start."""
    code, lines = check('Colosseum { }\nRobot { controller "ros" children [ Minotaur { } ] }\nColosseum { }')

    assert code == 2
    assert lines[1:] == [
        "cannot be simulated; --leave-out leaves it out:",
        "my.wbt:2:1: the stub simulates no Colosseum (2 places, in lines 2, 4); left out",
        "my.wbt:3:37: the stub simulates no Minotaur on a robot; left out",
    ]


def test_devices_without_readings_are_named(check):
    """A world with a camera starts, but a client would wait for images for ever."""
    code, lines = check('Robot { controller "ros" children [ Camera { } RangeFinder { } LED { } ] }')

    assert code == 0
    assert lines[1:] == ["devices without readings, whose enable returns failure: 1 Camera, 1 RangeFinder"]


def test_a_name_that_the_sidecar_puts_in_is_not_missed(check):
    """The sidecar adds `--name`, which most worlds with the controller ros lack."""
    assert check('Robot { controller "ros" }')[0] == 0


def test_a_node_that_uses_itself_ends_in_one_sentence(check):
    """Without a limit, such a node would cause a RecursionError with a long traceback."""
    code, lines = check("DEF A Group { children [ USE A ] }")

    assert (code, len(lines)) == (2, 1)
    assert "nested too deep, or one uses itself" in lines[0]


def test_nodes_that_double_end_in_one_sentence(check, monkeypatch):
    """Each line doubles the number of nodes, so sixty lines would make 2 to the 60th nodes."""
    monkeypatch.setattr("palaestra_sim.scene.nodes.instantiate.MAX_NODES", 500)
    lines = [
        f"DEF A{level} Group {{ children [ USE A{level - 1} USE A{level - 1} ] }}" for level in range(1, 60)
    ]

    code, said = check("\n".join(["DEF A0 Solid { }", *lines]))

    assert (code, len(said)) == (2, 1)
    assert "the world has more than 500 nodes; remove a cycle of PROTOs or of USE" in said[0]


def test_a_link_to_a_device_is_not_read(tmp_path, capsys):
    """A link may lead to /dev/zero, which has no end."""
    (tmp_path / "my.wbt").symlink_to("/dev/zero")

    assert main([str(tmp_path / "my.wbt"), "--check"]) == 2
    assert capsys.readouterr().err.endswith("my.wbt: is not a regular file\n")


def test_stand_ins_that_are_no_text_are_refused(check, tmp_path):
    """The table may be a link to a device without an end, or be saved in another encoding."""
    endless, latin = tmp_path / "endless.toml", tmp_path / "latin.toml"
    endless.symlink_to("/dev/zero")
    latin.write_bytes("# Stühle".encode("latin-1"))

    for table, fact in ((endless, "is not a regular file"), (latin, "this is not UTF-8; save it as UTF-8")):
        assert check("", "--stand-ins", str(table)) == (2, [f"palaestra-stub: {table}: {fact}"])


def test_what_is_left_out_by_choice_is_no_obstacle(check):
    """With `--leave-out all` the world can start, so the check must succeed."""
    world = "Colosseum { } Solid { boundingObject Cone { } }"

    assert check(world)[0] == 2
    assert check(world, "--leave-out", "Colosseum")[0] == 2
    code, lines = check(world, "--leave-out", "all")

    assert code == 0
    assert lines[0] == "left out:"
    assert "Colosseum" in lines[1]


def test_a_field_that_a_proto_does_not_have_is_named_and_no_obstacle(check, tmp_path):
    """Webots also warns about such a field and ignores it."""
    folder = tmp_path / "protos"
    folder.mkdir()
    (folder / "Stool.proto").write_text(f"{HEAD}PROTO Stool [ field SFFloat size 1 ] {{ Solid {{ }} }}")

    code, lines = check('EXTERNPROTO "protos/Stool.proto"\nStool { colour 1 }')

    assert code == 0
    assert lines == ["my.wbt:3:1: the PROTO Stool has no field colour; ignored, as by Webots"]


def test_a_user_s_stand_ins_count(check, tmp_path):
    """The check describes the world as it would start with the same options."""
    table = tmp_path / "mine.toml"
    table.write_text("[Colosseum]\nflat = true\n")

    assert check("Colosseum { }", "--stand-ins", str(table))[0] == 0


def test_a_mistake_is_an_error(check):
    """A world with a mistake cannot start, so there is no report on it."""
    code, [line] = check("Solid { translation 1 }")

    assert code == 2
    assert "Solid.translation is not 3 numbers" in line


def test_values_that_differ_from_webots_are_named(check):
    """A policy that is trained with these values would read other values in Webots."""
    mesh = "IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 0 1 ] } }"
    devices = """DistanceSensor { type "infra-red" } Lidar { numberOfLayers 4 }
        DistanceSensor { name "up" type "Sonar" rotation 0 1 0 -1 } Gyro { }
        Solid { physics Physics { } children [ Accelerometer { } ] }"""
    robot = f'Robot {{ controller "ros" controllerArgs ["--name=a" "--synchronize"] children [ {devices} ] }}'

    look = 'PBRAppearance { baseColorMap ImageTexture { url "https://example.com/line.png" } }'
    shape = f"Shape {{ appearance {look} geometry Plane {{ }} }}"

    code, lines = check(f"Solid {{ children [ {shape} ] boundingObject {mesh} }} {robot}")

    assert code == 0
    assert lines[1:] == [
        "differs from Webots: 1 infra-red DistanceSensor: rays pass through the robot itself",
        "differs from Webots: 1 Shape with a texture that infra-red DistanceSensors do not see",
        "differs from Webots: 1 Lidar: rays pass through the robot itself",
        "differs from Webots: 1 Gyro on a robot without physics: Webots measures nothing there",
        "differs from Webots: 1 IndexedFaceSet as boundingObject: robots touch its convex hull",
        "differs from Webots: no Plane as boundingObject: rays meet a floor at height 0",
    ]
