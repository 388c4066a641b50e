"""Read the joint of a HingeJoint or SliderJoint, and doors: links on joints that do not belong to a robot."""

from __future__ import annotations

from collections.abc import Sequence

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import triple
from palaestra_sim.scene.joints import Joint, JointFrame, Rubbing, unit
from palaestra_sim.scene.links import Link, link_around
from palaestra_sim.scene.mass import read_matter
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.validation import NodeReader


def parameters_of(node: SceneNode) -> SceneNode:
    """Return the node with the parameters of a joint; if it is missing, the joint node itself."""
    return next(iter(node.nodes("jointParameters")), node)


def read_joint(reading: NodeReader, node: SceneNode, *, forces: bool) -> Joint | None:
    """Return the joint at `node`, with stops and resistance if `forces`; None if its axis has length 0."""
    slides = node.type_name == "SliderJoint"
    parameters = parameters_of(node)
    along = reading.vector(parameters, "axis", (0.0, 0.0, 1.0) if slides else (1.0, 0.0, 0.0))
    axis = unit(triple(along))
    if axis is None:
        reading.refuse(parameters, "a joint with an axis of length 0", "write its direction")
        return None
    joint = Joint(
        axis=axis,
        anchor=triple(reading.vector(parameters, "anchor", (0.0, 0.0, 0.0))),
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


def read_door(reading: NodeReader, node: SceneNode, parent: Frame | None) -> Link | None:
    """Return the link of a door, without shapes yet; None if the end of the joint has no physics."""
    for end in node.nodes("endPoint"):
        if end.type_name == "Solid" and end.nodes("physics"):
            if parent is not None and parent.scale != 1.0:
                reading.lacks(node, f"a {node.type_name} in a Transform with a scale")
            joint = read_joint(reading, node, forces=True)
            if joint is None:
                return None
            place = JointFrame(parent, reading.translation(end), reading.rotation(end), joint)
            end.place = place
            return Link(node=end, place=place, joint=joint)
    return None


def fill_door(reading: NodeReader, link: Link, inner: Sequence[Link], shapes: Sequence[Shape]) -> None:
    """Give a door its shapes and masses; `inner` are the links on the door, and `shapes` all its shapes."""
    links = [link, *inner]
    link.shapes = tuple(shape for shape in shapes if link_around(shape.place, links) is link)
    nodes = [node for node in (link.node, *link.node.descendants()) if node.nodes("physics")]
    link.matter = tuple(
        read_matter(reading, node, place, [shape for shape in link.shapes if shape.place is place])
        for node in nodes
        if (place := node.place) is not None and link_around(place, links) is link
    )
