"""A robot with steered wheels drives as the steering geometry of a car requires, in every physics."""

import math

import pytest

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.world import builtin_protos, parse

BASE_M, TRACK_M, RADIUS_M = 0.3, 0.2, 0.05
PHYSICS = "physics Physics { density -1 mass 0.2 }"
WHEEL = """HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 anchor PLACE }
  device [ DEVICES ]
  endPoint Solid { translation PLACE name "NAME" boundingObject Pose { rotation 1 0 0 1.5708
    children [ Cylinder { height 0.03 radius 0.05 } ] } PHYSICS } }"""
MOTOR = 'RotationalMotor { name "NAME" maxVelocity 40 maxTorque 100 }'


def wheel(name, place, *, driven):
    """Return a wheel at a position in its frame, with its axle to the left."""
    text = WHEEL.replace("DEVICES", MOTOR if driven else "").replace("PHYSICS", PHYSICS)
    return text.replace("NAME", name).replace("PLACE", place)


def steered(name, side, *, driven, axis):
    """Return a front wheel that a motor steers about an axis through its hub."""
    place = f"{BASE_M} {side * TRACK_M / 2} 0.05"
    return f"""HingeJoint {{ jointParameters HingeJointParameters {{ axis 0 0 {axis} anchor {place} }}
      device [ RotationalMotor {{ name "steer {name}" maxPosition 1.5 minPosition -1.5 maxTorque 100 }} ]
      endPoint Solid {{ translation {place} name "hub {name}" {PHYSICS}
        children [ {wheel(name, "0 0 0", driven=driven)} ] }} }}"""


def car(*, front=False, rear=True, axis=1):
    """Return a world with a car whose front wheels are steered; its origin is below the rear axle."""
    parts = [
        *(wheel(f"rear {it}", f"0 {it * TRACK_M / 2} 0.05", driven=rear) for it in (1, -1)),
        *(steered(f"front {it}", it, driven=front, axis=axis) for it in (1, -1)),
    ]
    return f"""#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep 8 }}
Solid {{ boundingObject Plane {{ size 100 100 }} }}
DEF CAR Robot {{ translation 0 0 0 children [ {" ".join(parts)} ]
  boundingObject Pose {{ translation 0.15 0 0.1 children [ Box {{ size 0.4 0.1 0.05 }} ] }}
  physics Physics {{ density -1 mass 2 }} controller "ros" controllerArgs [ "--name=car" "--synchronize" ] }}
"""


@pytest.fixture
def drive(physics):
    """`drive(world, angles, speed)` returns the poses before and after a drive of 2 s with steered wheels."""

    def driven(world, angles, speed=8.0):
        simulation = Simulation.load(world.encode(), physics(), "car", Mode.FAST)
        (robot,) = simulation.robots
        for name, angle in zip(("steer front 1", "steer front -1"), angles, strict=True):
            robot.motors[name].set_position(angle)
        simulation.step(3000)
        body = robot.body
        before = body.x, body.y, body.heading_rad
        for name, motor in robot.motors.items():
            if not name.startswith("steer"):
                motor.set_position(math.inf)
                motor.set_velocity(speed)
        simulation.step(2000)
        return before, (body.x, body.y, body.heading_rad)

    return driven


def ackermann(radius_m):
    """Return the steering angles of the left and the right front wheel for a circle to the left."""
    return (math.atan2(BASE_M, radius_m - TRACK_M / 2), math.atan2(BASE_M, radius_m + TRACK_M / 2))


def turned_rad(radius_m, speed=8.0, seconds=2.0):
    """Return the angle by which the car turns. The middle of the rear axle runs along the circle."""
    return speed * RADIUS_M * seconds / radius_m


@pytest.mark.parametrize("radius_m", [0.6, 1.0, -0.8])
def test_a_car_drives_on_the_circle_that_its_front_wheels_give(drive, radius_m):
    """The lines of all axles meet in the center of the circle, which lies on the line of the rear axle."""
    angles = ackermann(radius_m) if radius_m > 0.0 else [-it for it in reversed(ackermann(-radius_m))]
    (x0, y0, h0), (x, y, heading) = drive(car(), angles)

    turned = turned_rad(radius_m)
    assert (x0, y0, h0) == pytest.approx((0.0, 0.0, 0.0), abs=2e-3)
    assert math.remainder(heading - turned, math.tau) == pytest.approx(0.0, abs=0.06)
    assert x == pytest.approx(radius_m * math.sin(heading), abs=0.02)
    assert y == pytest.approx(radius_m * (1.0 - math.cos(heading)), abs=0.02)


def test_a_car_with_straight_wheels_drives_straight_on(drive):
    """A car keeps its heading exactly, like a robot with a differential drive."""
    _, (x, y, heading) = drive(car(), (0.0, 0.0))

    assert x == pytest.approx(8.0 * RADIUS_M * 2.0, rel=0.03)
    assert (y, heading) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_the_axis_of_the_steering_gives_its_direction(drive):
    """Cars of Webots have a steering axis that points down, so a positive angle turns them to the right."""
    _, (_, y, heading) = drive(car(axis=-1), ackermann(1.0)[::-1])

    assert math.remainder(heading, math.tau) < -0.5
    assert y < -0.1


def test_driven_front_wheels_run_faster_than_the_rear_axle(drive):
    """A front wheel runs along a larger circle than the rear axle.

    At the same motor speed the car therefore turns less.
    """
    left, right = ackermann(1.0)
    _, (_, _, heading) = drive(car(front=True, rear=False), (left, right))

    radii = [BASE_M / math.sin(angle) for angle in (left, right)]
    along = sum(radii) / sum(radius * radius for radius in radii)  # the least-squares solution for both tires
    assert heading == pytest.approx(8.0 * RADIUS_M * 2.0 * along, rel=0.05)


def test_wheels_that_steer_do_not_make_an_arm_a_wheel(physics):
    """A motor that turns an arm about a vertical axis does not steer, so the robot's drive is unchanged."""
    arm = (
        car().replace('name "steer front 1"', 'name "arm"').replace(f"{BASE_M} 0.1 0.05", f"{BASE_M} 0.1 0.5")
    )
    arm = arm.replace(f"{BASE_M} -0.1 0.05", f"{BASE_M} -0.1 0.5")
    (robot,) = Simulation.load(arm.encode(), physics(), "car", Mode.FAST).robots

    assert type(robot.body.base.drive).__name__ == "Drive"


def test_the_car_that_ships_turns_to_the_right_at_a_positive_angle(physics):
    """The expected circle follows from the size of this car.

    Its steered hubs are 2.995 m before the rear axle, and 1.628 m apart.
    """
    world = """#VRML_SIM R2023b utf8
    WorldInfo { basicTimeStep 16 }
    Solid { boundingObject Plane { size 100 100 } }
    BmwX5 { controller "ros" controllerArgs [ "--name=car" "--synchronize" ] }
    """
    shipped = Descriptions(protos=builtin_protos())
    simulation = Simulation.of(parse(world.encode()), physics(), "car", Mode.FAST, shipped, LeaveOut())
    (robot,) = simulation.robots
    for side, offset_m in (("left", 0.814), ("right", -0.814)):
        robot.motors[f"{side}_steer"].set_position(math.atan2(2.995, 10.0 + offset_m))
        robot.motors[f"{side}_front_wheel"].set_position(math.inf)
        robot.motors[f"{side}_front_wheel"].set_velocity(5.0)
    simulation.step(2400)
    start = robot.body.heading_rad
    simulation.step(1600)

    assert robot.body.heading_rad - start == pytest.approx(-1.6 * 5.0 * 0.374 / 10.4, rel=0.05)
