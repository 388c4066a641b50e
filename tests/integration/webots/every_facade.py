"""The calls that use each service and topic of a robot through its facade.

`CALLS` has the members that take arguments, or whose effect lasts; every other member is an attribute, or a
method without arguments. A key is a member, or the path of a service if one member uses several services.
"""

import contextlib

import numpy as np

import palaestra_trainer.webots as facades
from palaestra_trainer.errors import WrongData
from palaestra_trainer.ros import RosService, RosSubscriber
from palaestra_trainer.webots import InputEvent, JointMotor, RobotMode, ViewLabel
from tests.integration.webots.own_world import OwnRobot
from tools.interface.everything import FAILING, ROBOT, device_name, groups, offered, world
from tools.interface.facades import facade

STEP_MS = 32
MOUTH = """DEF MOUTH Robot { name "mouth" controller "ros" translation 0 1 0
  controllerArgs [ "--name=mouth" "--synchronize" ] children [ Emitter { name "emitter" } ] }
DEF PAINTED Pose { children [ DEF SHADED Shape { appearance DEF PAINT PBRAppearance { name "red" }
  geometry DEF ROUND Cylinder { } } Shape { geometry DEF FLAT Plane { size 3 2 } } ] }
"""
WORLD = world() + "Viewpoint { }\n" + MOUTH
# These calls end or restart a controller, so a separate test makes them.
ENDING = (
    "supervisor/world_reload",
    "supervisor/world_load",
    "supervisor/node/restart_controller",
    "supervisor/simulation_quit",
)
FIELDS = {
    "bool": ("SHADED", "castShadows", False),
    "int32": ("ROUND", "subdivision", 12),
    "float": ("PAINT", "roughness", 0.5),
    "vec2f": ("FLAT", "size", (1.0, 4.0)),
    "vec3f": ("BOX", "translation", (2.0, 1.0, 0.5)),
    "rotation": ("BOX", "rotation", (0.0, 0.0, 1.0, 0.5)),
    "color": ("PAINT", "baseColor", (0.5, 0.25, 1.0)),
    "string": ("PAINT", "name", "blue"),
}
SENSORS = (
    *("Accelerometer", "Altimeter", "Compass", "DistanceSensor", "GPS", "Gyro", "InertialUnit", "LaserScan"),
    *("Lidar", "LidarPoints", "LightSensor", "PositionSensor", "Radar", "Receiver", "TouchSensor"),
    *("ConnectorPresence", "VacuumPresence", "GPSSpeed", "GPSVelocity"),
)
RENDERED = ("Camera", "CameraMatrix", "RangeFinder", "RecognizedObjects", "SegmentedImage")
EFFORTS = {"RotationalMotor": "torque", "LinearMotor": "force"}
NODES = {
    "LaserScan": "Lidar",
    "LidarPoints": "Lidar",
    "ConnectorPresence": "Connector",
    "VacuumPresence": "VacuumGripper",
    "GPSSpeed": "GPS",
    "GPSVelocity": "GPS",
    "CameraMatrix": "Camera",
    "RecognizedObjects": "Camera",
    "SegmentedImage": "Camera",
}


class EveryDevice(OwnRobot):
    """A robot with a facade of each class; `of` has the facades by class, or by class and type of node."""

    definition, period_ms = "ROBOT", STEP_MS
    renders = True

    def equip(self):
        """Add every device; the stub has no cameras and no forces."""
        self.of = {}
        name = self.node_name
        for kind in SENSORS + RENDERED:
            self.of[kind] = getattr(facades, kind)(name, device_name(NODES.get(kind, kind)))
        for kind in ("BatterySensor", "Keyboard"):
            self.of[kind] = getattr(facades, kind)(name)
        self.of["Joystick"] = facades.Joystick(name, axes=6, povs=1)
        self.depth_matrix = facades.CameraMatrix(name, "range_finder")
        self.feedback, self.motors = {}, {}
        for node, effort in EFFORTS.items():
            self.feedback[node] = facades.EffortFeedback(name, device_name(node), effort)
            for command in ("position", "velocity", effort):
                self.motors[node, command] = JointMotor(name, device_name(node), command)
        sensors = [it for kind, it in self.of.items() if kind not in RENDERED]
        if self.renders:
            sensors += [*(self.of[kind] for kind in RENDERED), self.depth_matrix, *self.feedback.values()]
        outputs = (
            "Brake",
            "Connector",
            "Display",
            "Emitter",
            "LED",
            "Pen",
            "Skin",
            "Speaker",
            "VacuumGripper",
        )
        for kind in outputs:
            self.of[kind] = getattr(facades, kind)(name, device_name(kind))
        self.mouth = facades.Emitter("mouth", "emitter")
        self.simulation.add(
            sensors, [*(self.of[kind] for kind in outputs), *self.motors.values(), self.mouth]
        )


class Recorder:
    """Records the names of the services and topics that this process uses.

    Attributes:
        asked: the names of the services that were called since the last `clear`.
        heard: the names of the topics that were subscribed, and of the services that were called before.
    """

    def __init__(self, monkeypatch):
        self.asked, self.heard = set(), set()
        begin, connect = RosService.begin, RosSubscriber.connect

        def begin_noted(service, **fields):
            self.asked.add(service.name)
            return begin(service, **fields)

        def connect_noted(topic):
            self.heard.add(topic.name)
            return connect(topic)

        monkeypatch.setattr(RosService, "begin", begin_noted)
        monkeypatch.setattr(RosSubscriber, "connect", connect_noted)

    def clear(self):
        """Forget the calls, except those that enable sensors."""
        self.heard |= {name for name in self.asked if "enable" in name}
        self.asked.clear()


class Everything:
    """A running simulator with facades of everything that its robot offers."""

    def __init__(self, simulator, webots, robot, recorder, folder):
        self.simulator, self.webots, self.robot, self.folder = simulator, webots, robot, folder
        self.recorder = recorder
        self.observer, self.supervisor = webots.observer, webots.supervisor
        self.box, self.own = self.observer.find("BOX"), self.observer.own_node()
        self.controller = facades.RobotController(ROBOT)
        self.others = {
            "Observer": self.observer,
            "Supervisor": self.supervisor,
            "WorldNode": self.box,
            "RobotController": self.controller,
        }

    def use(self, group, path):
        """Use a path through its facade, and return the result."""
        member = facade(group, path)
        kind, _, name = member.partition(".")
        call = CALLS.get(path) or CALLS.get(member)
        if call is not None:
            return call(self)
        found = getattr(self._facade(kind, group), name)
        return found() if callable(found) else found

    def begin(self, group, path):
        """Use a path that fails.

        This method really enables a sensor. `use` does not, because the robot enabled its sensors before.
        """
        kind, _, name = facade(group, path).partition(".")
        if name == "enable":
            return self._facade(kind, group).enable(STEP_MS)
        return self.use(group, path)

    def uses(self, path):
        """Return whether a path was used since the last `clear`, or at any time for a topic or `enable`."""
        name = f"/{ROBOT}/{path}"
        return name in self.recorder.asked | self.recorder.heard

    def close(self):
        """Close the facades that do not belong to the robot."""
        rendered = [*(self.robot.of[kind] for kind in RENDERED), self.robot.depth_matrix]
        for each in (self.controller, *self.robot.feedback.values(), *rendered):
            each.close()

    def file(self, name):
        """Return the path of a file that a simulator writes."""
        return self.folder / name

    def _facade(self, kind, group):
        if kind == "EffortFeedback":
            return self.robot.feedback[group]
        if kind == "JointMotor":
            return self.robot.motors[group, "position"]
        return self.others.get(kind) or self.robot.of[kind]


def rows(simulator):
    """Return owner and path of each service and topic that has a facade, without those in `ENDING`."""
    survey = offered(simulator)
    return [
        (group, path)
        for paths in (survey.services, survey.topics)
        for group, found in groups(paths).items()
        for path in found
        if facade(group, path) and path not in {*ENDING, *FAILING[simulator]}
    ]


def failing(simulator):
    """Return owner and path of each service that fails in a simulator and whose facade raises an error.

    The headset's services are excluded: without a headset, their facade returns None.
    """
    found = groups(dict.fromkeys(FAILING[simulator], ""))
    return [(group, path) for group, paths in found.items() for path in paths if "headset" not in path]


def packet(it):
    """Send a text, and take it from the receiver."""
    it.robot.mouth.send("here")
    it.robot.advance()
    taken = it.robot.of["Receiver"].take()
    assert taken is not None
    assert taken.text == "here"
    return taken


def command(node, name):
    """Return a call that sets a command of a motor."""
    return lambda it: it.robot.motors[node, name].set(0.0)


def device(kind, member, *args, **keywords):
    """Return a call of a method of a device."""
    return lambda it: getattr(it.robot.of[kind], member)(*args, **keywords)


def supervisor(member, *args, **keywords):
    """Return a call of a method of the supervisor."""
    return lambda it: getattr(it.supervisor, member)(*args, **keywords)


def both(first, second):
    """Return a call that makes two calls."""
    return lambda it: (first(it), second(it))


def inserted(it):
    """Insert a value, a node, and remove both."""
    it.supervisor.insert_node("", "children", "DEF ADDED Group { }")
    it.supervisor.remove_value("", "children")


def removed(it):
    """Insert a node and remove it by its DEF name."""
    it.supervisor.insert_node("", "children", "DEF ADDED Group { }")
    it.supervisor.remove_node("ADDED")


def field_calls():
    """Yield the calls for a field of each type; a value cannot be inserted into a field with one value."""
    for kind, (node, name, value) in FIELDS.items():
        yield f"supervisor/field/set_{kind}", supervisor("set_field", node, name, value)
        yield f"supervisor/field/get_{kind}", supervisor("get_field", node, name)
        yield f"supervisor/field/insert_{kind}", refused(supervisor("insert_value", node, name, value))


def refused(call):
    """Return a call that makes a call, and passes if the simulator refuses it."""

    def make(it):
        with contextlib.suppress(WrongData):
            call(it)

    return make


def image_of_segments(it):
    """Disable and enable the image of the recognized objects."""
    sensor = it.robot.of["SegmentedImage"]
    sensor.disable()
    if it.robot.renders:
        sensor.enable(STEP_MS)


CALLS = {
    "Stepper.step": lambda it: it.robot.advance(),
    "RobotController.wait_for_input": lambda it: it.controller.wait_for_input(InputEvent.KEYBOARD, 0.1),
    "RobotController.set_custom_data": lambda it: it.controller.set_custom_data("seven"),
    "RobotController.set_control_mode": lambda it: it.controller.set_control_mode(RobotMode.SIMULATION),
    "RobotController.send_to_window": lambda it: it.controller.send_to_window("here"),
    "RobotController.send_as_window": lambda it: it.controller.send_as_window("there"),
    "Observer.find": lambda it: (it.observer.forget_handles(), it.observer.find("BOX"), it.observer.find("")),
    "Observer.with_id": lambda it: it.observer.with_id(it.box.id),
    "Observer.find_device": lambda it: it.observer.find_device("gps"),
    "WorldNode.value": lambda it: it.box.value("translation"),
    "Observer.length": lambda it: it.observer.length("", "children"),
    "Observer.center_of_mass": lambda it: it.observer.center_of_mass("BOX"),
    "Observer.is_balanced": lambda it: it.observer.is_balanced("BOX"),
    "WorldNode.nodes": lambda it: it.observer.find("").nodes(),
    "WorldNode.pose_in": lambda it: it.box.pose_in(it.own),
    "WorldNode.track_pose": lambda it: (it.box.track_pose(it.own, STEP_MS), it.box.track_pose(it.own, 0)),
    "WorldNode.track_contacts": lambda it: (it.box.track_contacts(STEP_MS), it.box.track_contacts(0)),
    "Supervisor.reset": lambda it: (it.supervisor.reset(), it.robot.advance()),  # takes effect in a step
    "Supervisor.velocity": supervisor("velocity", "BOX"),
    "Supervisor.set_velocity": supervisor("set_velocity", "BOX", (0.0, 0.0, 0.0)),
    "Supervisor.add_force": both(
        supervisor("add_force", "ROBOT", (0.0, 0.0, 0.0)),
        supervisor("add_force", "ROBOT", (0.0, 0.0, 0.0), offset=(0.0, 0.0, 0.1)),
    ),
    "Supervisor.add_torque": supervisor("add_torque", "ROBOT", (0.0, 0.0, 0.0)),
    "Supervisor.look_at": supervisor("look_at", "BOX"),
    "Supervisor.set_visible": supervisor("set_visible", "BOX", visible=False),
    "Supervisor.remove_node": removed,
    "Supervisor.stop_inertia": supervisor("stop_inertia", "BOX"),
    "Supervisor.save_state": supervisor("save_state", "BOX", "there"),
    "Supervisor.load_state": both(
        supervisor("save_state", "BOX", "there"), supervisor("load_state", "BOX", "there")
    ),
    "Supervisor.set_joint": supervisor("set_joint", "LINEARMOTOR_JOINT", 0.0),
    "Supervisor.remove_value": inserted,
    "Supervisor.insert_node": inserted,
    "Supervisor.track_field": both(
        supervisor("track_field", "BOX", "translation", STEP_MS),
        supervisor("track_field", "BOX", "translation", 0),
    ),
    "Supervisor.set_mode": supervisor("set_mode", facades.Mode.FAST),
    "Supervisor.save_image": lambda it: it.supervisor.save_image(it.file("view.png")),
    "Supervisor.save_world": lambda it: it.supervisor.save_world(it.file("saved.wbt")),
    "Supervisor.start_animation": lambda it: it.supervisor.start_animation(it.file("world.html")),
    "Supervisor.stop_animation": refused(supervisor("stop_animation")),
    "Supervisor.start_movie": lambda it: (
        it.supervisor.start_movie(it.file("movie.mp4")),
        it.supervisor.stop_movie(),
    ),
    "Supervisor.set_label": supervisor("set_label", ViewLabel(text="here")),
    **dict(field_calls()),
    **{
        f"{device_name(node)}/set_{name}": command(node, name)
        for node, effort in EFFORTS.items()
        for name in ("position", "velocity", effort)
    },
    **{
        f"{device_name(node)}/{path}": lambda it, node=node: (
            it.robot.motors[node, "position"].set_acceleration(-1.0),
            it.robot.motors[node, "position"].set_available_effort(10.0),
            it.robot.motors[node, "position"].set_gains(10.0),
        )
        for node, effort in EFFORTS.items()
        for path in ("set_acceleration", f"set_available_{effort}", "set_control_pid")
    },
    "GPS.degrees_minutes_seconds": device("GPS", "degrees_minutes_seconds", 46.5),
    "LED.set": device("LED", "set", 1),
    "Brake.set_damping": device("Brake", "set_damping", 0.0),
    "Camera.set_field_of_view": device("Camera", "set_field_of_view", 0.7854),
    "Camera.set_focal_distance": refused(device("Camera", "set_focal_distance", 0.0)),
    "Camera.set_exposure": device("Camera", "set_exposure", 1.0),
    "Camera.save_image": lambda it: it.robot.of["Camera"].save_image(it.file("camera.png")),
    "RangeFinder.save_image": lambda it: it.robot.of["RangeFinder"].save_image(it.file("depths.png")),
    "SegmentedImage.save_image": lambda it: it.robot.of["SegmentedImage"].save_image(it.file("parts.png")),
    "SegmentedImage.disable": image_of_segments,
    "SegmentedImage.enable": image_of_segments,
    "Lidar.set_frequency": device("Lidar", "set_frequency", 10.0),
    "Lidar.layer": device("Lidar", "layer", 0),
    "LidarPoints.layer": device("LidarPoints", "layer", 0),
    "Emitter.send": device("Emitter", "send", "hello"),
    "Emitter.set_channel": device("Emitter", "set_channel", 0),
    "Emitter.set_range": device("Emitter", "set_range", -1.0),
    "Receiver.set_channel": device("Receiver", "set_channel", 0),
    "Receiver.take": packet,
    "Speaker.play": device("Speaker", "play", "horn.wav"),
    "Speaker.set_engine": device("Speaker", "set_engine", "pico"),
    "Speaker.set_language": device("Speaker", "set_language", "en-US"),
    "Speaker.speak": device("Speaker", "speak", "hello"),
    "Pen.write": device("Pen", "write", on=True),
    "Pen.set_ink": device("Pen", "set_ink", 0xFF0000, 0.5),
    "Skin.bone_name": device("Skin", "bone_name", 0),
    "Skin.bone_pose": device("Skin", "bone_pose", 0),
    "Skin.set_bone_position": device("Skin", "set_bone_position", 0, (0.0, 0.0, 0.0)),
    "Skin.set_bone_orientation": device("Skin", "set_bone_orientation", 0, (0.0, 0.0, 0.0, 1.0)),
    "Display.set_font": device("Display", "set_font", "Arial", 8),
    "Display.set_color": device("Display", "set_color", 0xFF0000),
    "Display.set_alpha": device("Display", "set_alpha", 1.0),
    "Display.set_opacity": device("Display", "set_opacity", 1.0),
    "Display.draw_pixel": device("Display", "draw_pixel", (1, 1)),
    "Display.draw_line": device("Display", "draw_line", (0, 0), (2, 2)),
    "Display.draw_text": device("Display", "draw_text", "A", (0, 0)),
    "Display.draw_image": device("Display", "draw_image", np.zeros((2, 2, 3), np.uint8)),
    "Display.copy": device("Display", "copy", (0, 0), (2, 2), (4, 4)),
    "Display.draw_file": lambda it: (
        it.robot.of["Display"].save(it.file("shown.png")),
        it.robot.of["Display"].draw_file(it.file("shown.png")),
    ),
    "Display.save": lambda it: it.robot.of["Display"].save(it.file("saved.png")),
    "Display.attach_camera": device("Display", "attach_camera", "camera"),
    **{
        f"display/{verb}_{shape}": device("Display", f"draw_{shape}", *args, fill=verb == "fill")
        for verb in ("draw", "fill")
        for shape, args in (
            ("rectangle", ((0, 0), (2, 2))),
            ("oval", ((4, 4), (2, 2))),
            ("polygon", ([(0, 0), (3, 0), (0, 3)],)),
        )
    },
    "Keyboard.press": device("Keyboard", "press", 65),
    "Keyboard.release": both(device("Keyboard", "press", 66), device("Keyboard", "release", 66)),
    "Joystick.press": device("Joystick", "press", 1),
    "Joystick.release": both(device("Joystick", "press", 2), device("Joystick", "release", 2)),
    "Joystick.move": device("Joystick", "move", (1, 2), (1,)),
    "Joystick.push": device("Joystick", "push", 1),
    "Joystick.resist": device("Joystick", "resist", 1.0, 1.0),
    # The robot enabled these sensors when it connected, so no further call is needed.
    **{
        f"{kind}.enable": lambda _it: None
        for kind in (*SENSORS, *RENDERED, "BatterySensor", "Keyboard", "Joystick", "EffortFeedback")
        if kind != "SegmentedImage"
    },
}
