"""Read a Robot node: its body and its devices.

A robot with a boundingObject is round and has three omnidirectional wheels, whose motors have the names of
the Robotino 3; a robot without one is a supervisor that only watches. Its outline for collisions is the
widest cylinder, body or bumper. In Webots too, a bumper without physics of its own is part of the robot.

Joints turn their motors' shafts but move nothing. So only a wheel, which touches only the floor, or a part
that is only drawn may be on a joint; a sensor or an outline that would have to move is refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Literal

from palaestra_sim.stub.physics.body import WHEELS, Body
from palaestra_sim.stub.physics.motors import Motor
from palaestra_sim.stub.scene.arguments import Arguments, read_arguments
from palaestra_sim.stub.scene.devices import DEVICES
from palaestra_sim.stub.scene.devices.kind import Devices, Kind, Part
from palaestra_sim.stub.scene.places import Place, RobotPlace
from palaestra_sim.stub.scene.reading import Reading
from palaestra_sim.stub.scene.shapes import Shape, bounding_shapes
from palaestra_sim.world import Node

_CENTRED_M: Final = 1e-3
_INERT: Final = frozenset(("Shape", "DirectionalLight", "PointLight", "SpotLight"))
_MOUNTED: Final = {name: kind for name, kind in DEVICES.items() if not kind.on_joint}
_ON_JOINTS: Final = {name: kind for name, kind in DEVICES.items() if kind.on_joint}
_FRAMES: Final = _MOUNTED.keys() | {"Pose", "Transform", "Solid"}
_FIXED_REMEDY: Final = "fix it to the robot, or run this world with driver webots"

Joint = Literal["wheel", "other"]  # the kind of joint of a part


@dataclass(slots=True, kw_only=True, eq=False)
class RobotParts:
    """A robot of the world file.

    Attributes:
        body: None if nothing can collide with it.
        heights: z of the lower and upper end of the body, in the robot's frame.
        arguments: its controllerArgs; None when its controller is not "ros".
    """

    node: Node
    name: str
    place: Place
    devices: Devices
    body: Body | None
    heights: tuple[float, float] = (0.0, 0.0)
    arguments: Arguments | None = None


def read_robot(reading: Reading, node: Node, parent: Place | None, places: dict[int, Place]) -> RobotParts:
    """Return the robot at `node`, and add the frames of its parts to `places`."""
    return _RobotReader(reading, node, parent, places).read()


class _RobotReader:
    def __init__(self, reading: Reading, node: Node, parent: Place | None, places: dict[int, Place]) -> None:
        self._reading = reading
        self._node = node
        self._parent = parent
        self._places = places
        self._devices = Devices()
        # Where the robot stands does not matter to its parts: they are read in its own frame.
        self._frame = Place(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
        self._outline: list[Shape] = []
        self._parts: list[tuple[Node, Place]] = []

    def read(self) -> RobotParts:
        """Return the robot."""
        reading, node = self._reading, self._node
        if "battery" in node.fields and node.fields["battery"].items:
            reading.refuse(node, "a Robot with a battery, which would never run down", "remove battery")
        shapes = self._outline
        shapes += bounding_shapes(reading, node, self._frame)
        self._read_children(node, self._frame)
        body = self._body(shapes)
        place = self._place(body)
        self._places[node.span[0]] = place
        for part, part_place in self._parts:
            if part_place.parent is self._frame:
                part_place.parent = place
            self._places[part.span[0]] = part_place
        return RobotParts(
            node=node,
            name=node.text("name") or "robot",
            place=place,
            devices=self._devices,
            body=body,
            heights=_span([z for shape in shapes for z in shape.heights()]),
            arguments=read_arguments(reading, node) if node.text("controller") == "ros" else None,
        )

    def _body(self, shapes: list[Shape]) -> Body | None:
        for shape in shapes:
            x, y, _ = shape.pose.position
            if shape.kind != "cylinder" or not shape.upright or math.hypot(x, y) > _CENTRED_M:
                fact = "the stub's robots are upright cylinders, centered on the robot's origin"
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
        elif joint is not None and kind in _MOUNTED:
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
        if kind in _MOUNTED:
            self._read_device(_MOUNTED[kind], node, inner)
        self._read_children(node, inner, joint)

    def _read_joint(self, node: Node, place: Place, joint: Joint | None) -> None:
        """Take the motor and the sensor of a joint; its shaft turns, and what hangs on it stays."""
        if joint is not None and node.nodes("device"):
            self._reading.refuse(node, "a HingeJoint with devices on another joint", _FIXED_REMEDY)
        self._refuse_stops(node)
        devices = self._reading.children(node, "device")
        motor: Motor | None = None
        # Motors first: a sensor belongs to the motor of its joint, wherever that is in the list.
        for device in sorted(devices, key=lambda it: it.type_name != "RotationalMotor"):
            kind = _ON_JOINTS.get(device.type_name)
            if kind is None:
                self._reading.refuse(device, f"the stub simulates no {device.type_name}")
                continue
            found = self._read_device(kind, device, place, motor)
            motor = found if isinstance(found, Motor) else motor
        wheel = joint == "wheel" or (motor is not None and motor.spec.name in WHEELS)
        for end in self._reading.children(node, "endPoint"):
            self._read_part(end, place, "wheel" if wheel else "other")

    def _refuse_stops(self, node: Node) -> None:
        for parameters in self._reading.children(node, "jointParameters"):
            stops = [self._reading.number(parameters, field, 0.0) for field in ("minStop", "maxStop")]
            if stops[0] != stops[1]:
                remedy = "remove minStop and maxStop, or run this world with driver webots"
                self._reading.refuse(parameters, "a joint with stops, which the stub would turn past", remedy)

    def _read_device(self, kind: Kind[Any], node: Node, place: Place, motor: Motor | None = None) -> object:
        """Return the device at `node`, now one of the robot's."""
        name = node.text("name") or kind.name
        device: object = kind.read(
            Part(
                reading=self._reading,
                node=node,
                name=name,
                place=place,
                motor=motor,
                outline=self._outline,
            )
        )
        if name in self._devices.rows:
            self._reading.refuse(node, f"a second device {name!r}", "give it its own name")
        self._devices.rows[name] = kind, device
        return device


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _span(values: list[float]) -> tuple[float, float]:
    return (min(values), max(values)) if values else (0.0, 0.0)
