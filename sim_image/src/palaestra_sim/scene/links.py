"""Links: parts that forces move on joints, and parts whose force on the robot is measured.

A link consists of all parts on the end of one joint, except the parts on further joints. A link is mounted on
another link, on a robot, on a dynamic solid, or on a fixed object.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.joints import Joint, JointFrame
from palaestra_sim.scene.mass import MassProperties
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape


@dataclass(slots=True, kw_only=True, eq=False)
class Link:
    """One link.

    Attributes:
        node: the Solid of the link.
        place: the frame of the link; for a link on a joint, the frame of the joint's end.
        joint: the joint that moves the link; None if the link is fixed and the force on it is measured.
        shapes: the shapes with which the link touches other objects.
        matter: the masses of the link's Solids.
        force: the force in N on the object that carries the link, in the link's axes; set by the physics.
    """

    node: SceneNode
    place: Frame
    joint: Joint | None
    shapes: tuple[Shape, ...] = ()
    matter: tuple[MassProperties, ...] = ()
    force: Vector = field(default=(0.0, 0.0, 0.0))

    @property
    def start(self) -> Pose:
        """The pose of the link in the parent's frame, at the joint's position in the world file."""
        return self.place.start if isinstance(self.place, JointFrame) else self.place.pose


def frames_between(outer: Frame | None, inner: Frame | None) -> Pose:
    """Return the pose of the frame `inner` in the frame `outer`, with the current positions of all joints."""
    pose = Pose()
    while inner is not None and inner is not outer:
        pose = _scaled(inner).after(pose)
        inner = inner.parent
    return pose


def link_around(place: Frame | None, links: Sequence[Link]) -> Link | None:
    """Return the innermost link around a frame; None if no link contains it."""
    by_place = {link.place: link for link in links}
    around: Iterator[Frame] = iter(()) if place is None else place.chain()
    return next((by_place[it] for it in around if it in by_place), None)


def _scaled(place: Frame) -> Pose:
    parent, pose = place.parent, place.pose
    return pose if parent is None or parent.scale == 1.0 else pose.scaled(parent.scale)
