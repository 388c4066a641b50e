"""TouchSensors that measure forces, under MuJoCo."""

import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin

G = 9.81


def scale(kind, table="lookupTable [ ]", matter="physics Physics { density -1 mass 1 }", weight_kg=4.0):
    """Return a world with a robot whose top plate is a force sensor of 1 kg, with a weight on the plate."""
    return f"""#VRML_SIM R2023b utf8
    WorldInfo {{ basicTimeStep 8 }}
    Robot {{ name "scale" translation 0 0 0.1 boundingObject Box {{ size 0.5 0.5 0.2 }} children [
      TouchSensor {{ name "plate" type "{kind}" {table} {matter}
        translation 0 0 0.15 rotation 0 1 0 -1.5707963 boundingObject Box {{ size 0.1 0.4 0.4 }} }} ] }}
    Solid {{ translation 0 0 0.35 boundingObject Box {{ size 0.1 0.1 0.1 }}
      physics Physics {{ density -1 mass {weight_kg} }} }}
    """.encode()


def weigh(source):
    """Return the type and the sensor of the plate, after the weight has come to rest."""
    simulation = Simulation.load(source, MujocoPhysics(), "scale", Mode.FAST)
    simulation.step(1600)
    return simulation.robots[0].parts.devices.rows["plate"]


def test_a_plate_weighs_what_lies_on_it():
    """As in Webots, the sensor measures the force on its joint to the robot.

    So the plate's own mass counts.
    """
    _, plate = weigh(scale("force"))

    assert plate.value == pytest.approx(5.0 * G, rel=1e-3)


def test_a_force_goes_through_the_lookup_table():
    """Without a `lookupTable`, the node's default reads ten per newton.

    The field `resolution` rounds the value.
    """
    _, plate = weigh(scale("force", table=""))
    assert plate.value == pytest.approx(50.0 * G, rel=1e-3)

    _, rounded = weigh(scale("force", table="resolution 100"))
    assert rounded.value == 500.0


def test_a_pull_is_no_pressure():
    """The plate hangs below the robot. A sensor with one axis then reads 0; with three, it reads the pull."""
    above, below = b"0 0 0.15 rotation 0 1 0 -1.5707963", b"0 0 0.35 rotation 0 1 0 1.5707963"
    weight, elsewhere = b"Solid { translation 0 0 0.35", b"Solid { translation 3 0 0.05"
    low = scale("force").replace(above, below).replace(weight, elsewhere)

    assert weigh(low)[1].value == 0.0
    x, y, z = weigh(low.replace(b'"force"', b'"force-3d"'))[1].value
    assert (x, y, z) == pytest.approx((G, 0.0, 0.0), abs=1e-3)


def test_three_axes_are_published_as_a_wrench():
    """The sensor measures no torque, so the wrench has the torque 0. As in Webots, `get_type` returns 2."""
    kind, plate = weigh(scale("force-3d"))
    (topic,) = kind.topics(plate)
    codec = message_type(topic.type_name).codec

    assert (topic.name, topic.type_name) == ("values", "geometry_msgs/WrenchStamped")
    sent = codec.decode(codec.encode({topic.reading: topic.source.value}))
    assert sent.wrench.force == pytest.approx((-5.0 * G, 0.0, 0.0), abs=0.05)
    assert sent.wrench.torque == (0.0, 0.0, 0.0)
    services = {path: handler for path, _, handler in kind.services(plate)}
    assert services["get_type"](None) == {"value": 2}


def test_a_sensor_without_physics_measures_nothing():
    """Webots prints a warning for such a sensor. Here the sensor reads 0."""
    assert weigh(scale("force", matter=""))[1].value == 0.0


def test_a_bumper_on_an_arm_feels_what_the_arm_touches():
    """The bumper is at the tip of a rod, which falls to the floor."""
    arm = b"""#VRML_SIM R2023b utf8
    Robot { name "arm" boundingObject Box { size 0.1 0.1 0.2 } children [ HingeJoint {
      jointParameters HingeJointParameters { axis 0 1 0 anchor 0 0 0.5 }
      endPoint Solid { translation 0.4 0 0.5 boundingObject Box { size 0.8 0.05 0.05 }
        physics Physics { density -1 mass 1 }
        children [ TouchSensor { name "tip"
          translation 0.4 0 0 boundingObject Sphere { radius 0.06 } } ] } } ] }
    """
    simulation = Simulation.load(arm, MujocoPhysics())
    tip = simulation.robots[0].sensors["tip"]
    simulation.step(32)
    assert tip.value is False

    simulation.step(1280)

    assert tip.value is True


def test_the_stub_refuses_sensors_of_force():
    """The stub computes no forces, and a client of this robot would read a wrong value."""
    served = b'name "scale" controller "ros" controllerArgs [ "--name=scale" "--synchronize" ]'
    source = scale("force").partition(b"Solid {")[0].replace(b'name "scale"', served)

    with pytest.raises(WorldError, match="a touch sensor that measures force"):
        Simulation.load(source, StubPhysics())


def test_the_bumper_of_a_robotino_is_as_before():
    """Programs for the built-in robot expect that its bumper publishes a bool.

    Other touch sensors publish a wrench.
    """
    robot = Simulation.load(builtin("arena"), MujocoPhysics()).robots[0]
    kind, bumper = robot.parts.devices.rows["touch sensor"]

    assert bumper.value is False
    assert [topic.type_name for topic in kind.topics(bumper)] == ["webots_ros/BoolStamped"]
