"""`palaestra-mujoco`, as far as it runs before the simulation starts."""

import sys

from palaestra_sim.mujoco.cli import main


def test_without_its_library_it_names_what_to_install(tmp_path, monkeypatch, capsys):
    """The stub's image has no MuJoCo, and a traceback would not explain the remedy."""
    world = tmp_path / "empty.wbt"
    world.write_text("#VRML_SIM R2023b utf8\nWorldInfo { }\n")
    for name in [name for name in sys.modules if name.startswith("palaestra_sim.mujoco.")]:
        if name != "palaestra_sim.mujoco.cli":
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)

    assert main([str(world)]) == 2
    assert "palaestra-mujoco: MuJoCo cannot be imported" in capsys.readouterr().err


def test_it_reports_what_it_makes_of_a_world(tmp_path, capsys):
    """MuJoCo simulates dynamic solids, so `--check` reports no difference for this world."""
    world = tmp_path / "crate.wbt"
    world.write_text(
        "#VRML_SIM R2023b utf8\nWorldInfo { }\nSolid { boundingObject Box { } physics Physics { } }\n"
    )

    assert main(["--check", str(world)]) == 0
    assert capsys.readouterr().out == ""
