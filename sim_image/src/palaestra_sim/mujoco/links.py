"""Links in MuJoCo: bodies on joints, the servos that move the joints, and force sensors in fixed links.

A servo moves its joint at the speed that the motor demands; its force is at most the force of the motor. The
servo also compensates for gravity, so a motor that holds a weight does not sag. Links may touch all bodies
except the bodies of their own robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, Final

from palaestra_sim.mujoco.body import GAIN, MujocoBody
from palaestra_sim.mujoco.geoms import LOOSE, ROBOTS, STANDING, Marks, Touch, add_geom, add_matter, put
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.joints import Joint
from palaestra_sim.scene.links import Link, frames_between, link_around
from palaestra_sim.scene.motors import Motor

# MuJoCo's defaults are too soft: a weight that a motor holds sinks slowly, and a strong motor moves a joint a
# centimeter beyond its stop.
_STIFF: Final = (0.9999, 0.9999, 0.001, 0.5, 2.0)
_TOUCH: Final = Touch(ROBOTS, STANDING | LOOSE | ROBOTS)


@dataclass(slots=True, eq=False)
class Added:
    """The parts of a link in a model that is not compiled yet.

    Attributes:
        link: the link in the scene.
        body: the body of the link, in MuJoCo's MjSpec.
        joint, servo, sensor: the joint, the servo and the force sensor; None if the link has no such part.
    """

    link: Link
    body: Any
    joint: Any = None
    servo: Any = None
    sensor: Any = None


@dataclass(slots=True, eq=False)
class Ground:
    """The bodies on which links are mounted.

    Attributes:
        spec: the model that is not compiled yet.
        roots: the bodies of robots and dynamic solids, by their frames.
        stands: the bodies of obstacles, by their frames. If a link is mounted on a frame without a body, a
            new body is added.
        names: new names for bodies and joints.
    """

    spec: Any
    roots: dict[Frame, Any]
    stands: dict[Frame, Any]
    names: Iterator[str] = field(default_factory=lambda: (f"link {number}" for number in range(10**9)))

    def under(self, place: Frame | None) -> tuple[Frame | None, Any]:
        """Return the body to which the frame `place` belongs; the frame of this body comes first."""
        around = () if place is None else place.chain()
        for outer in around:
            if outer in self.roots:
                return outer, self.roots[outer]
        if place is None:
            return None, self.spec.worldbody
        if place not in self.stands:
            self.stands[place] = self.spec.worldbody.add_body(mocap=True, name=next(self.names))
        return place, self.stands[place]


def add_links(ground: Ground, links: Sequence[Link], marks: Marks, body: MujocoBody | None) -> list[Added]:
    """Add links to a model and return their parts.

    Args:
        ground: the bodies on which the links are mounted.
        links: the links of one robot, or links without a robot; a link comes before the links on it.
        marks: the geoms of the model; `add_links` adds an entry for each new geom.
        body: the body of the robot; None for links without a robot.
    """
    added: dict[Link, Added] = {}
    bit = 0 if body is None else len(body.build.outline)
    for link in links:
        around = link_around(link.place.parent, links)
        outer, root = (
            ground.under(link.place.parent) if around is None else (around.place, added[around].body)
        )
        inner = root.add_body(name=next(ground.names))
        put(inner.pos, inner.quat, frames_between(outer, link.place.parent).after(link.start))
        added[link] = Added(link, inner)
        geoms = {}
        for shape in link.shapes:
            frame = frames_between(link.place, shape.place)
            geoms[shape] = add_geom(ground.spec, inner, shape, frame.after(shape.local), _TOUCH)
            marks.note(geoms[shape], shape, body, 0 if body is None else 1 << bit)
            bit += 1
        for matter in link.matter:
            add_matter(inner, matter, frames_between(link.place, matter.place), geoms)
        _add_joint(ground, added[link])
    _exclude(ground, list(added.values()))
    return list(added.values())


def _add_joint(ground: Ground, added: Added) -> None:
    joint, link = added.link.joint, added.link
    name = next(ground.names)
    if joint is None:
        added.body.add_site(name=name)
        added.sensor = ground.spec.add_sensor(
            type=mujoco.mjtSensor.mjSENS_FORCE, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name
        )
        return
    frame = link.start.inverse
    low, high = joint.stops
    added.joint = added.body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE if joint.slides else mujoco.mjtJoint.mjJNT_HINGE,
        axis=list(frame.turned(joint.axis)),
        pos=list(frame.carry(joint.anchor)),
        ref=joint.start,
        range=[low, high],
        limited=low < high,
        damping=[joint.rubbing.damping, 0.0, 0.0],
        stiffness=[joint.rubbing.spring, 0.0, 0.0],
        solimp_friction=_STIFF,
        solimp_limit=_STIFF,
        frictionloss=joint.rubbing.friction if joint.motor is None else 0.0,
    )
    if joint.motor is not None:
        added.servo = ground.spec.add_actuator(
            trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name, forcelimited=True, forcerange=[-1.0, 1.0]
        )
        added.servo.set_to_velocity(kv=1.0)


def _exclude(ground: Ground, added: Sequence[Added]) -> None:
    """Prevent contacts between links of the same robot, and between links and the bodies that carry them."""
    pairs = [(one.body.name, other.body.name) for one, other in combinations(added, 2)]
    for it in added:
        around = [place for place in it.link.place.chain() if place in ground.stands or place in ground.roots]
        pairs += [(it.body.name, (ground.roots.get(place) or ground.stands[place]).name) for place in around]
    for one, other in pairs:
        ground.spec.add_exclude(bodyname1=one, bodyname2=other)


class LinkBody:
    """One link of a compiled model; it updates the joint and the motor in the scene.

    Args:
        added: the parts of the link in the model.
        model: the compiled model (MjModel).
        data: the current state of the model (MjData).

    Attributes:
        link: the link in the scene.
    """

    def __init__(self, added: Added, model: Any, data: Any) -> None:
        self.link = added.link
        self._model, self._data = model, data
        self._joint: Joint | None = added.link.joint
        self._motor: Motor | None = None if self._joint is None else self._joint.motor
        self._known: tuple[float, float] | None = None
        self._aim = 0.0  # target speed in rad/s or m/s; the motor's acceleration limits its changes
        self._set: tuple[float, float, bool] | None = None
        self._sensor = -1 if added.sensor is None else int(model.sensor_adr[added.sensor.id])
        self._servo = -1 if added.servo is None else int(added.servo.id)
        if added.joint is not None:
            self._at = int(model.jnt_qposadr[added.joint.id])
            self._dof = int(model.jnt_dofadr[added.joint.id])
            self._gain = GAIN * float(model.dof_M0[self._dof])

    def forget(self) -> None:
        """Make the next `take` write the position and the speed of the joint to MuJoCo."""
        self._known = None

    def take(self) -> bool:
        """Copy a client's change of the joint to MuJoCo; return whether there was a change."""
        joint = self._joint
        if joint is None or self._known == (joint.now, joint.turning):
            return False
        self._known = joint.now, joint.turning
        self._aim = joint.turning
        self._data.qpos[self._at], self._data.qvel[self._dof] = self._known
        return True

    def command(self, step_s: float, *, powered: bool) -> None:
        """Set the target of the servo for the next basic step."""
        joint, motor = self._joint, self._motor
        if joint is None:
            return
        self._limit(joint, motor)
        if motor is None:
            return
        if motor.effort_nm is not None:
            self._data.ctrl[self._servo] = motor.effort_nm if powered else 0.0
            return
        data, dof = self._data, self._dof
        load = float(data.qfrc_bias[dof] - data.qfrc_passive[dof])
        motor.speed_rad_s = self._aim
        self._aim = motor.demand(step_s) if powered else 0.0
        data.ctrl[self._servo] = self._aim + load / self._gain

    def follow(self) -> None:
        """Copy the position, speed and force that MuJoCo has computed to the scene."""
        data, joint, motor = self._data, self._joint, self._motor
        if joint is None:
            x, y, z = data.sensordata[self._sensor : self._sensor + 3].tolist()
            self.link.force = (-x, -y, -z)  # MuJoCo measures the opposite force, which holds the link
            return
        position, speed = float(data.qpos[self._at]), float(data.qvel[self._dof])
        joint.follow(position, speed)
        self._known = position, speed
        if motor is not None:
            motor.feedback_nm = float(data.actuator_force[self._servo])

    def _limit(self, joint: Joint, motor: Motor | None) -> None:
        """Set the force limit and the damping of the joint, if they have changed."""
        model, dof = self._model, self._dof
        damping = joint.braking
        limit, direct = 0.0, False
        if motor is not None:
            direct = motor.effort_nm is not None
            limit = abs(motor.available_torque_nm)
            limit = limit if direct else max(limit, joint.rubbing.friction)
        if (damping, limit, direct) == self._set:
            return
        self._set = damping, limit, direct
        model.dof_damping[dof] = joint.rubbing.damping + damping
        if motor is not None:
            model.dof_frictionloss[dof] = joint.rubbing.friction if direct else 0.0
            model.actuator_forcerange[self._servo] = -limit, limit
            model.actuator_gainprm[self._servo, 0] = 1.0 if direct else self._gain
            model.actuator_biasprm[self._servo, 2] = 0.0 if direct else -self._gain


def bodies(added: Mapping[Any, Sequence[Added]], model: Any, data: Any) -> dict[Any, tuple[LinkBody, ...]]:
    """Return the links of a compiled model, by robot; the key of links without a robot is None."""
    return {whose: tuple(LinkBody(it, model, data) for it in links) for whose, links in added.items()}
