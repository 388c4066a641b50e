"""From a Robot node to its body and devices.

A robot with a boundingObject is a round one on three omnidirectional wheels, whose motors are named as in the
Robotino 3; one without is a supervisor that only watches. The outline that runs into things is the widest
cylinder, body or bumper: without physics of its own, a bumper is part of the robot in Webots too.

Joints turn their motors' shafts and move nothing. So only a wheel, which touches nothing but the floor, may
hang on one, or what is drawn only; a sensor or an outline that would have to move is refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

from palaestra_sim.stub.arguments import Arguments, read_arguments
from palaestra_sim.stub.devices import (
    DISTANCE_SENSOR_TYPES,
    Devices,
    DistanceSensor,
    DistanceSensorType,
    PositionSensor,
    TouchSensor,
)
from palaestra_sim.stub.geometry import Pose, turn
from palaestra_sim.stub.motors import Motor, MotorSpec
from palaestra_sim.stub.physics import WHEELS, Body
from palaestra_sim.stub.places import Place, RobotPlace
from palaestra_sim.stub.rays import Row, lookup_table
from palaestra_sim.stub.reading import Reading
from palaestra_sim.stub.shapes import Shape, bounding_shapes
from palaestra_sim.world import Node

_CENTRED_M: Final = 1e-3
_LEVEL: Final = 1e-3
_INERT: Final = frozenset(("Shape", "DirectionalLight", "PointLight", "SpotLight"))
_SENSORS: Final = frozenset(("DistanceSensor", "TouchSensor"))
_FRAMES: Final = frozenset(("Pose", "Transform", "Solid")) | _SENSORS
_FIXED_REMEDY: Final = "fix it to the robot, or run this world with driver webots"

Joint = Literal["wheel", "other"]  # what a part hangs on


@dataclass(slots=True, kw_only=True, eq=False)
class RobotParts:
    """A robot as the world file has it.

    Attributes:
        body: None when nothing can run into it.
        heights: z of the lower and upper end of the body, in the robot's frame.
        ray_heights: z of the lowest and highest ray, in the robot's frame.
        arguments: its controllerArgs; None when its controller is not "ros".
    """

    node: Node
    name: str
    place: Place
    devices: Devices
    body: Body | None
    heights: tuple[float, float] = (0.0, 0.0)
    ray_heights: tuple[float, float] = (0.0, 0.0)
    arguments: Arguments | None = None


def read_robot(reading: Reading, node: Node, parent: Place | None, places: dict[int, Place]) -> RobotParts:
    """Return the robot at `node`, and enter the frames of its parts in `places`."""
    return _RobotReader(reading, node, parent, places).read()


class _RobotReader:
    def __init__(self, reading: Reading, node: Node, parent: Place | None, places: dict[int, Place]) -> None:
        self._reading = reading
        self._node = node
        self._parent = parent
        self._places = places
        self._devices = Devices()
        self._ray_heights: list[float] = []
        # Where the robot stands does not matter to its parts: they are read in its own frame.
        self._frame = Place(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
        self._bumpers: list[tuple[TouchSensor, list[Shape]]] = []
        self._parts: list[tuple[Node, Place]] = []

    def read(self) -> RobotParts:
        """Return the robot."""
        reading, node = self._reading, self._node
        if "battery" in node.fields and node.fields["battery"].items:
            reading.refuse(node, "a Robot with a battery, which would never run down", "remove battery")
        shapes = list(bounding_shapes(reading, node, self._frame))
        self._read_children(node, self._frame)
        shapes += [shape for _, of_bumper in self._bumpers for shape in of_bumper]
        body = self._body(shapes)
        place = self._place(body)
        self._places[node.span[0]] = place
        for part, part_place in self._parts:
            if part_place.parent is self._frame:
                part_place.parent = place
            self._places[part.span[0]] = part_place
        for sensor, of_bumper in self._bumpers:
            # A bumper inside the body is never touched.
            if body is not None and any(it.size[0] >= 2.0 * body.radius for it in of_bumper):
                sensor.body = body
        return RobotParts(
            node=node,
            name=node.text("name") or "robot",
            place=place,
            devices=self._devices,
            body=body,
            heights=_span([z for shape in shapes for z in shape.heights()]),
            ray_heights=_span(self._ray_heights),
            arguments=read_arguments(reading, node) if node.text("controller") == "ros" else None,
        )

    def _body(self, shapes: list[Shape]) -> Body | None:
        for shape in shapes:
            x, y, _ = shape.pose.position
            if shape.kind != "cylinder" or not shape.upright or math.hypot(x, y) > _CENTRED_M:
                fact = "the stub's robots are upright cylinders, centred on the robot's origin"
                self._reading.refuse(shape.node, fact)
        motors = self._devices.motors
        wheels = [motors[name] for name in WHEELS if name in motors]
        if not shapes and not wheels:
            return None
        if motors and len(wheels) < len(WHEELS):
            fact = f"the motors {_listed(motors)} drive nothing: the stub's robots drive by {_listed(WHEELS)}"
            self._reading.refuse(self._node, fact, "name its wheels so, or run this world with driver webots")
        radius_m = max((shape.size[0] / 2.0 for shape in shapes), default=0.0)
        return Body(radius_m, wheels if len(wheels) == len(WHEELS) else ())

    def _place(self, body: Body | None) -> Place:
        reading, node = self._reading, self._node
        translation, rotation = reading.translation(node), reading.rotation(node)
        if body is None:
            return Place(self._parent, translation, rotation)
        if self._parent is not None:
            reading.refuse(node, "a robot inside another node", "put it at the top level")
        if not reading.pose(node).upright:
            reading.refuse(node, "a robot that does not stand upright", "turn it about z only")
        return RobotPlace(translation, rotation, body)

    def _read_children(self, node: Node, place: Place, joint: Joint | None = None) -> None:
        for child in self._reading.children(node):
            self._read_part(child, place, joint)

    def _read_part(self, node: Node, place: Place, joint: Joint | None) -> None:
        kind = node.type_name
        if kind == "HingeJoint":
            self._read_joint(node, place, joint)
        elif kind == "Group":
            self._read_children(node, place, joint)
        elif joint is not None and kind in _SENSORS:
            self._reading.refuse(node, f"a {kind} on a joint, with which it would move", _FIXED_REMEDY)
        elif kind in _FRAMES:
            self._read_frame(node, place, joint)
        elif kind not in _INERT:
            self._reading.refuse(node, f"the stub simulates no {kind} on a robot")

    def _read_frame(self, node: Node, place: Place, joint: Joint | None) -> None:
        kind = node.type_name
        if joint == "other" and node.nodes("boundingObject"):
            fact = f"a {kind} with a boundingObject on a joint, with which it would move"
            self._reading.refuse(node, fact, _FIXED_REMEDY)
        inner = Place(place, self._reading.translation(node), self._reading.rotation(node))
        self._parts.append((node, inner))
        if kind == "DistanceSensor":
            self._read_distance_sensor(node, inner)
        elif kind == "TouchSensor":
            self._read_touch_sensor(node, inner)
        self._read_children(node, inner, joint)

    def _read_joint(self, node: Node, place: Place, joint: Joint | None) -> None:
        """Take the motor and the sensor of a joint; its shaft turns, and what hangs on it stays."""
        motor: Motor | None = None
        if joint is not None and node.nodes("device"):
            self._reading.refuse(node, "a HingeJoint with devices on another joint", _FIXED_REMEDY)
        self._refuse_stops(node)
        for device in self._reading.children(node, "device"):
            if device.type_name == "RotationalMotor":
                motor = Motor(self._motor_spec(device))
                self._enter(device, motor.spec.name)
                self._devices.motors[motor.spec.name] = motor
        for device in self._reading.children(node, "device"):
            if device.type_name == "PositionSensor":
                self._read_position_sensor(device, motor)
            elif device.type_name != "RotationalMotor":
                self._reading.refuse(device, f"the stub simulates no {device.type_name}")
        wheel = joint == "wheel" or (motor is not None and motor.spec.name in WHEELS)
        for end in self._reading.children(node, "endPoint"):
            self._read_part(end, place, "wheel" if wheel else "other")

    def _refuse_stops(self, node: Node) -> None:
        for parameters in self._reading.children(node, "jointParameters"):
            stops = [self._reading.number(parameters, field, 0.0) for field in ("minStop", "maxStop")]
            if stops[0] != stops[1]:
                remedy = "remove minStop and maxStop, or run this world with driver webots"
                self._reading.refuse(parameters, "a joint with stops, which the stub would turn past", remedy)

    def _motor_spec(self, node: Node) -> MotorSpec:
        number = self._reading.number
        return MotorSpec(
            name=node.text("name") or "rotational motor",
            max_velocity_rad_s=number(node, "maxVelocity", 10.0),
            acceleration_rad_s2=number(node, "acceleration", -1.0),
            min_rad=number(node, "minPosition", 0.0),
            max_rad=number(node, "maxPosition", 0.0),
            max_torque_nm=number(node, "maxTorque", 10.0),
            multiplier=number(node, "multiplier", 1.0),
            model=node.text("model") or "",
        )

    def _read_position_sensor(self, node: Node, motor: Motor | None) -> None:
        name = node.text("name") or "position sensor"
        self._enter(node, name)
        self._devices.sensors[name] = PositionSensor(
            name=name,
            motor=motor,
            resolution=self._reading.number(node, "resolution", -1.0),
            noise=self._reading.number(node, "noise", 0.0),
        )

    def _read_distance_sensor(self, node: Node, place: Place) -> None:
        reading = self._reading
        name = node.text("name") or "distance sensor"
        type_name = node.text("type") or "generic"
        if type_name not in DISTANCE_SENSOR_TYPES:
            reading.refuse(node, f"no distance sensor is of type {type_name!r}")
        if reading.number(node, "numberOfRays", 1.0) != 1.0:
            reading.refuse(node, "a distance sensor of several rays")
        if reading.number(node, "resolution", -1.0) != -1.0:
            reading.refuse(node, "a distance sensor with a resolution")
        self._enter(node, name)
        pose = place.world_pose
        self._devices.sensors[name] = DistanceSensor(
            name=name,
            ray=self._ray(node, pose),
            table=lookup_table(*self._rows(node)),
            type=DISTANCE_SENSOR_TYPES.get(type_name, DistanceSensorType.GENERIC),
            aperture_rad=reading.number(node, "aperture", 1.5708),
            model=node.text("model") or "",
        )
        self._ray_heights.append(pose.position[2])

    def _ray(self, node: Node, pose: Pose) -> tuple[float, float, float, float]:
        dx, dy, dz = turn(pose.rotation, (1.0, 0.0, 0.0))
        if abs(dz) > _LEVEL:
            self._reading.refuse(node, "a distance sensor that looks up or down")
        length = math.hypot(dx, dy) or 1.0
        return pose.position[0], pose.position[1], dx / length, dy / length

    def _rows(self, node: Node) -> list[Row]:
        """Return the lookup table, by growing distance."""
        numbers = node.numbers("lookupTable")
        if "lookupTable" not in node.fields:
            return [(0.0, 0.0, 0.0), (0.1, 1000.0, 0.0)]
        if numbers is None or len(numbers) % 3:
            fact = "lookupTable is not rows of three numbers"
            self._reading.refuse(node, fact, "write distance, value, noise")
            return []
        rows = list(zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True))
        if any(after[0] <= before[0] for before, after in pairwise(rows)):
            fact = "the distances of lookupTable do not grow"
            self._reading.refuse(node, fact, "sort its rows")
            return []
        return rows

    def _read_touch_sensor(self, node: Node, place: Place) -> None:
        name = node.text("name") or "touch sensor"
        if (node.text("type") or "bumper") != "bumper":
            self._reading.refuse(node, "a touch sensor that measures force")
        self._enter(node, name)
        sensor = TouchSensor(name=name, body=None, model=node.text("model") or "")
        self._devices.sensors[name] = sensor
        self._bumpers.append((sensor, list(bounding_shapes(self._reading, node, place))))

    def _enter(self, node: Node, name: str) -> None:
        if name in self._devices.order:
            self._reading.refuse(node, f"a second device {name!r}", "give it its own name")
        self._devices.order.append(name)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _span(values: list[float]) -> tuple[float, float]:
    return (min(values), max(values)) if values else (0.0, 0.0)
