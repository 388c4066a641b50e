"""Each service and topic with a member in docs/reference/ros-interface.md is used by that member."""

import math

import numpy as np
import pytest
from PIL import Image

from palaestra_trainer.errors import ConfigurationError, NoReading, SimulatorFault, WorldMisfit, WrongData
from palaestra_trainer.webots import (
    LED,
    CameraInfo,
    DistanceSensor,
    FieldName,
    FocusInfo,
    ForceSensor,
    JointMotor,
    LidarFrequency,
    LidarInfo,
    Mode,
    MotorLimits,
    RangeFinderInfo,
    RobotMode,
    ZoomInfo,
)
from tests.integration.webots.every_facade import WORLD, EveryDevice, Everything, Recorder, failing, rows
from tests.integration.webots.own_world import running
from tools.interface.everything import FAILING, ROBOT

# The values of the world file, and Webots' defaults for all other fields. Source: reference of the nodes in
# Webots' manual.
FACTS = {
    "DistanceSensor": {
        "lookup_table": ((0.0, 0.0, 0.0), (0.1, 1000.0, 0.0)),
        "min_value": 0.0,
        "max_value": 1000.0,
        "aperture_rad": 1.5708,
        "sensor_type": "generic",
        "sampling_period_ms": 32,
        "model": "",
        "node_type": 42,
    },
    "TouchSensor": {"sensor_type": "bumper", "lookup_table": ((0.0, 0.0, 0.0), (5000.0, 50000.0, 0.0))},
    "PositionSensor": {"slides": False, "motor_name": "", "brake_name": ""},
    "GPS": {"geographic": False, "node_type": 44},
    "Compass": {"lookup_table": ()},
    "Gyro": {"lookup_table": ()},
    "Accelerometer": {"lookup_table": ()},
    "InertialUnit": {"noise": 0.0},
    "LightSensor": {"lookup_table": ((0.0, 0.0, 0.0), (1.0, 1000.0, 0.0))},
    "Brake": {"slides": False, "motor_name": "", "position_sensor_name": ""},
    "Camera": {
        "info": CameraInfo(64, 64, 0.7854, 0.01),
        "focus": FocusInfo(0.0, 0.0, 0.0, 0.0),
        "zoom": ZoomInfo(0.5, 1.5),
        "exposure": 1.0,
    },
    "RangeFinder": {"info": RangeFinderInfo(64, 64, 0.7854, 0.01, 1.0)},
    "RecognizedObjects": {"recognizes": True},
    "SegmentedImage": {"segments": True},
    "Radar": {
        "min_range_m": 1.0,
        "max_range_m": 50.0,
        "field_of_view_rad": 0.78,
        "vertical_field_of_view_rad": 1.0,
    },
    "Emitter": {"buffer_bytes": -1},
    "Receiver": {"queue_length": 0},
    "Lidar": {
        "info": LidarInfo(512, 1, 1.5708, 0.2, 0.01, 1.0),
        "frequency": LidarFrequency(10.0, 1.0, 25.0),
    },
    "LidarPoints": {"enabled": True},
    "Display": {"size": (64, 64)},
    "Skin": {"bone_count": 0},
    "Speaker": {"speaking": False},
    "Joystick": {"number_of_axes": 6, "number_of_povs": 1},
}


@pytest.fixture(scope="module", params=FAILING)
def everything(request, master, tmp_path_factory):
    """Yield a running simulator, and facades of everything that its robot offers."""
    del master
    folder = tmp_path_factory.mktemp("world")

    class Equipped(EveryDevice):
        """A robot for this simulator."""

        renders = request.param == "mujoco"

    def robot(webots):
        return Equipped(webots, robots=["mouth"])

    with pytest.MonkeyPatch.context() as monkeypatch:
        recorder = Recorder(monkeypatch)
        with running(WORLD, folder, request.param, robot, name=ROBOT) as (webots, equipped):
            found = Everything(request.param, webots, equipped, recorder, folder)
            yield found
            found.close()


def test_every_path_is_used_by_the_member_that_the_page_names(everything):
    """A wrong row of the page would send its reader to a method that does something else."""
    wrong = []
    for group, path in rows(everything.simulator):
        everything.recorder.clear()
        try:
            everything.use(group, path)
        except SimulatorFault as error:
            wrong.append((path, repr(error)))
        else:
            if not everything.uses(path):
                wrong.append((path, sorted(everything.recorder.asked)))

    assert wrong == []


def test_a_path_that_fails_in_a_simulator_is_an_error_of_its_facade(everything):
    """A success without effect would mislead a program."""
    passed = []
    for group, path in failing(everything.simulator):
        try:
            everything.begin(group, path)
        except (WrongData, NoReading):
            continue
        passed.append(path)

    assert passed == []


def test_a_fact_is_the_value_of_the_world_or_the_default_of_webots(everything):
    """The expected values come from the manual, so the test also finds an error that all simulators share."""
    found = {
        kind: {name: getattr(everything.robot.of[kind], name) for name in facts}
        for kind, facts in FACTS.items()
    }

    assert found == FACTS


def test_a_motor_has_the_limits_of_the_world(everything):
    """Equal limits mean that the position has no limit."""
    motors = everything.robot.motors
    linear, rotational = motors["LinearMotor", "position"], motors["RotationalMotor", "position"]

    assert (linear.slides, rotational.slides) == (True, False)
    assert (
        linear.limits
        == rotational.limits
        == MotorLimits(min_position=0.0, max_position=0.0, max_velocity=10.0, max_effort=10.0)
    )
    assert [it.multiplier for it in (linear, rotational)] == [1.0, 1.0]


def test_the_facts_of_the_robot_are_those_of_its_world(everything):
    """A program can check whether it may use the supervisor, and can find the world file."""
    it = everything.controller

    assert (it.model, it.control_mode) == ("", RobotMode.SIMULATION)
    assert (it.supervises, it.synchronizes) == (True, True)
    assert everything.observer.world_path().startswith(it.project_path)
    assert everything.observer.mode() == Mode.FAST


def test_the_data_of_a_robot_are_those_that_were_set(everything):
    """The supervisor reads the same field of the robot's node."""
    everything.controller.set_custom_data("seven")

    assert everything.controller.custom_data == "seven"
    assert everything.supervisor.get_field("ROBOT", "customData") == "seven"
    assert everything.observer.own_node().value("customData") == "seven"


def test_texts_of_the_window_arrive_in_their_order(everything):
    """Without an unread text, `receive_from_window` returns an empty text."""
    it = everything.controller
    while it.receive_from_window():
        pass
    for text in ("first", "second"):
        it.send_as_window(text)

    assert [it.receive_from_window() for _ in range(3)] == ["first", "second", ""]


def test_a_node_is_found_by_definition_number_device_and_parent(everything):
    """Each of these four ways finds the same node, so a program may use the data that it has."""
    box = everything.observer.find("BOX")
    gps = everything.observer.find_device("gps")

    assert everything.observer.with_id(box.id) == box
    assert box.parent == everything.observer.find("")
    assert gps.parent == everything.observer.own_node() == everything.observer.find("ROBOT")
    assert box in everything.observer.find("").nodes()
    assert (box.definition, box.type_name, box.base_type_name, box.is_proto) == (
        "BOX",
        "Solid",
        "Solid",
        False,
    )
    assert (gps.definition, gps.type_name, gps.type_number) == ("", "GPS", 44)


def test_the_fields_of_a_node_have_the_names_and_types_of_the_manual(everything):
    """With these names and types, a world builder's tool can list the fields that it may change."""
    fields = everything.observer.find("BOX").fields()

    assert {
        FieldName("translation", "SFVec3f"),
        FieldName("rotation", "SFRotation"),
        FieldName("children", "MFNode"),
        FieldName("name", "SFString"),
        FieldName("locked", "SFBool"),
    } <= set(fields)


def test_a_pose_in_the_axes_of_another_node_is_their_difference(everything):
    """The box is turned by a quarter, so its x axis is the y axis of the world."""
    box, own = everything.observer.find("BOX"), everything.observer.own_node()
    everything.supervisor.set_field("BOX", "translation", (2.0, 1.0, 0.5))
    everything.supervisor.set_field("BOX", "rotation", (0.0, 0.0, 1.0, math.pi / 2.0))
    everything.robot.advance()
    of_box, of_robot = box.pose_in(own), own.pose_in(box)

    half = math.sqrt(0.5)
    assert of_box[0] == pytest.approx((2.0, 1.0, 0.5))
    assert of_box[1] == pytest.approx((0.0, 0.0, half, half))
    assert of_robot[0] == pytest.approx((-1.0, 2.0, -0.5))
    assert of_robot[1] == pytest.approx((0.0, 0.0, -half, half))


def test_a_scan_an_image_and_a_layer_are_the_same_measurement(everything):
    """A program may read the lidar in any of these three forms."""
    of = everything.robot.of
    everything.robot.advance()

    assert of["Lidar"].value.shape == (1, 512)
    assert np.array_equal(of["LaserScan"].value, of["Lidar"].value[0])
    assert np.array_equal(of["Lidar"].layer(0), of["Lidar"].value[0])
    with pytest.raises(ConfigurationError, match="lidar has no layer 1; use 0 to 0"):
        of["Lidar"].layer(1)


def test_the_points_of_a_layer_are_as_far_as_its_ranges(everything):
    """A point is at the distance that its ray measures; a ray without a hit has no point."""
    of = everything.robot.of
    everything.robot.advance()
    ranges, points = of["Lidar"].layer(0), of["LidarPoints"].layer(0)
    hit = np.isfinite(ranges)

    assert points.shape == (512, 3)
    assert np.linalg.norm(points[hit], axis=1) == pytest.approx(ranges[hit], abs=1e-6)


def test_the_matrix_of_a_camera_follows_from_its_field_of_view(everything):
    """The focal length is width / (2 tan(fov / 2)); Webots puts the center at (width + 1) / 2."""
    if not everything.robot.renders:
        return
    focal = 64 / (2.0 * math.tan(0.7854 / 2.0))
    everything.robot.advance()

    for matrix in (everything.robot.of["CameraMatrix"], everything.robot.depth_matrix):
        assert matrix.value == pytest.approx(np.array([[focal, 0, 32.5], [0, focal, 32.5], [0, 0, 1]]))


def test_an_angle_is_written_in_degrees_minutes_and_seconds(everything):
    """46.5 degrees are 46 degrees and 30 minutes."""
    assert everything.robot.of["GPS"].degrees_minutes_seconds(46.5) == "46° 30\u2032 0\u2033"


def test_a_copied_rectangle_is_at_its_new_place(everything):
    """Only the pixels of the copied rectangle may change; the rest of the display stays as it is."""
    display, file = everything.robot.of["Display"], everything.file("copied.png")
    display.set_color(0x000000)
    display.draw_rectangle((0, 0), (64, 64), fill=True)
    display.set_color(0x00FF00)
    display.draw_rectangle((0, 0), (4, 4), fill=True)
    display.copy((0, 0), (4, 4), (20, 30))
    everything.robot.advance()
    display.save(file)
    pixels = np.array(Image.open(file).convert("RGB"))
    green = np.argwhere(pixels[..., 1] > 0)  # row and column of each green pixel

    assert {tuple(it) for it in green} == {
        (row + down, column + right)
        for row in range(4)
        for column in range(4)
        for down, right in ((0, 0), (30, 20))
    }


def test_a_field_of_view_that_the_zoom_does_not_allow_is_an_error(everything):
    """The simulators and Webots confirm this command without an effect, so the facade must report it."""
    camera = everything.robot.of["Camera"]
    camera.set_field_of_view(1.2)
    changed = camera.info.field_of_view_rad
    with pytest.raises(WrongData, match="camera ignores the field of view 2 and keeps"):
        camera.set_field_of_view(2.0)
    camera.set_field_of_view(0.7854)

    assert changed == 1.2


def test_an_effort_that_a_motor_may_use_and_its_gains_are_kept(everything):
    """A program limits the effort of a motor in this way, and must be able to read the limit."""
    motor = everything.robot.motors["RotationalMotor", "position"]
    motor.set_acceleration(3.0)
    motor.set_available_effort(0.0)
    changed = motor.acceleration, motor.available_effort
    motor.set_acceleration(-1.0)
    motor.set_available_effort(10.0)

    assert changed == (3.0, 0.0)


def test_a_battery_loses_the_power_of_its_robot(everything):
    """A robot's cpuConsumption is 10 W by default; the battery of the world begins with 100 J."""
    battery = everything.robot.of["BatterySensor"]
    everything.robot.advance()
    before = battery.value
    for _ in range(5):
        everything.robot.advance()

    assert before < 100.0
    assert before - battery.value == pytest.approx(10.0 * 5 * 0.032)


def test_a_connector_and_a_gripper_that_are_alone_detect_nothing(everything):
    """Without a partner, a presence sensor must read 0 or False, and not None."""
    of = everything.robot.of

    assert (of["ConnectorPresence"].value, of["VacuumPresence"].value) == (0, False)


@pytest.mark.parametrize(
    ("kind", "command", "argument"),
    [
        ("motor", "set_acceleration", -5.0),
        ("motor", "set_acceleration", math.nan),
        ("motor", "set_available_effort", 11.0),
        ("motor", "set_gains", 0.0),
        ("Camera", "set_exposure", -1.0),
        ("GPS", "degrees_minutes_seconds", math.nan),
    ],
)
def test_a_value_that_webots_would_ignore_is_refused(everything, kind, command, argument):
    """Webots would confirm the command but keep the old value, and the program would not notice."""
    motors = everything.robot.motors
    device = motors["RotationalMotor", "position"] if kind == "motor" else everything.robot.of[kind]

    with pytest.raises(ConfigurationError):
        getattr(device, command)(argument)


def test_a_tracking_with_a_negative_period_is_refused(everything):
    """Only a period of 0 ends the tracking, so a negative period is a mistake."""
    with pytest.raises(ConfigurationError, match="a period of -5 ms"):
        everything.supervisor.track_field("BOX", "translation", -5)
    with pytest.raises(ConfigurationError, match="BOX is a Solid"):
        everything.supervisor.set_visible("BOX", "BOX", visible=False)


@pytest.mark.parametrize(
    ("wrong", "fact"),
    [
        (lambda: LED(ROBOT, "gps").set(1), "gps is a GPS in the world, and LED is for a LED"),
        (lambda: JointMotor(ROBOT, "linear_motor", "torque").set(0.0), "is a LinearMotor in the world"),
        (lambda: DistanceSensor(ROBOT, "gps").aperture_rad, "gps is a GPS in the world"),
        (lambda: ForceSensor(ROBOT, "distance_sensor").enable(32), "distance_sensor is a DistanceSensor"),
    ],
)
def test_a_facade_of_another_device_is_a_wrong_world(everything, wrong, fact):
    """The device lacks some services, so the simulator would seem to be dead, and would be restarted."""
    del everything
    with pytest.raises(WorldMisfit, match=fact):
        wrong()


def test_the_end_of_a_segmentation_leaves_the_camera_on(everything):
    """A program may still read the images of the camera itself."""
    if not everything.robot.renders:
        return
    of = everything.robot.of
    of["SegmentedImage"].disable()
    off = of["SegmentedImage"].segmenting
    of["SegmentedImage"].enable(32)
    everything.robot.advance()

    assert not off
    assert of["Camera"].sampling_period_ms == 32


def test_no_headset_and_no_selection_is_none(everything):
    """The stub and MuJoCo have no headset and no window with a selection, so the facade must return None."""
    assert everything.observer.headset_pose() is None
    assert everything.observer.selected() is None


def test_a_fact_cannot_be_set(everything):
    """Without the error, a program would not notice that its assignment has no effect."""
    with pytest.raises(AttributeError, match="channel of emitter is read-only"):
        everything.robot.of["Emitter"].channel = 3


def test_a_restarted_controller_serves_its_robot_again(everything):
    """The restart closes the controller's connections, and new connections must find the same services."""
    everything.supervisor.restart_controller("MOUTH")
    everything.robot.connect()
    everything.robot.mouth.send("here again")
    everything.robot.advance()

    assert everything.robot.of["Receiver"].value == "here again"
