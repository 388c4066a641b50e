"""The parts of a model that do not depend on its obstacles: options, floors, bases, contact sensors."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from palaestra_sim.mujoco.body import MujocoBody, servo
from palaestra_sim.mujoco.geoms import FRICTION, STANDING, Marks
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.scene.physics_settings import PhysicsSettings

MASS_KG: Final = 23.0  # mass of a robot without Physics: the mass of a Robotino 3 with batteries
STANDING_KG: Final = 1e5  # mass of a robot without a drive, so that other robots cannot push it
_FOUND: Final = (1, 0, 1)  # parameters of a contact sensor: the data `found`, no reduction, one slot
_LEAST_KG: Final = 1e-6
_LEAST_KG_M2: Final = 1e-9


def build_free(body: MujocoBody, height_m: float, surroundings: PhysicsSettings) -> Any:
    """Return a model with one robot and no shapes: the motion of the robot while it touches nothing.

    With this model, MuJoCo computes the same bits as with the whole model, in about a third of the time.
    """
    spec = mujoco.MjSpec()
    add_base(spec, body, height_m, 0)
    begin_spec(spec, replace(surroundings, floors=()))
    return spec.compile()


def begin_spec(spec: Any, surroundings: PhysicsSettings) -> list[Any]:
    """Set the options of the whole model, and add the floors; return the geoms of the floors."""
    spec.option.gravity = [0.0, 0.0, -surroundings.gravity_m_s2]
    spec.compiler.degree = False
    spec.compiler.balanceinertia = True  # Webots accepts any inertia matrix
    spec.compiler.boundmass, spec.compiler.boundinertia = _LEAST_KG, _LEAST_KG_M2
    # MuJoCo's faster integrator ignores the coupling of x and y. With that integrator, a robot would be
    # slower in diagonal directions than along the axes.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    return [
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            pos=[0.0, 0.0, height_m],
            size=[0, 0, 1],
            contype=STANDING,
            conaffinity=0,
            friction=FRICTION,
        )
        for height_m in surroundings.heights_m()
    ]


def add_contact_sensors(spec: Any, marks: Marks) -> None:
    """Add a sensor for each part of a robot; its value is the number of the part's contacts in a step."""
    for number, (geom, _, body, _) in enumerate(marks.entries):
        if body is not None:
            geom.name = f"part {number}"
            sensor = spec.add_sensor(type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=mujoco.mjtObj.mjOBJ_GEOM)
            sensor.objname = geom.name
            sensor.intprm[:3] = _FOUND


def add_base(spec: Any, body: MujocoBody, height_m: float, index: int) -> Any:
    """Add the body of a robot without its shapes: mass, joints and servos."""
    added = spec.worldbody.add_body(pos=[0.0, 0.0, height_m], name=f"base {index}")
    added.explicitinertial = True
    mass = sum(matter.mass_kg for matter in body.build.matter) or MASS_KG
    if body.base.drive is None:
        mass = STANDING_KG
    added.mass = mass
    turning = 0.5 * mass * body.radius_m**2
    added.inertia = [turning, turning, turning]
    for direction in ([1, 0, 0], [0, 1, 0]):
        added.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    added.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    added.add_site(name=f"base {index}")
    for axis, (gear, inertia) in enumerate(((0, mass), (1, mass), (5, turning))):
        gain, force = servo(axis, inertia)
        actuator = spec.add_actuator(
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            target=f"base {index}",
            gear=[float(at == gear) for at in range(6)],
            forcelimited=True,
            forcerange=[-force, force],
        )
        actuator.set_to_velocity(kv=gain)
    return added
