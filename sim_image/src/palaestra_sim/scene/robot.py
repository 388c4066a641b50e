"""One simulated robot: its motors, its sensors, and its noise.

The robot's `customData` contains the seed of the noise, either as a whole number (`"7"`) or as JSON
(`'{"seed": 7}'`). The seed is read when the world is loaded and at each `simulation_reset`. Any other text
leaves the seed unchanged. The initial seed is WorldInfo.randomSeed. After a reset, the noise depends only on
the seed and on the number of steps, because a sensor with noise draws its random numbers at every step, even
while it is not enabled. Lidars and radars differ: they draw a number for each point or target that they
measure, and only while they are enabled. The sensors draw in the order of their types in `DEVICES`, then in
the order of the world file.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Mapping, Sequence

from palaestra_sim.scene.battery import Battery
from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.camera_interface import CameraInterface, Lens
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.device_type import Sample, ValueSource
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.motion import Motion, Trail, motion_of
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.nodes.scene_node import FieldContent, SceneNode
from palaestra_sim.scene.physics import Cast, Physics
from palaestra_sim.scene.robot_parts import RobotParts
from palaestra_sim.scene.sensor_rays import Beam
from palaestra_sim.scene.visual_rays import Glance, VisualRays
from palaestra_sim.scene.visuals import View


class Robot:
    """A robot of the world, with or without a body.

    Attributes:
        name: Robot.name in the world file.
        motors: the motors, by device name.
        sensors: the sensors, by device name; each sensor has a `value` after a step.
        samplers: the functions that set the values of all sensors; they are called in this order.
        gauss: returns the next number of the robot's noise; its arguments are the mean and the standard
            deviation.
        place: the frame of the robot.
        body: the robot's body in the physics; None if the robot cannot drive and is not a free-standing
            obstacle.
        time_s: the time of the world since its start or its last reset.
        resets: the number of resets of the world.
        powered: whether the motors have energy to turn.
        links: the parts on the robot's joints that forces move.
        battery: the battery; its value is -1 if the robot has no battery.
    """

    def __init__(self, parts: RobotParts, random_seed: int, physics: Physics, view: View) -> None:
        self.parts = parts
        self._physics = physics
        self._view = view
        self.name = parts.name
        self.motors: dict[str, Motor] = parts.devices.motors
        self.sensors: Mapping[str, ValueSource] = parts.devices.sensors
        self.place: Frame = parts.place
        self.body: Body | None = parts.body
        self.battery = Battery(parts.node)
        self.time_s = 0.0
        self.resets = 0
        self.powered = True
        self._has_battery = self.battery.value >= 0.0
        self.seed = random_seed
        self._random = random.Random()  # noqa: S311 - noise, not secrets
        self.gauss = self._random.gauss
        self._trails: list[Trail] = []
        for kind, device in parts.devices.rows.values():
            kind.attach(device, self)
        self.samplers: tuple[Sample, ...] = tuple(
            kind.sampler(devices, self)
            for kind in DEVICES.values()
            if kind.sampler is not None and (devices := parts.devices.of(kind))
        )
        self.links = parts.links
        by_forces = {link.joint.motor for link in self.links if link.joint is not None}
        self._stray_motors = tuple(
            it
            for it in self.motors.values()
            if it not in by_forces and (self.body is None or not self.body.base.has(it))
        )
        self.sow()

    @property
    def custom_data(self) -> str:
        """The current value of the customData field."""
        return self.parts.node.text("customData") or ""

    @custom_data.setter
    def custom_data(self, text: str) -> None:
        self.parts.node.fields["customData"] = FieldContent([text])

    def look(self, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function that returns the distance that each beam travels; see `Carrier`."""
        return self._physics.look(self, beams, mount)

    def see(self, beams: Sequence[Beam], mount: Frame | None = None) -> Cast:
        """Return a function like `look`; but the beams stop at visible shapes; see `Carrier`."""
        return self._physics.see(self, beams, mount)

    def reflect(self, beams: Sequence[Beam], mount: Frame | None = None) -> Callable[[], Sequence[Glance]]:
        """Return a function that returns the surface that each infra-red beam meets; see `Carrier`."""
        return VisualRays(self._view, self.place, beams, mount, textures=True).cast

    def lights(self) -> Sequence[SceneNode]:
        """Return the current lights of the world; see `Carrier`."""
        return self._view.lights()

    def eye(self, place: Frame, lens: Lens) -> CameraInterface | None:
        """Return a camera at a frame; None if this simulator does not render; see `Carrier`."""
        return self._physics.eye(place, lens)

    def device(self, name: str) -> object | None:
        """Return one of the robot's devices; see `Carrier`."""
        _, device = self.parts.devices.rows.get(name, (None, None))
        return device

    def motion(self, place: Frame) -> Motion:
        """Return the motion in the world of a frame on the robot; see `Carrier`."""
        return motion_of(place, self.body)

    def follow(self, place: Frame) -> Callable[[], Vector]:
        """Return a function that returns the acceleration of a frame; see `Carrier`."""
        trail = Trail(place, self.body)
        self._trails.append(trail)
        return trail.acceleration

    def begin(self, step_s: float) -> None:
        """Begin a basic step; a robot with an empty battery does not move."""
        self.time_s += step_s
        if self._has_battery:
            self.powered = not self._exhausted(step_s)
            if not self.powered:
                self.halt()
                return
        for trail in self._trails:
            trail.begin(step_s)

    def turn(self, step_s: float) -> None:
        """Turn the motors for one basic step, except motors that drive a wheel or that forces move."""
        if self.powered:
            for motor in self._stray_motors:
                motor.advance(step_s)

    def _exhausted(self, step_s: float) -> bool:
        self.battery.drain(step_s)
        return self.battery.empty

    def reset(self) -> None:
        """Stop, and return pose, motors, battery and noise to their start; customData is kept."""
        self.battery.reset()
        self.time_s = 0.0
        self.resets += 1
        self.powered = True
        self.place.return_to_start()
        for motor in self.motors.values():
            motor.reset()
        self.halt()
        for trail in self._trails:
            trail.reset()
        self.sow()

    def halt(self) -> None:
        """Stop all motion."""
        if self.body is not None:
            self.body.halt()
        for link in self.links:
            if link.joint is not None:
                link.joint.halt()
        for motor in self._stray_motors:
            motor.halt()

    def sow(self) -> None:
        """Restart the noise with the current seed in customData."""
        self.seed = seed_of(self.custom_data, self.seed)
        self._random.seed(self.seed)


def seed_of(custom_data: str, otherwise: int) -> int:
    """Return the seed in a robot's customData: `7` or `{"seed": 7}`; else `otherwise`."""
    try:
        value = json.loads(custom_data)
    except (ValueError, RecursionError):
        return otherwise
    if isinstance(value, dict):
        value = value.get("seed")
    return value if isinstance(value, int) and not isinstance(value, bool) else otherwise
