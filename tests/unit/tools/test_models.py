"""`python -m tools.models` counts the models that start unchanged."""

from tools.models.__main__ import main

BODY = '<worldbody><body><joint name="hinge"/><geom size="0.1"/></body></worldbody>'
ACTUATOR = '<actuator><motor joint="hinge"/></actuator>'


def test_only_models_with_an_actuator_count_and_a_refused_one_is_named(tmp_path, capsys):
    """A model without an actuator is a part of another model, and is not counted."""
    skin = tmp_path / "skin.png"
    texture = f'<asset><texture type="2d" file="{skin}" width="1" height="1" builtin="flat"/></asset>'
    for name, text in {"good": BODY + ACTUATOR, "part": BODY, "bad": texture + BODY + ACTUATOR}.items():
        (tmp_path / f"{name}.xml").write_text(f"<mujoco>{text}</mujoco>")

    code = main([str(tmp_path)])

    *refused, count = capsys.readouterr().out.splitlines()
    assert code == 1
    assert count == "1 of 2 models with an actuator start as they are"
    assert [line.partition(":")[0] for line in refused] == [f"{tmp_path}/bad.xml"]
