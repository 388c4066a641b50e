"""Read the round end points of hinges as wheels: driven or steered by a motor, or only rolling."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector, turn
from palaestra_sim.scene.joints import Joint, JointFrame, unit
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.steering import Steer
from palaestra_sim.scene.validation import NodeReader
from palaestra_sim.scene.wheels import Driven, Rolling

_FLAT: Final = frozenset(("box", "mesh"))
_VERTICAL: Final = 0.999  # cosine of the largest slope, 2.6 degrees, of an axis that steers


def read_rolling(
    reading: NodeReader, joint: Joint, place: Frame, shapes: Sequence[Shape], end: SceneNode
) -> Rolling | None:
    """Return the end of a joint as a wheel, or None if the end cannot be a wheel.

    The end cannot be a wheel if it has no round shape, or if an outer joint has a motor that does not steer.
    `place` is the frame that contains the joint, and `shapes` are the shapes of the end.
    """
    round_ones = [shape for shape in shapes if shape.kind not in _FLAT]
    around = [it for it in place.chain() if isinstance(it, JointFrame)]
    with_motor = [it for it in around if it.joint.motor is not None]
    steer = _steer(with_motor[0]) if len(with_motor) == 1 else None
    if joint.slides or not round_ones or (with_motor and steer is None):
        return None
    frame = place.world_pose
    axle = turn(frame.rotation, joint.axis)
    anchor = frame.carry(joint.anchor)
    shape = max(round_ones, key=lambda shape: shape.size[0])
    if joint.motor is None:
        # A caster does not count as a wheel: it follows the robot's motion and does not restrict it.
        led = len(around) == len(with_motor) and joint.stops[0] == joint.stops[1]
        return Rolling(axle=axle, anchor=anchor, shape=shape, steer=steer) if led else None
    roller = _lowest_roller(reading, end, JointFrame(place, *_where(reading, end), joint))
    return Driven(motor=joint.motor, axle=axle, anchor=anchor, shape=shape, roller=roller, steer=steer)


def _steer(place: JointFrame) -> Steer | None:
    """Return a joint with a motor as a steering joint; None if its axis is not vertical."""
    joint, parent = place.joint, place.parent
    motor = joint.motor
    if joint.slides or motor is None:
        return None
    axis, anchor = joint.axis, joint.anchor
    if parent is not None:
        axis, anchor = turn(parent.world_pose.rotation, axis), parent.world_pose.carry(anchor)
    if abs(axis[2]) < _VERTICAL:
        return None
    return Steer(motor, joint.start, (anchor[0], anchor[1]), 1.0 if axis[2] > 0.0 else -1.0)


def _lowest_roller(reading: NodeReader, wheel: SceneNode, place: Frame) -> Vector | None:
    """Return the axis of the wheel's roller that touches the floor; None if the wheel has no rollers."""
    lowest: tuple[float, Vector] | None = None
    for node in wheel.nodes():
        parameters = next(iter(node.nodes("jointParameters")), None)
        if node.type_name != "HingeJoint" or parameters is None or node.nodes("device"):
            continue
        x, y, z = reading.vector(parameters, "axis", (1.0, 0.0, 0.0))
        axis = unit((x, y, z))
        x, y, z = reading.vector(parameters, "anchor", (0.0, 0.0, 0.0))
        height = place.world_pose.carry((x, y, z))[2]
        if axis is not None and (lowest is None or height < lowest[0]):
            lowest = height, turn(place.world_pose.rotation, axis)
    return None if lowest is None else lowest[1]


def _where(reading: NodeReader, node: SceneNode) -> tuple[Vector, tuple[float, float, float, float]]:
    return reading.translation(node), reading.rotation(node)
