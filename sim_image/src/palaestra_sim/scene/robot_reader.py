"""Read a Robot node: its outline, its joints, its wheels, and its devices.

Hinges and tracks with motors may be wheels (`wheels`). All wheels together form the drive
(`wheel_kinematics`). Other parts on joints move with their joint, but collide with nothing, unless the
physics moves joints by forces (`robot_links`). A robot without an outline and without wheels has no body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from palaestra_sim.scene.arguments import read_arguments
from palaestra_sim.scene.bodies import Body, Build
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.device_type import DevicePart, Devices, DeviceType, Shaft
from palaestra_sim.scene.frames import Y_UP, Frame, YUp
from palaestra_sim.scene.geometry import (
    IDENTITY,
    AxisAngle,
    Pose,
    Vector,
    to_axis_angle,
    transposed,
    turn,
    turned,
)
from palaestra_sim.scene.joint_reader import parameters_of, read_joint
from palaestra_sim.scene.joints import Joint, JointFrame
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.mass import MassProperties
from palaestra_sim.scene.mobile_base import MobileBase, SteeredBase
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.old_axes import standing
from palaestra_sim.scene.physics import Physics
from palaestra_sim.scene.robot_frame import RobotFrame, TurnedFrame
from palaestra_sim.scene.robot_links import Parts, links_among, shapes_on
from palaestra_sim.scene.robot_parts import RobotParts
from palaestra_sim.scene.shapes import Shape, bounding_shapes
from palaestra_sim.scene.steering import SteeredDrive, Tire, find_steered_drive
from palaestra_sim.scene.validation import NodeReader
from palaestra_sim.scene.wheel_kinematics import Drive, find_drive
from palaestra_sim.scene.wheel_reader import read_rolling
from palaestra_sim.scene.wheels import Driven, Rolling, tires_among, wheels_among

_LIGHTS: Final = ("DirectionalLight", "PointLight", "SpotLight")
# A SolidReference closes a loop of joints. Its solid is read where the world file defines it.
_INERT: Final = frozenset(("Shape", "CadShape", *_LIGHTS, "Slot", "SolidReference", "TrackWheel"))
_MOUNTED: Final = {name: kind for name, kind in DEVICES.items() if not kind.on_joint}
_ON_JOINTS: Final = {name: kind for name, kind in DEVICES.items() if kind.on_joint}
_FRAMES: Final = _MOUNTED.keys() | {"Pose", "Transform", "Solid", "Track"}
_JOINTS: Final = frozenset(("HingeJoint", "SliderJoint"))
_LOOSE_JOINTS: Final = frozenset(("BallJoint", "Hinge2Joint"))

_NAME_IT: Final = "give it a unique name of letters, digits and underscores, or leave it out (--leave-out)"
# Robots drive over steps that are lower than this. Real worlds need this tolerance, because their robots
# start slightly inside the floor.
_STEP_M: Final = 0.005


def read_robot(reading: NodeReader, node: SceneNode, parent: Frame | None, physics: Physics) -> RobotParts:
    """Return the robot at `node`, after setting the frames of the robot and of its parts."""
    return _RobotReader(reading, node, parent, physics).read()


class _RobotReader:
    def __init__(self, reading: NodeReader, node: SceneNode, parent: Frame | None, physics: Physics) -> None:
        self._physics = physics
        self._reading = reading
        self._node = node
        self._parent = parent
        self._by_ros = node.text("controller") == "ros"
        self._devices = Devices()
        # The robot's pose does not affect its parts, so the parts are read in the robot's own frame, with z
        # up.
        self._y_points_up = self._has_y_up()
        self._frame = Frame(None, (0.0, 0.0, 0.0), to_axis_angle(Y_UP if self._y_points_up else IDENTITY))
        self._outline: list[Shape] = []  # shapes of parts that are fixed to the robot
        self._on_joints: list[Shape] = []  # shapes of parts that turn in place: wheels, casters
        self._carried: list[Shape] = []  # shapes of parts that motors move, in a physics with forces
        self._measured: list[Link] = []
        self._driven: list[Driven] = []
        self._idle: list[Rolling] = []  # wheels without motors
        self._steering: list[Motor] = []  # motors that steer wheels
        self._parts: list[tuple[SceneNode, Frame]] = []

    def read(self) -> RobotParts:
        """Return the robot."""
        reading, node = self._reading, self._node
        if reading.size(node) != 1.0 or (self._parent is not None and self._parent.scale != 1.0):
            self._lacks(node, "a robot with a scale")
        self._outline += bounding_shapes(reading, node, self._frame)
        self._read_children(node, self._frame)
        wheels, drive = self._find_drive()
        if node.nodes("physics"):
            for found in wheels:  # robot and wheels are one body, so the wheels count as having physics
                found.motor.kinematic = False
        shapes = [shape for shape in (*self._on_joints, *self._outline) if not shape.node.left_out]
        links: tuple[Link, ...] = ()
        matter: tuple[MassProperties, ...] = ()
        if self._forces:
            links, matter = links_among(reading, self._all_parts(shapes, wheels))
            shapes = list(shapes_on(None, links, shapes))
        moves = drive is not None or self._stands_free(shapes)
        heights = self._heights(wheels)
        body = None
        if moves:
            motors = [it.motor for it in wheels]
            base = MobileBase(motors, drive)
            if isinstance(drive, SteeredDrive):
                base = SteeredBase(motors, drive)
            body = self._physics.body(
                Build(base=base, outline=shapes, heights=heights, links=links, matter=matter)
            )
        place = self._place(body)
        own = TurnedFrame(place, Y_UP) if self._y_points_up else place
        self._settle(own)
        return RobotParts(
            node=node,
            name=node.text("name") or "robot",
            place=place,
            devices=self._devices,
            body=body,
            standing=() if moves else tuple(self._on(own, shape) for shape in shapes),
            arguments=read_arguments(reading, node) if self._by_ros else None,
            links=links,
            passing=self._passing(shapes, links),
        )

    def _find_drive(self) -> tuple[list[Driven], Drive | SteeredDrive | None]:
        """Return the wheels whose motors move the robot, and their drive."""
        tires = tires_among(self._driven, self._idle)
        found = [Tire(wheel=it.wheel(), driven=isinstance(it, Driven), steer=it.steer) for it in tires]
        steered = find_steered_drive(found)
        if steered is not None:
            turning = [it for it in tires if it.steer is not None]
            self._on_joints += [it.shape for it in turning]
            self._steering += [it.steer.motor for it in turning if it.steer is not None]
            return [it for it in tires if isinstance(it, Driven)], steered
        wheels = wheels_among([it for it in self._driven if it.steer is None])
        return wheels, find_drive([it.wheel() for it in wheels])

    @property
    def _forces(self) -> bool:
        return self._physics.abilities.joints

    def _all_parts(self, shapes: Sequence[Shape], wheels: Sequence[Driven]) -> Parts:
        return Parts(
            nodes=[(self._node, self._frame), *self._parts],
            shapes=(*shapes, *self._carried),
            wheels=wheels,
            steering=self._steering,
            measured=self._measured,
        )

    def _passing(self, shapes: Sequence[Shape], links: Sequence[Link]) -> tuple[SceneNode, ...]:
        touching = {shape.place for shape in shapes} | {shape.place for it in links for shape in it.shapes}
        return tuple(
            node
            for node, place in self._parts
            if _moves(place) and node.nodes("boundingObject") and place not in touching
        )

    def _stands_free(self, shapes: Sequence[Shape]) -> bool:
        """Return whether a robot without a drive is a free-standing obstacle: upright, at the top level."""
        return bool(shapes) and self._at_top and Frame(self._parent, *self._start).ground_pose.upright

    def _has_y_up(self) -> bool:
        """Return whether y of the robot points up, as in worlds whose y axis points up."""
        frame = Frame(self._parent, *_where(self._reading, self._node))
        z_up = Pose(rotation=transposed(Y_UP))
        return not self._node.shipped and frame.axes is not None and frame.ground_pose.after(z_up).upright

    @property
    def _start(self) -> tuple[Vector, AxisAngle]:
        """The initial position and rotation of the robot's frame with z up, in the parent's frame."""
        translation, rotation = _where(self._reading, self._node)
        if self._y_points_up:
            rotation = turned(rotation, transposed(Y_UP))
        return translation, rotation

    @property
    def _at_top(self) -> bool:
        return self._parent is None or isinstance(self._parent, YUp)

    def _heights(self, wheels: Sequence[Driven]) -> tuple[float, float]:
        ends = [z for shape in self._outline for z in shape.heights()]
        if not ends:
            return 0.0, max((found.top for found in wheels), default=0.0)
        floor = min((found.bottom for found in wheels), default=min(ends) - _STEP_M)
        return max(min(ends), floor + _STEP_M), max(ends)

    def _place(self, body: Body | None) -> Frame:
        node = self._node
        translation, rotation = self._start
        if body is None:
            return Frame(self._parent, translation, rotation)
        if not self._at_top:
            self._lacks(node, "a robot that drives inside another node")
        if not Frame(self._parent, translation, rotation).ground_pose.upright:
            self._lacks(node, "a robot that drives, but does not stand upright")
        return RobotFrame(self._parent, translation, rotation, body)

    def _on(self, place: Frame, shape: Shape) -> Shape:
        """Return a shape that was read in the robot's own frame, attached to the robot's final frame."""
        return replace(shape, place=place) if shape.place is self._frame else shape

    def _settle(self, place: Frame) -> None:
        """Attach the parts, which were read in their own frame, to the robot's final frame."""
        self._node.place = place
        for part, part_place in self._parts:
            if part_place.parent is self._frame:
                part_place.parent = place
            part.place = part_place

    def _lacks(self, node: SceneNode, fact: str) -> None:
        """Record an object that cannot be simulated; if the controller is not "ros", leave it out instead."""
        if self._by_ros:
            self._reading.lacks(node, fact)
        else:
            node.left_out = True

    def _read_children(self, node: SceneNode, place: Frame) -> None:
        for child in (*node.nodes(), *node.nodes("endPoint")):
            self._read_part(child, place)

    def _read_part(self, node: SceneNode, place: Frame) -> None:
        kind = node.type_name
        if kind in _JOINTS:
            self._read_joint(node, place)
        elif kind in _LOOSE_JOINTS:
            self._read_loose_joint(node, place)
        elif kind in {"Group", "Slot"}:
            self._read_children(node, place)
        elif kind in _FRAMES:
            self._read_frame(node, Frame(place, *_where(self._reading, node), self._reading.size(node)))
        elif kind not in _INERT:
            self._lacks(node, node.unusable or f"{self._reading.simulator} simulates no {kind} on a robot")

    def _read_frame(self, node: SceneNode, place: Frame) -> None:
        self._parts.append((node, place))
        if node.type_name in _MOUNTED:
            self._read_device(_MOUNTED[node.type_name], node, place, shapes=self._take_shapes(node, place))
        elif node.type_name == "Solid":
            self._take_shapes(node, place)
        elif node.type_name == "Track":
            self._read_track(node, place)
        self._read_children(node, place)

    def _take_shapes(self, node: SceneNode, place: Frame) -> list[Shape]:
        """Return the shapes of a part that may collide, after adding them to the shapes of the robot."""
        if _moves(place) and not self._forces:
            return []
        shapes = list(bounding_shapes(self._reading, node, place))
        kept = self._carried if _moves(place) else self._outline
        kept += shapes
        return shapes

    def _read_track(self, node: SceneNode, place: Frame) -> None:
        """Read a track as a fixed part, with a belt that may drive the robot."""
        shapes = list(bounding_shapes(self._reading, node, place))
        motor = self._read_devices_of(node, node, place, Joint(axis=(1.0, 0.0, 0.0), slides=True))
        if _moves(place):
            return
        self._outline += shapes
        if motor is not None and shapes:
            frame = standing(node, place.world_pose)
            lowest = min(shapes, key=lambda shape: shape.heights()[0])
            axle = turn(frame.rotation, (0.0, 1.0, 0.0))
            self._driven.append(
                Driven(motor=motor, axle=axle, anchor=frame.position, shape=lowest, belt=True)
            )

    def _read_joint(self, node: SceneNode, place: Frame) -> None:
        """Read the motor and the sensor of a joint, and the parts on it."""
        reading = self._reading
        if place.scale != 1.0:
            self._lacks(node, f"a {node.type_name} in a Transform with a scale")
        joint = read_joint(reading, node, forces=self._forces)
        if joint is None:
            return
        joint.motor = self._read_devices_of(node, parameters_of(node), place, joint)
        if joint.motor is not None:
            joint.motor.kinematic = not _end_has_physics(node)
        for end in node.nodes("endPoint"):
            if end.type_name == "Slot":
                self._read_children(end, place)
            elif end.type_name in _FRAMES:
                self._read_end(end, place, joint)
            else:
                self._read_part(end, place)

    def _read_end(self, end: SceneNode, place: Frame, joint: Joint) -> None:
        reading = self._reading
        inner = JointFrame(place, reading.translation(end), reading.rotation(end), joint)
        if end.type_name == "Solid":
            shapes = list(bounding_shapes(reading, end, inner))
            found = read_rolling(reading, joint, place, shapes, end)
            if isinstance(found, Driven):
                self._driven.append(found)
            elif found is not None:
                self._idle.append(found)
            if joint.motor is None or (found is not None and found.steer is None):
                self._on_joints += shapes
        self._read_frame(end, inner)

    def _read_loose_joint(self, node: SceneNode, place: Frame) -> None:
        """Read a joint without motors, such as a caster's joint, as a fixed joint, with all parts on it."""
        if node.nodes("device") or node.nodes("device2") or node.nodes("device3"):
            self._lacks(node, f"{self._reading.simulator} simulates no {node.type_name} with devices")
        for end in node.nodes("endPoint"):
            if end.type_name == "Solid":
                inner = Frame(place, *_where(self._reading, end))
                self._on_joints += bounding_shapes(self._reading, end, inner)
                self._parts.append((end, inner))
                self._read_children(end, inner)
            else:
                self._read_part(end, place)

    def _read_devices_of(
        self, node: SceneNode, parameters: SceneNode, place: Frame, joint: Joint
    ) -> Motor | None:
        stops = [self._reading.number(parameters, name, 0.0) for name in ("minStop", "maxStop")]
        shaft = Shaft(joint=joint)
        for device in node.nodes("device"):
            kind = _ON_JOINTS.get(device.type_name)
            if kind is None:
                self._lacks(device, f"{self._reading.simulator} simulates no {device.type_name}")
                continue
            found = self._read_device(kind, device, place, shaft)
            if isinstance(found, Motor) and shaft.motor is None:
                shaft.motor = found
                found.join(joint.start, (stops[0], stops[1]))
        return shaft.motor

    def _read_device(
        self,
        kind: DeviceType[Any],
        node: SceneNode,
        place: Frame,
        shaft: Shaft | None = None,
        shapes: Sequence[Shape] = (),
    ) -> object:
        """Return the device at `node`, after adding it to the robot."""
        name = node.text("name") or kind.name
        part = DevicePart(
            reading=self._reading,
            lacks=self._lacks,
            node=node,
            name=name,
            place=place,
            shaft=shaft,
            shapes=shapes,
            measured=self._measured,
            forces=self._forces,
        )
        device: object = kind.read(part)
        trouble = self._devices.trouble_with(name) if self._by_ros else None
        if not node.left_out and trouble is not None:
            self._reading.lacks(node, trouble, _NAME_IT)
        if node.left_out:
            return None
        self._devices.add(name, kind, device)
        self._devices.nodes[name] = node
        if shaft is not None:
            self._devices.shafts[name] = shaft
            shaft.names.setdefault(kind.role, name)
        return device


def _moves(place: Frame) -> bool:
    """Return whether a motor can move a frame relative to its robot."""
    return any(isinstance(it, JointFrame) and it.joint.motor is not None for it in place.chain())


def _end_has_physics(joint: SceneNode) -> bool:
    """Return whether the Solid at the end of a joint, or in a Slot there, has physics."""
    return any(
        _end_has_physics(end) if end.type_name == "Slot" else bool(end.nodes("physics"))
        for end in joint.nodes("endPoint")
    )


def _where(reading: NodeReader, node: SceneNode) -> tuple[Vector, tuple[float, float, float, float]]:
    return reading.translation(node), reading.rotation(node)
