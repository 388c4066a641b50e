"""Joints under MuJoCo: arms with masses, pendulums, and the effects of clients on them."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin

G = 9.81
HEADER = "#VRML_SIM R2023b utf8\nWorldInfo { basicTimeStep 8 }\n"
MOTOR = 'RotationalMotor { name "motor" maxTorque 100 }'


def arm(device=MOTOR, length=1.0, mass_kg=2.0, parameters="", more="", *, physics=True):
    """Return a world with a robot that holds a level rod by one end, 1.5 m above the floor."""
    matter = f"physics Physics {{ density -1 mass {mass_kg} }}" if physics else ""
    return f"""{HEADER}
    Robot {{ name "arm" translation 0 0 1 boundingObject Box {{ size 0.2 0.2 0.2 }} children [
      DEF HINGE HingeJoint {{
        jointParameters HingeJointParameters {{ axis 0 1 0 anchor 0.2 0 0.5 {parameters} }}
        device [ {device} PositionSensor {{ name "angle" }} ]
        endPoint DEF ROD Solid {{
          translation {0.2 + length / 2.0} 0 0.5
          boundingObject Box {{ size {length} 0.05 0.05 }} {matter} children [ {more} ] }} }} ] }}
    """.encode()


def carrying(part):
    """Return the built-in arena, whose robot has one more part."""
    return builtin("arena").replace(b"supervisor TRUE\n  children [", b"children [" + part.encode(), 1)


def load(source, physics=MujocoPhysics):
    """Return the simulation of a world, and its first robot."""
    simulation = Simulation.load(source, physics(), "arm", Mode.FAST)
    return simulation, simulation.robots[0]


@settings(max_examples=5, deadline=None)
@given(length=st.floats(0.2, 2.0), mass_kg=st.floats(0.1, 20.0))
def test_a_motor_holds_a_rod_with_the_torque_of_its_weight(length, mass_kg):
    """A level rod of mass m and length l needs m g l / 2 to stay level."""
    simulation, robot = load(
        arm('RotationalMotor { name "motor" maxTorque 1000 }', length=length, mass_kg=mass_kg)
    )

    simulation.step(2000)

    motor = robot.motors["motor"]
    assert motor.angle_rad == pytest.approx(0.0, abs=1e-4)
    assert motor.feedback_nm == pytest.approx(-mass_kg * G * length / 2.0, rel=1e-3)


def test_a_weak_motor_does_not_hold_a_rod():
    """The rod needs a torque of ten newton meters, and the motor has five."""
    simulation, robot = load(arm('RotationalMotor { name "motor" maxTorque 5 }'))

    simulation.step(320)

    assert robot.motors["motor"].angle_rad > 0.3
    assert robot.motors["motor"].feedback_nm == -5.0


@settings(max_examples=5, deadline=None)
@given(length=st.floats(0.3, 1.2), mass_kg=st.floats(0.1, 20.0))
def test_a_rod_without_a_motor_swings_as_a_pendulum(length, mass_kg):
    """For small swings the period is 2 pi sqrt(2 l / 3 g), whatever the mass.

    At 0.1 rad it is 0.1 % longer.
    """
    simulation, robot = load(arm("", length=length, mass_kg=mass_kg))
    hanging = math.pi / 2.0
    simulation.set_joint_position(simulation.tree.of_def("HINGE"), hanging - 0.1, 1)
    crossings = []
    before = -0.1
    for step in range(1, 500):
        simulation.step(8)
        now = robot.sensors["angle"].value - hanging
        if before < 0.0 <= now:
            crossings.append(0.008 * (step - now / (now - before)))
        before = now

    period = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    assert period == pytest.approx(2.0 * math.pi * math.sqrt(2.0 * length / (3.0 * G)), rel=5e-3)


def test_damping_and_friction_slow_a_pendulum():
    """A damped rod comes to rest pointing down.

    With enough static friction the rod does not begin to fall.
    """
    damped, swinging = load(arm("", parameters="dampingConstant 5"))
    damped.step(8000)
    stuck, held = load(arm("", parameters="staticFriction 15"))
    stuck.step(1000)

    assert swinging.sensors["angle"].value == pytest.approx(math.pi / 2.0, abs=1e-3)
    assert held.sensors["angle"].value == pytest.approx(0.0, abs=1e-2)


def test_a_spring_holds_a_rod_where_the_torques_are_equal():
    """The rod comes to rest at the angle at which the two torques are equal.

    The spring's torque is 100 times the angle. The weight's torque is m g l / 2 times the cosine of the
    angle.
    """
    simulation, robot = load(arm("", parameters="springConstant 100 dampingConstant 10"))

    simulation.step(4000)

    angle = robot.sensors["angle"].value
    assert 100.0 * angle == pytest.approx(2.0 * G * 0.5 * math.cos(angle), rel=1e-3)


def test_stops_hold_what_a_motor_turns():
    """MuJoCo's stops are soft: under the motor's torque they yield by less than half a degree."""
    simulation, robot = load(arm(parameters="minStop -0.5 maxStop 0.5"))
    motor = robot.motors["motor"]
    motor.set_position(math.inf)
    motor.set_velocity(2.0)

    simulation.step(1000)

    assert motor.angle_rad == pytest.approx(0.5, abs=math.radians(0.5))


@pytest.mark.parametrize("acceleration", [-1.0, 10.0])
def test_an_arm_follows_its_commands_as_in_the_stub(acceleration):
    """Every two seconds a new position is commanded.

    The arm reaches each position within two degrees, and the last one within 2 mrad.
    """
    pair = [load(arm(), physics) for physics in (MujocoPhysics, StubPhysics)]
    motors = [robot.motors["motor"] for _, robot in pair]
    for motor in motors:
        motor.set_acceleration(acceleration)
        motor.set_velocity(2.0)
    for target in (0.5, -1.0, 1.2, 0.0):
        for motor in motors:
            motor.set_position(target)
        for _ in range(10):
            for simulation, _ in pair:
                simulation.step(200)
            assert motors[0].angle_rad == pytest.approx(motors[1].angle_rad, abs=math.radians(2.0))

    assert motors[0].angle_rad == pytest.approx(motors[1].angle_rad, abs=2e-3)


def test_a_strong_motor_does_not_pass_a_stop():
    """With MuJoCo's default softness, a motor of 500 N pushed 1 kg a centimeter beyond its stop."""
    lift = """SliderJoint { jointParameters JointParameters { axis 0 0 1 minStop -0.1 maxStop 0.3 }
      device [ LinearMotor { name "lift" maxVelocity 1 maxForce 500 } ]
      endPoint Solid { translation 0 0 1 boundingObject Box { size 0.1 0.1 0.1 }
        physics Physics { density -1 mass 1 } children [ GPS { name "top" } ] } }"""
    simulation, robot = load(f'{HEADER} Robot {{ name "arm" children [ {lift} ] }}'.encode())
    robot.motors["lift"].set_position(5.0)

    simulation.step(2000)

    assert robot.sensors["top"].value[2] == pytest.approx(1.3, abs=1e-3)


def test_a_joint_whose_end_has_no_physics_follows_exactly():
    """As in Webots, a joint is kinematic if its end has no `physics`."""
    (mujoco, strong), (stub, exact) = (load(arm(physics=False), it) for it in (MujocoPhysics, StubPhysics))
    for robot in (strong, exact):
        robot.motors["motor"].set_position(1.0)

    mujoco.step(400)
    stub.step(400)

    assert not strong.links
    assert strong.motors["motor"].angle_rad == exact.motors["motor"].angle_rad


def test_links_on_links_move_together():
    """The position of the outer link follows the angles of both joints."""
    outer = """DEF WRIST HingeJoint {
      jointParameters HingeJointParameters { axis 0 1 0 anchor 0.5 0 0 }
      device RotationalMotor { name "wrist" maxTorque 50 }
      endPoint DEF HAND Solid { translation 0.7 0 0 boundingObject Box { size 0.4 0.05 0.05 }
        physics Physics { density -1 mass 0.5 } } }"""
    simulation, robot = load(arm(more=outer))
    robot.motors["motor"].set_position(-math.pi / 2.0)
    robot.motors["wrist"].set_position(math.pi / 2.0)

    simulation.step(4000)

    assert simulation.tree.of_def("HAND").place.world_pose.position == pytest.approx(
        (0.4, 0.0, 2.5), abs=5e-3
    )


def test_an_arm_pushes_a_crate_and_not_its_own_robot():
    """The rod sweeps through its own robot's base, which does not stop it, and knocks a ball away."""
    ball = b"""DEF BALL Solid { translation 0.6 0 0.1 boundingObject Sphere { radius 0.1 }
      physics Physics { density -1 mass 0.1 } }"""
    simulation, robot = load(arm(length=1.45).replace(b"size 0.2 0.2 0.2", b"size 0.6 0.2 1.2") + ball)
    robot.motors["motor"].set_position(2.0)

    simulation.step(3000)

    assert robot.motors["motor"].angle_rad == pytest.approx(2.0, abs=0.02)
    x, y, _ = simulation.tree.of_def("BALL").place.world_pose.position
    assert math.hypot(x - 0.6, y) > 0.1


def test_rays_pass_the_links_of_their_own_robot():
    """A robot's own links and body do not stop its rays, but the links stop the rays of another robot."""
    sensor = b"""DistanceSensor { name "ray" type "laser" translation 0.3 0 0.5
      lookupTable [ 0 0 0, 10 10 0 ] } """
    wall = b"Solid { translation 4 0 1.5 boundingObject Box { size 0.2 4 3 } }"
    source = arm().replace(b"DEF HINGE", sensor + b"DEF HINGE")
    other = b'Robot { name "other" translation -1 0 1.0 children [ ' + sensor + b" ] }"
    simulation, robot = load(source + wall + other)

    simulation.step(8)

    assert robot.sensors["ray"].value == pytest.approx(3.6, abs=1e-3)
    assert simulation.robots[1].sensors["ray"].value < 1.0


def test_a_supervisor_puts_a_joint_where_it_stays():
    """An environment sets the joints of an arm for a new episode.

    The motor must then hold the joint there.
    """
    simulation, robot = load(arm())
    simulation.set_joint_position(simulation.tree.of_def("HINGE"), -1.0, 1)

    simulation.step(200)

    assert robot.motors["motor"].angle_rad == pytest.approx(-1.0, abs=1e-3)


def test_a_saved_state_brings_an_arm_back():
    """After `load_state` the arm is at its saved angle and at rest."""
    simulation, robot = load(arm(""))
    node = robot.parts.node
    simulation.step(80)
    simulation.save_state(node, "early")
    early = robot.sensors["angle"].value
    simulation.step(400)

    simulation.load_state(node, "early")
    simulation.sample()

    assert robot.sensors["angle"].value == early
    assert simulation.tree.of_def("ROD").place.joint.turning == 0.0


@pytest.mark.parametrize("device", [MOTOR, ""], ids=["motor", "pendulum"])
def test_a_reset_repeats_the_course_of_an_arm(device):
    """The same commands after a reset give the same values, bit for bit, as in a new simulation."""

    def course(simulation, robot):
        simulation.reset()
        simulation.advance(8)
        trace = []
        for target in (0.5, -0.3, 1.0):
            for motor in robot.motors.values():
                motor.set_position(target)
            simulation.step(160)
            trace.append((robot.sensors["angle"].value, *(it.feedback_nm for it in robot.motors.values())))
        return trace

    used, fresh = load(arm(device)), load(arm(device))
    used[0].step(800)

    assert course(*used) == course(*fresh) == course(*used)


def test_a_pole_falls_when_its_cart_drives_off(drive):
    """The pole's joint has no motor, so when the cart speeds up, the pole tilts against the motion."""
    pole = """HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 anchor 0 0 0.3 }
      device PositionSensor { name "tilt" }
      endPoint Solid { translation 0 0 0.6 boundingObject Box { size 0.02 0.02 0.5 }
        physics Physics { density -1 mass 0.2 } } }"""
    simulation, robot = load(carrying(pole))
    simulation.step(320)
    assert robot.sensors["tilt"].value == pytest.approx(0.0, abs=1e-6)

    drive(simulation, 0.3, 0.0, 0.0, steps=2)

    assert robot.sensors["tilt"].value < -0.05


def test_a_caster_on_the_floor_follows_without_forces(drive):
    """The base moves as a whole.

    Its wheels touch no floor, so contact forces of a caster would hold it back.
    """
    caster = """HingeJoint { jointParameters HingeJointParameters { axis 0 0 1 anchor -0.1 0 0.05 }
      endPoint Solid { translation -0.12 0 0.02 boundingObject Sphere { radius 0.02 }
        physics Physics { density -1 mass 0.2 } } }"""
    simulation, robot = load(carrying(caster))

    body = drive(simulation, 0.3, 0.0, 0.0, steps=10)

    assert not robot.links
    assert body.x == pytest.approx(0.3 * 1.92, abs=0.03)


def test_an_arm_does_not_slow_its_robot():
    """The servos that move a base get stronger with the mass of the arm on it."""
    crane = """HingeJoint { jointParameters HingeJointParameters { axis 0 0 1 }
      device RotationalMotor { name "crane" maxTorque 200 }
      endPoint Solid { translation 0.2 0 0.6 boundingObject Box { size 0.6 0.1 0.1 }
        physics Physics { density -1 mass 30 } } }"""
    simulation, robot = load(carrying(crane))
    wheels = [motor for name, motor in robot.motors.items() if name.startswith("wheel")]
    for motor, speed in zip(wheels, robot.body.base.drive.wheel_speeds(0.25, 0, 0), strict=True):
        motor.set_position(math.inf)
        motor.set_velocity(speed)

    simulation.step(960)

    assert robot.body.x == pytest.approx(0.25 * 0.96, abs=0.02)
    assert robot.links


def test_an_arm_on_a_table_holds_its_weight():
    """A robot inside another node has no body of its own, but the forces on its joints are still computed."""
    source = arm().replace(b"Robot {", b"Pose { translation 1 2 0.5 rotation 0 0 1 1 children [ Robot {")
    simulation, robot = load(source + b"] }")
    assert robot.body is None

    simulation.step(800)

    assert robot.motors["motor"].feedback_nm == pytest.approx(-G, rel=1e-3)
    assert simulation.tree.of_def("ROD").place.world_pose.position[2] == pytest.approx(2.0, abs=1e-3)
