"""List the parts of a world with a wheeled robot that the batch form cannot simulate exactly."""

from __future__ import annotations

from collections.abc import Iterator

from palaestra_protocol.batch import BatchRequest
from palaestra_sim.mujoco.body import MujocoBody
from palaestra_sim.scene.devices.distance_sensor import DistanceSensor, DistanceSensorType
from palaestra_sim.scene.devices.position_sensor import PositionSensor
from palaestra_sim.scene.devices.touch_sensor import TouchSensor
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.wheel_kinematics import Drive

_SIMPLE = (DistanceSensorType.GENERIC, DistanceSensorType.LASER)


def lacks_of_world(simulation: Simulation) -> Iterator[str]:
    """Yield, in words, each part of a world that the batch form does not simulate."""
    if len(simulation.robots) != 1:
        yield f"simulates one robot, and the world has {len(simulation.robots)}"
    if simulation.scene.loose:
        yield f"does not simulate {len(simulation.scene.loose)} Solids with physics"
    if simulation.scene.doors:
        yield f"does not simulate {len(simulation.scene.doors)} doors"
    if simulation.scene.top is not None:
        yield "does not simulate a world whose y axis points up"
    for robot in simulation.robots[:1]:
        yield from _lacks_of_robot(robot)
        for name, (kind, device) in robot.parts.devices.rows.items():
            if fact := _lack_of_device(robot, device, kind.node):
                yield f"does not simulate {fact} {name!r}"


def lacks_of_request(simulation: Simulation, request: BatchRequest) -> Iterator[str]:
    """Yield, in words, each part of a trainer's request that the batch form of this world does not have."""
    [robot] = simulation.robots
    if request.period_ms % simulation.basic_step_ms:
        yield f"{request.period_ms} ms is not a multiple of the basic step of {simulation.basic_step_ms} ms"
    if request.commanded != "velocity":
        yield f"commands wheels by velocity, not by {request.commanded}"
    yield from (f"the robot has no motor {name!r}" for name in request.motors if name not in robot.motors)
    yield from (f"the robot has no sensor {name!r}" for name in request.sensors if name not in robot.sensors)
    if request.robot and request.robot != robot.parts.node.def_name:
        yield f"the world has no robot DEF {request.robot}"
    yield from (f"does not set joints, such as {name!r}" for name in request.joints)
    if request.mark:
        mark = simulation.tree.of_def(request.mark)
        if mark is None or mark.place is None:
            yield f"the world has no node DEF {request.mark}"
        elif any(mark.place in shape.place.chain() for shape in simulation.scene.solids):
            yield f"cannot move {request.mark}, because it has a boundingObject"


def _lacks_of_robot(robot: Robot) -> Iterator[str]:
    body = robot.body
    if not isinstance(body, MujocoBody) or not isinstance(body.base.drive, Drive):
        yield "simulates robots that drive on wheels with fixed axles"
    if robot.links:
        yield f"does not simulate {len(robot.links)} parts on joints"
    if robot.battery.value >= 0.0:
        yield "does not simulate a battery"
    if any(motor.kinematic for motor in robot.motors.values()):
        yield "does not simulate wheels without Physics"


def _lack_of_device(robot: Robot, device: object, node: str) -> str:
    """Return the kind of a device that is not simulated; "" if the device is simulated."""
    match device:
        case Motor():
            wheel = robot.body is not None and robot.body.base.has(device)
            return "" if wheel and device.spec.max_torque_nm else f"the {node}"
        case DistanceSensor():
            simple = device.type in _SIMPLE and len(device.beams) == 1
            if simple and device.mount is not None:
                return "the DistanceSensor on a joint"
            return "" if simple else "the infra-red sensor, sonar or DistanceSensor with several rays"
        case TouchSensor():
            return "" if device.link is None else "the TouchSensor of a force"
        case PositionSensor():
            motor = device.shaft.motor
            wheel = motor is not None and robot.body is not None and robot.body.base.has(motor)
            return "" if wheel else f"the {node}"
    return f"the {node}"
