"""Read the joint of a HingeJoint or SliderJoint."""

from __future__ import annotations

from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.joints import Joint, Rubbing, unit
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.reading import Reading


def parameters_of(node: SceneNode) -> SceneNode:
    """Return the node with the parameters of a joint; the joint itself, with none of them, if it has none."""
    return next(iter(node.nodes("jointParameters")), node)


def read_joint(reading: Reading, node: SceneNode, *, forces: bool) -> Joint | None:
    """Return the joint at `node`; None if it is refused. With `forces`, it has stops and what resists it."""
    slides = node.type_name == "SliderJoint"
    parameters = parameters_of(node)
    along = reading.vector(parameters, "axis", (0.0, 0.0, 1.0) if slides else (1.0, 0.0, 0.0))
    axis = unit(_triple(along))
    if axis is None:
        reading.refuse(parameters, "a joint with an axis of length 0", "write its direction")
        return None
    joint = Joint(
        axis=axis,
        anchor=_triple(reading.vector(parameters, "anchor", (0.0, 0.0, 0.0))),
        slides=slides,
        start=reading.number(parameters, "position", 0.0),
    )
    if forces:
        joint.stops = reading.number(parameters, "minStop", 0.0), reading.number(parameters, "maxStop", 0.0)
        joint.rubbing = Rubbing(
            damping=reading.number(parameters, "dampingConstant", 0.0),
            friction=reading.number(parameters, "staticFriction", 0.0),
            spring=reading.number(parameters, "springConstant", 0.0),
        )
    return joint


def _triple(numbers: tuple[float, ...]) -> Vector:
    return numbers[0], numbers[1], numbers[2]
