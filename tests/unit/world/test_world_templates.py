"""Templates of PROTO files without loops and functions are expanded for the values of each instance."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import Proto, parse, parse_proto

HEADER = "#VRML_SIM R2023b utf8\n# template language: javascript\n"
LAMP = """PROTO Lamp [
  field SFVec3f translation 0 0 0
  field SFFloat height 2.5
  field SFString label "lamp"
  field SFBool fixed TRUE
  field SFColor color 0.5 0 0
  field MFNode parts []
]
{
  %<
    // The number of sections.
    const tall = fields.height.value >= 2;
    let half = fields.height.value / 2;
  >%
  Solid {
    translation IS translation
    name %<= '"' + fields.label.value + ' post"' >%
    model "%<= fields.label.value >% of %<= tall ? 'two' : 'one' >%"
    radarCrossSection %<= half * (1 + fields.color.value.r) >%
    %< if (!fields.fixed.value && tall) { >%
    physics Physics { mass %<= half >% }
    %< } else if (fields.fixed.value) { >%
    contactMaterial "fixed"
    %< } else { >%
    contactMaterial "loose"
    %< } >%
    children IS parts
  }
}
"""


def lamp(text: str = LAMP) -> Proto:
    """Return the PROTO of a file with this text after its header."""
    return parse_proto((HEADER + text).encode(), "Lamp.proto")


def world(instance: str, proto: Proto) -> Simulation:
    """Return the simulation of a world with one instance of a PROTO."""
    nodes = parse(f"#VRML_SIM R2023b utf8\n{instance}\n".encode(), "w.wbt")
    descriptions = Descriptions(protos={proto.name: proto})
    return Simulation.of(nodes, StubPhysics(), "w.wbt", Mode.FAST, descriptions)


def test_the_body_is_that_of_the_default_values() -> None:
    """Readers of the body see what Webots would create without any field."""
    body = lamp().body

    assert body.text("name") == "lamp post"
    assert body.text("model") == "lamp of two"
    assert body.numbers("radarCrossSection") == (1.25 * 1.5,)
    assert body.text("contactMaterial") == "fixed"
    assert body.nodes("physics") == ()


def test_each_instance_has_the_body_of_its_own_values() -> None:
    """A template chooses names, sizes and nodes by the fields of the instance."""
    values = parse(b'#VRML_SIM R2023b utf8\nLamp { fixed FALSE label "b" height 1 }').nodes[0].fields

    body = lamp().with_values(values).body

    assert body.text("name") == "b post"
    assert body.text("model") == "b of one"
    assert body.text("contactMaterial") == "loose"


def test_a_world_has_the_nodes_of_its_templates() -> None:
    """An instance inside another PROTO passes values on by `IS`."""
    outer = parse_proto(
        b'#VRML_SIM R2023b utf8\nPROTO Pair [ field SFString word "x" ] { Group { children [ '
        b'Lamp { label IS word } Lamp { label "y" translation 3 0 0 } ] } }',
        "Pair.proto",
    )
    nodes = parse(b'#VRML_SIM R2023b utf8\nPair { word "z" }\nPair { }\n', "w.wbt")
    descriptions = Descriptions(protos={"Lamp": lamp(), "Pair": outer})
    simulation = Simulation.of(nodes, StubPhysics(), "w.wbt", Mode.FAST, descriptions)

    names = [it.text("name") for it in simulation.tree.nodes.values() if it.proto_name == "Lamp"]

    assert sorted(names) == ["x post", "y post", "y post", "z post"]


@pytest.mark.parametrize(
    ("code", "written"),
    [
        ("fields.height.value - 1", "1.5"),
        ("3 - 1 - 1", "1"),
        ("fields.fixed.value || unknown", "true"),
        ("!fields.fixed.value || 'b'", "b"),
        ("'' && 'b'", ""),
        ("1 === '1'", "false"),
        ("1 !== '1'", "true"),
        ("fields.label.value === 'lamp'", "true"),
        ("'is ' + !fields.fixed.value", "is false"),
        ("1000 * 1000", "1000000"),
        ("'https://x' /* no // end */ + '/*y*/' // the end", "https://x/*y*/"),
    ],
)
def test_a_value_is_written_as_javascript_writes_it(code: str, written: str) -> None:
    """Names and numbers of a template must be those that Webots has."""
    body = lamp(LAMP.replace('"%<= fields.label.value >% of', f'"%<= {code} >% of')).body

    assert body.text("model") == f"{written} of two"


@pytest.mark.parametrize(
    ("statement", "half"),
    [("let half = 9;", 1.25), ("const half = 9;", 1.25), ("half = 9;", 9.0), ("var half = 9;", 9.0)],
)
def test_a_name_that_a_block_declares_ends_with_the_block(statement: str, half: float) -> None:
    """JavaScript has such blocks; without them, an instance would have another size than in Webots."""
    outer = "" if statement.startswith("var") else "let "
    code = f"{outer}half = fields.height.value / 2; if (tall) {{ {statement} }}"
    body = lamp(LAMP.replace("let half = fields.height.value / 2;", code)).body

    assert body.numbers("radarCrossSection") == (half * 1.5,)


def test_an_error_in_the_body_is_at_its_line_of_the_template() -> None:
    """A person corrects the template, not its expansion."""
    text = LAMP.replace("children IS parts", "children IS part")

    with pytest.raises(WorldError, match=r"Lamp.proto:29:.*no field part"):
        lamp(text)


@pytest.mark.parametrize(
    ("code", "named"),
    [
        ("for (let i = 0; i < 3; ++i) { }", "for ("),
        ("while (true) { }", "while ("),
        ("let a = [1, 2];", "[1, 2];"),
        ("let a = fields.label.value.length;", "fields.label.value.length"),
        ("let a = Math.sin(1);", "Math.sin"),
        ("let a = unknown;", "unknown"),
        ("let a = fields.parts.value;", "fields.parts.value"),
        ("let a = fields.absent.value;", "fields.absent.value"),
        ("let a = fields.label.value * 2;", "'lamp' instead of a number"),
        ("let a = 1 / 0;", "a division by zero"),
        ("let a = fields.height.value.x;", "fields.height.value.x"),
        ("let a = fields.color.value.w;", "fields.color.value.w"),
        ("let a = 'at ' + fields.color.value;", "a vector instead of a text"),
        ("let a = (1;", ";"),
        ("let a = true ? 1;", ";"),
        ("let a = 1 == '1';", "1.0 == '1'"),
        ("if (true) {", "a { that is never closed"),
        ("}", "}"),
        ("let a = " + "(" * 60 + "1" + ")" * 60 + ";", "too many levels"),
        ("let a = " + "!" * 5000 + "1;", "too many levels"),
        ("let a = " + "1 + " * 5000 + "1;", "too many levels"),
        ("if (true) { " * 60 + "}" * 60, "too many levels"),
        ("let a = 'ab'; " + "a = a + a; " * 60, "a text of more than 10000 characters"),
        ("let a = 1;" + " " * 100_000, "more than 100000 bytes of code"),
    ],
)
def test_code_that_is_not_expanded_is_named(code: str, named: str) -> None:
    """A partly expanded template would differ from its object in Webots. No code may run for long."""
    with pytest.raises(WorldError) as error:
        lamp(LAMP.replace("const tall", f"{code} const tall"))

    assert f"a template with code that is not expanded ({named}" in str(error.value)
    assert "add this type to a file of stand-ins" in str(error.value)


def test_an_instance_whose_values_do_not_fit_is_named_in_the_world() -> None:
    """The default may work where the value of one instance does not."""
    proto = lamp(LAMP.replace("radarCrossSection %<= half", "radarCrossSection %<= 1 / fields.height.value"))

    with pytest.raises(WorldError, match=r"w.wbt:2:1: Lamp is not expanded \(Lamp.proto.*division by zero"):
        world("Lamp { height 0 }", proto)


def test_the_files_of_all_instances_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each instance with other values is another file in memory."""
    monkeypatch.setattr("palaestra_sim.scene.nodes.expansions.MAX_BYTES", 4 * len(LAMP))
    lamps = "\n".join(f'Lamp {{ label "{number}" translation {number} 0 0 }}' for number in range(9))

    with pytest.raises(WorldError, match="the templates of the world become more than"):
        world(lamps, lamp())
