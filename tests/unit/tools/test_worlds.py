"""The count of public worlds that start in a simulator."""

import pytest

from tools.worlds.__main__ import main

WORLD = """#VRML_SIM R2023b utf8
WorldInfo { }
Robot { name "r" controller "CONTROLLER" controllerArgs [ ] children [ PARTS ] }
"""
ARM = "HingeJoint { device [ RotationalMotor { } PositionSensor { } ] endPoint Solid { } }"


@pytest.fixture
def folder(tmp_path):
    """Return the folder of a project with an empty folder `worlds`."""
    (tmp_path / "worlds").mkdir()
    return tmp_path


def count(folder, capsys):
    """Return the exit code and the printed lines of the count with the stub."""
    code = main([str(folder), "--simulator", "palaestra-stub"])
    return code, capsys.readouterr().out.splitlines()


def test_robots_get_the_controller_ros_and_equal_worlds_count_once(folder, capsys):
    """Copies of a world would distort the count, and a client can drive only robots with controller ros.

    A world counts as trainable if a robot keeps a motor and a sensor. A file without a world's header is not
    counted.
    """
    worlds = {
        "arm.wbt": WORLD.replace("CONTROLLER", "mine").replace("PARTS", ARM),
        "arm again.wbt": WORLD.replace("CONTROLLER", "mine").replace("PARTS", ARM),
        "bare.wbt": WORLD.replace("CONTROLLER", "<extern>").replace("PARTS", "Mystery { }"),
        "part.wbt": "Solid { }",
    }
    for name, text in worlds.items():
        (folder / "worlds" / name).write_text(text)

    code, lines = count(folder, capsys)

    assert code == 0
    assert lines[-1] == (
        "palaestra-stub: 1 of 2 worlds start as they are, 2 with --leave-out all; "
        "1 of these keep a robot with a motor and a sensor"
    )
    assert "   1 the stub simulates no Mystery on a robot" in lines[-2]
    assert sorted(path.name for path in (folder / "worlds").iterdir()) == sorted(worlds)


def test_a_robot_without_a_controller_gets_one_only_if_it_is_the_only_robot(folder, capsys):
    """A starter world has one robot with the controller void, and its users set the controller.

    In a world with a driven robot, such a robot belongs to the scenery.
    """
    starter = WORLD.replace("CONTROLLER", "void").replace("PARTS", ARM)
    statue = starter.replace(ARM, "Mystery { }").replace('"r"', '"statue"').partition("Robot")
    (folder / "worlds" / "starter.wbt").write_text(starter)
    (folder / "worlds" / "scene.wbt").write_text(starter.replace("void", "mine") + "".join(statue[1:]))

    _, lines = count(folder, capsys)

    (line,) = lines
    assert line == (
        "palaestra-stub: 2 of 2 worlds start as they are, 2 with --leave-out all; "
        "2 of these keep a robot with a motor and a sensor"
    )


def test_a_robot_whose_proto_names_its_controller_is_kept(folder, capsys):
    """Users set such a robot's controller in their world, so the world counts as trainable."""
    (folder / "protos").mkdir()
    (folder / "protos" / "Arm.proto").write_text(
        '#VRML_SIM R2023b utf8\nPROTO Arm [ field SFString controller "mine" ] '
        f'{{ Robot {{ name "arm" controller IS controller children [ {ARM} ] }} }}'
    )
    (folder / "worlds" / "arm.wbt").write_text(
        '#VRML_SIM R2023b utf8\nEXTERNPROTO "../protos/Arm.proto"\nWorldInfo { }\nArm { }'
    )

    _, lines = count(folder, capsys)

    assert lines[-1].endswith("1 of these keep a robot with a motor and a sensor")
