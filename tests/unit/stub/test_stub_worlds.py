"""Users' worlds: PROTOs, stand-ins, scales, and nodes that are left out."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_controller.simulator import RunningSimulator
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.nodes import instantiate
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.stub.outline import obstacle
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import parse, parse_proto
from palaestra_sim.world.stand_ins import load_stand_ins as load
from palaestra_sim.world.stand_ins import shipped
from tests.unit.stub.users_worlds import HEAD, load_world, obstacles

STOOL = """PROTO Stool [ field SFVec3f translation 0 0 0 field SFFloat radius 0.2 field MFNode parts [ ] ]
{ Solid { translation IS translation name "stool" children IS parts
  boundingObject DEF SEAT Cylinder { radius IS radius height 0.5 } } }"""


def test_an_instance_of_a_proto_has_its_values_or_the_defaults():
    """`IS` takes the value of the instance, or else the default of the PROTO."""
    simulation = load_world("Stool { translation 1 2 0 } Stool { radius 0.1 }", STOOL)

    assert obstacles(simulation) == [
        ("cylinder", 1.0, 2.0, (0.4, 0.4, 0.5)),
        ("cylinder", 0.0, 0.0, (0.2, 0.2, 0.5)),
    ]


def test_a_proto_may_be_made_of_protos_and_take_nodes():
    """A value is read in the file in which it was written, however deeply PROTOs are nested."""
    perch = """PROTO Perch [ field SFFloat wide 0.3 ] { Pose { translation 5 0 0 children [
      Stool { radius IS wide parts [ DEF TOP Stool { radius 0.7 } ] } ] } }"""
    simulation = load_world("DEF A Perch { wide 0.6 }", STOOL, perch)

    assert [it[3][0] for it in obstacles(simulation)] == [1.2, 1.4]
    assert {it[1] for it in obstacles(simulation)} == {5.0}
    assert simulation.tree.of_def("A").proto_name == "Perch"
    assert simulation.tree.of_def("A.TOP").proto_name == "Stool"


def test_two_instances_are_nodes_of_their_own():
    """Each instance has its own number and frame, and its own position in the file."""
    simulation = load_world("DEF A Stool { } DEF B Stool { }", STOOL)
    a, b = (simulation.tree.of_def(name) for name in "AB")

    assert a.number != b.number
    assert a.place is not b.place
    assert a.origin.node.span != b.origin.node.span


def test_a_def_inside_of_a_proto_is_found_through_its_instance():
    """Each instance has its own node with that DEF."""
    tree = load_world("DEF A Stool { } DEF B Stool { }", STOOL).tree
    seats = [tree.of_def("SEAT", tree.of_def(name)) for name in ("A", "B")]

    assert [seat.type_name for seat in seats] == ["Cylinder", "Cylinder"]
    assert seats[0] is not seats[1]


def test_a_field_that_a_proto_does_not_have_is_ignored_and_named():
    """Webots warns too: fields change with its releases, and exporters write old ones.

    The warning also helps to find a typo.
    """
    simulation = load_world("Stool { colour 1 }", STOOL)

    (ignored,) = simulation.left_out
    assert str(ignored) == "my.wbt:2:32: the PROTO Stool has no field colour; ignored, as by Webots"


def test_a_proto_inside_itself_ends():
    """Files with such a PROTO are rejected earlier, but a table of PROTOs may still contain one."""
    with pytest.raises(WorldError, match="PROTOs are nested more than 20 deep"):
        load_world("Loop { }", "PROTO Loop [ ] { Group { children [ Loop { } ] } }")


def test_protos_that_double_at_each_level_end(monkeypatch):
    """Twenty such levels would make a million nodes, so the world is rejected."""
    monkeypatch.setattr(instantiate, "MAX_NODES", 1000)

    with pytest.raises(WorldError, match="the world has more than 1000 nodes"):
        load_world("Loop { }", "PROTO Loop [ ] { Group { children [ Loop { } Loop { } ] } }")


@pytest.mark.parametrize(
    ("sensor", "fact"),
    [
        ("DistanceSensor { numberOfRays 1000000 }", "a distance sensor with 1000000 rays; use 1 to 10000"),
        ("Lidar { numberOfLayers 20000 }", "a lidar with 10240000 rays; use 1000000 at most"),
    ],
)
def test_a_number_of_rays_that_is_a_slip_is_refused(sensor, fact):
    """With too many rays the start would take minutes, without any message."""
    with pytest.raises(WorldError, match=fact):
        load_world(f'Robot {{ controller "ros" children [ {sensor} ] }}', leave_out=LeaveOut(names=True))


def test_a_stand_in_has_the_size_of_its_instance_and_can_be_moved():
    """Rays and robots meet the crate at the position to which a supervisor has moved it."""
    simulation = load_world('DEF BOX WoodenBox { translation 1 2 0.3 size 1 1 0.6 name "b" }')
    node = simulation.tree.of_def("BOX")

    assert obstacles(simulation) == [("box", 1.0, 2.0, (1.0, 1.0, 0.6))]
    assert (node.type_name, node.proto_name, node.text("name")) == ("Solid", "WoodenBox", "b")

    node.place.translation = (3.0, 2.0, 0.3)
    assert obstacles(simulation)[0][1] == 3.0


def test_a_stand_in_stands_where_its_proto_would_without_a_translation():
    """The origin of a crate is its center, and its default translation puts it on the floor."""
    simulation = load_world("OilBarrel { }")

    assert simulation.scene.solids[0].heights() == pytest.approx((0.0, 0.88))


def test_a_user_s_stand_in_comes_before_one_that_ships():
    """A user may have measured a crate that differs from the built-in one."""
    own = {**shipped(), **load("[WoodenBox]\nsphere = 0.5", "mine.toml")}

    assert obstacles(load_world("WoodenBox { }", stand_ins=own))[0][0] == "ball"


def test_a_robot_for_ros_is_never_replaced_by_a_stand_in():
    """A client would wait for the replaced robot for ever."""
    own = load("[Rover]\nbox = [1, 1, 1]", "mine.toml")

    assert obstacles(load_world("Rover { }", stand_ins=own))
    with pytest.raises(WorldError, match="the stub simulates no Rover"):
        load_world('Rover { controller "ros" }', stand_ins=own)


@pytest.mark.parametrize("leave_out", [LeaveOut(everything=True), LeaveOut(types=frozenset({"Colosseum"}))])
def test_what_is_left_out_is_not_there_and_is_reported(leave_out):
    """A person must see what the policy will not meet, so each left-out node is named with its position."""
    simulation = load_world("Colosseum { } WoodenBox { }", leave_out=leave_out)

    assert len(simulation.scene.solids) == 1
    assert [str(it) for it in simulation.scene.left_out] == [
        "my.wbt:2:32: the stub simulates no Colosseum; left out"
    ]


def test_what_could_be_simulated_is_never_left_out():
    """`--leave-out WoodenBox` does not remove crates, because the stub can simulate them."""
    simulation = load_world("WoodenBox { }", leave_out=LeaveOut(everything=True))

    assert len(simulation.scene.solids) == 1
    assert simulation.scene.left_out == ()


def test_a_mistake_is_refused_even_if_everything_may_be_left_out():
    """A translation of two numbers is wrong in every simulator."""
    with pytest.raises(WorldError, match=r"Solid\.translation is not 3 numbers"):
        load_world("Solid { translation 1 2 }", leave_out=LeaveOut(everything=True))


def test_a_stand_in_that_leans_has_the_outline_of_one_that_stands():
    """In saved worlds, crates often lean by a few degrees, and a stand-in is a simplified shape anyway."""
    (shape,) = load_world("CardboardBox { size 0.6 0.4 0.5 rotation 1 0 0 0.1 }").scene.solids
    outline = obstacle(shape)

    assert (2.0 * outline.half_x, 2.0 * outline.half_y) == pytest.approx((0.6, 0.4))


def test_a_ceiling_is_in_nobody_s_way():
    """A Plane that faces down is a ceiling and not an obstacle."""
    roof = "Solid { translation 0 0 2.4 rotation 1 0 0 3.14 boundingObject Plane { } }"

    assert load_world(roof).scene.solids == []


def test_a_loose_crate_that_is_left_out_is_nowhere():
    """A robot could push the crate in Webots, so the stub must not keep it as a fixed obstacle."""
    crate = 'Solid { name "crate" physics Physics { } boundingObject Box { } }'

    assert load_world(crate, leave_out=LeaveOut(types=frozenset({"Solid"}))).scene.solids == []


def test_a_device_without_a_robot_is_a_solid():
    """Users put cameras on tripods; nobody reads these cameras, but a robot can hit the tripod."""
    tripod = "Pose { translation 1 0 0 children [ Camera { boundingObject Box { size 0.1 0.1 1 } } ] }"

    assert obstacles(load_world(tripod)) == [("box", 1.0, 0.0, (0.1, 0.1, 1.0))]


def test_a_second_device_of_a_name_can_be_left_out():
    """Webots starts such a world, and finds the first device by that name."""
    robot = 'Robot { controller "ros" children [ GPS { } Pose { translation 0 0 1 children [ GPS { } ] } ] }'
    simulation = load_world(robot, leave_out=LeaveOut(everything=True, names=True))

    assert simulation.robots[0].sensors["gps"].place.translation == (0.0, 0.0, 0.0)
    assert simulation.robots[0].sensors["gps"].place.height_m == 0.0
    assert ["a second device 'gps'" in str(it) for it in simulation.left_out] == [True]


DOOR = """Pose { translation 1 0 0 children [ HingeJoint { endPoint Solid { translation 0 2 0 %s
  boundingObject Box { size 1 0.1 2 } } } ] }"""


def test_a_door_on_a_hinge_without_physics_stands_where_it_is():
    """A door without physics does not move in Webots either."""
    assert obstacles(load_world(DOOR % "")) == [("box", 1.0, 2.0, (1.0, 0.1, 2.0))]


def test_a_door_that_swings_is_refused():
    """A robot in Webots would push the door open, and the stub cannot move the door."""
    with pytest.raises(WorldError, match="a Solid with physics moves when it is pushed"):
        load_world(DOOR % "physics Physics { }")


def test_a_conveyor_belt_is_refused():
    """A conveyor belt in Webots moves the objects on it, and the stub cannot move them."""
    with pytest.raises(WorldError, match="a Track with devices moves the objects on it"):
        load_world("Track { device [ LinearMotor { } ] boundingObject Box { } }")


def test_the_cylinders_of_an_old_proto_stand_along_its_y_axis():
    """As in Webots, cylinders of an old file are turned. Boxes and stand-ins have no such axis."""
    post = "PROTO Post [ ] { Solid { boundingObject Cylinder { radius 0.1 height 2 } } }"
    old = parse_proto(f"#VRML_SIM R2021b utf8\n{post}".encode(), "Post.proto")
    simulation = Simulation.of(
        parse(f"{HEAD}Post {{ }}".encode()), StubPhysics(), descriptions=Descriptions(protos={"Post": old})
    )
    (shape,) = simulation.scene.solids

    assert shape.heights() == pytest.approx((-0.1, 0.1))
    assert obstacle(shape).half_y == pytest.approx(1.0)


STRETCHED = """Solid { boundingObject Transform { translation 1 0 0 scale 3 2 1 children [
  Transform { translation 1 0 0 children [ Box { size 1 1 1 } ] } ] } }"""
STRETCHED_MESH = """Solid { boundingObject Transform { scale 1 2 1 children [
  IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 1 1 ] } } ] } }"""
BOX = "Solid { translation 1 0 0 boundingObject Box { size 1 2 3 } }"


@pytest.mark.parametrize(
    ("world", "found"),
    [
        (f"Transform {{ scale 2 2 2 children [ {BOX} ] }}", ("box", 2.0, 0.0, (2.0, 4.0, 6.0))),
        (
            STRETCHED,
            ("box", 4.0, 0.0, (3.0, 2.0, 1.0)),
        ),
        (
            "Solid { scale 2 2 2 boundingObject Cylinder { radius 1 height 1 } }",
            ("cylinder", 0.0, 0.0, (4.0, 4.0, 2.0)),
        ),
        (
            STRETCHED_MESH,
            ("box", 0.5, 1.0, (1.0, 2.0, 1.0)),
        ),
    ],
)
def test_a_scale_makes_what_is_in_a_transform_larger(world, found):
    """Positions and sizes are scaled, also those of a Solid from before R2023a."""
    assert obstacles(load_world(world)) == [found]


@pytest.mark.parametrize(
    ("world", "fact"),
    [
        (f"Transform {{ scale 1 2 1 children [ {BOX} ] }}", "a Transform with a scale that distorts"),
        (
            "Solid { boundingObject Transform { scale 1 2 1 children [ Sphere { } ] } }",
            "a Sphere that a scale",
        ),
        (
            "Solid { boundingObject Transform { scale 1 2 1 children [ Pose { rotation 0 0 1 1 } ] } }",
            "a Pose with a scale that distorts",
        ),
        ('Robot { scale 2 2 2 controller "ros" }', "a robot with a scale"),
        (
            'Robot { controller "ros" children [ Transform { scale 2 2 2 children [ HingeJoint { } ] } ] }',
            "a HingeJoint in a Transform with a scale",
        ),
    ],
)
def test_a_scale_that_the_stub_cannot_follow_is_refused(world, fact):
    """A user can leave out the node, and then none of its parts exists."""
    with pytest.raises(WorldError, match=fact):
        load_world(world, leave_out=LeaveOut(names=True))

    assert load_world(world, leave_out=LeaveOut(everything=True, names=True)).scene.solids == []


def test_the_scale_of_a_stand_in_is_a_field_of_its_own():
    """Some PROTOs have a field `scale` of one number, which is not the scale of a Transform."""
    own = load("[Bush]\nfields = 'SFFloat scale 1'\nbox = ['scale', 1, 1]", "mine.toml")

    assert obstacles(load_world("Bush { scale 3 }", stand_ins=own)) == [("box", 0.0, 0.0, (3.0, 1.0, 1.0))]


def test_terrain_as_a_bounding_object_is_refused_by_name_and_can_be_left_out():
    """Robots of the stub stand on one level, so terrain would lie under or above them without an effect."""
    world = "Solid { boundingObject ElevationGrid { } } Solid { boundingObject Box { } }"
    with pytest.raises(WorldError, match="the stub simulates no ElevationGrid as a boundingObject"):
        load_world(world)

    assert len(load_world(world, leave_out=LeaveOut(types=frozenset({"ElevationGrid"}))).scene.solids) == 1


def test_a_world_in_a_project_finds_its_protos(ros, tmp_path):
    """The addresses of the PROTOs are relative to the folder of the world."""
    (tmp_path / "protos").mkdir()
    (tmp_path / "worlds").mkdir()
    (tmp_path / "protos" / "Stool.proto").write_text(HEAD + STOOL)
    (tmp_path / "protos" / "Lamp.proto").write_text(f"{HEAD}PROTO Lamp [ ] {{ %< call(1); >% Solid {{ }} }}")
    world = tmp_path / "worlds" / "mine.wbt"
    world.write_text(f'{HEAD}EXTERNPROTO "../protos/Stool.proto"\nStool {{ }}')

    assert (
        len(RunningSimulator(world, Loader(physics=StubPhysics), ros.make_node).simulation.scene.solids) == 1
    )

    world.write_text(f'{HEAD}EXTERNPROTO "../protos/Lamp.proto"\nLamp {{ }}')
    with pytest.raises(WorldError, match=r"mine.wbt:3:1: Lamp is not expanded \(.*Lamp.proto:2:.*template"):
        RunningSimulator(world, Loader(physics=StubPhysics), ros.make_node)

    lamp = load("[Lamp]\ncylinder = { radius = 0.1, height = 2 }", "mine.toml")
    assert (
        len(
            RunningSimulator(
                world, Loader(physics=StubPhysics, stand_ins=lamp), ros.make_node
            ).simulation.scene.solids
        )
        == 1
    )
