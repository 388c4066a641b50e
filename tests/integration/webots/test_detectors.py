"""The facades of radio, radar, keyboard, joystick, recognition and forces, in each simulator."""

import math
from functools import partial

import numpy as np
import pytest

from palaestra_trainer.errors import SimulatorDead, WorldMisfit, WrongData
from palaestra_trainer.ros import RosSubscriber
from palaestra_trainer.webots import (
    Emitter,
    Force3DSensor,
    ForceSensor,
    Joystick,
    Keyboard,
    Radar,
    Receiver,
    RecognizedObjects,
    SegmentedImage,
)
from tests.integration.webots.own_world import OwnRobot, running
from tests.values.frames import frame, quaternion
from tests.values.standing import MOUNT
from tests.values.worlds import PHYSICS, Setting, robot

EMITTER = (2.0, -1.0, 0.5)
TARGETS = [(3.0, 0.5, 0.2), (7.0, -2.0, -0.3)]
CROSS_SECTION_M2 = 2.5
RECEIVER = f"""Receiver {{ name "receiver" {MOUNT.fields} channel 4 }}"""
SPEAKING = """Emitter {{ name "emitter" translation {} {} {} channel 4 }}""".format(*EMITTER)
RADAR = """Radar { name "radar" maxRange 20 horizontalFieldOfView 1.5 verticalFieldOfView 1
  minRadialSpeed 0 maxRadialSpeed 0 antennaGain 15 frequency 20 transmittedPower 2 }"""
UP_KEY = 315


def target(number):
    """Return the text of a target of the radar."""
    x, y, z = TARGETS[number]
    return f"""DEF TARGET_{number} Solid {{ translation {x} {y} {z} name "target {number}"
      radarCrossSection {CROSS_SECTION_M2} }}"""


class Detecting(OwnRobot):
    """A robot with receiver and radar, and with the keyboard and joystick that every robot has."""

    definition = "R"

    def equip(self):
        """Add the devices."""
        name = self.node_name
        self.receiver, self.emitter = Receiver(name, "receiver"), Emitter("other", "emitter")
        self.radar = Radar(name, "radar")
        self.keyboard, self.joystick = Keyboard(name), Joystick(name, axes=3, povs=1)
        self.simulation.add([self.receiver, self.radar, self.keyboard, self.joystick], [self.emitter])


@pytest.fixture(scope="module", params=PHYSICS)
def detecting(request, master, tmp_path_factory):
    """Yield a facade and a robot in a running simulator."""
    del master
    text = Setting(request.param).text(
        robot(RECEIVER + RADAR) + robot(SPEAKING, name="other") + target(0) + target(1)
    )
    kind = partial(Detecting, robots=["other"])  # a robot does not receive its own texts
    with running(text, tmp_path_factory.mktemp("world"), request.param, kind) as started:
        yield started


def test_a_radar_reads_each_target_by_the_radar_equation(detecting):
    """The power is in dBm, and an azimuth to the right is positive. The speed is 0, because nothing moves."""
    _, it = detecting
    it.advance()
    wavelength, gain = 299_792_458.0 / 20e9, 10.0**1.5

    found = sorted(it.radar.value)

    assert len(found) == len(TARGETS)
    for echo, place in zip(found, TARGETS, strict=True):
        distance = math.hypot(*place)
        power = 1e-3 * 10**0.2 * gain**2 * wavelength**2 * CROSS_SECTION_M2
        power /= (4.0 * math.pi) ** 3 * distance**4
        assert echo.distance_m == pytest.approx(distance)
        assert echo.azimuth_rad == pytest.approx(math.atan2(-place[1], place[0]))
        assert echo.received_power_dbm == pytest.approx(10.0 * math.log10(power / 1e-3))
        assert echo.speed_m_s == 0.0


def test_a_radar_that_sees_no_target_has_an_empty_value(detecting):
    """The value None would mean that the radar has not measured yet."""
    webots, it = detecting
    for number in range(len(TARGETS)):
        webots.supervisor.set_field(f"TARGET_{number}", "translation", (-5.0, 0.0, 0.0))
    it.advance()
    nothing = it.radar.value
    for number, place in enumerate(TARGETS):
        webots.supervisor.set_field(f"TARGET_{number}", "translation", place)
    it.advance()

    assert nothing == ()
    assert len(it.radar.value) == len(TARGETS)


def test_an_interrupted_reading_of_a_radar_does_not_shift_the_next(detecting, monkeypatch):
    """Ctrl-C may come after the facade has read the number of targets, but before it has read the targets."""
    webots, it = detecting
    read = RosSubscriber.next

    def interrupted(topic):
        if not topic.name.endswith("/targets"):
            return read(topic)
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(RosSubscriber, "next", interrupted)
    with pytest.raises(KeyboardInterrupt):
        it.advance()
    webots.supervisor.set_field("TARGET_0", "translation", (4.0, 0.0, 0.0))
    it.advance()
    distances = sorted(echo.distance_m for echo in it.radar.value)
    webots.supervisor.set_field("TARGET_0", "translation", TARGETS[0])

    assert distances == pytest.approx([4.0, math.hypot(*TARGETS[1])])


def test_a_receiver_takes_one_packet_in_each_step(detecting):
    """The strength is 1 / square of the distance, and the direction is in the axes of the receiver."""
    _, it = detecting
    way = MOUNT.rotation.T @ (np.array(EMITTER) - MOUNT.position)
    distance = float(np.linalg.norm(way))
    assert it.receiver.take() is None
    it.emitter.send("first")
    it.emitter.send("zweite Nachricht: ü")
    it.advance()

    length, oldest = it.receiver.queue_length, it.receiver.value
    first, again = it.receiver.take(), it.receiver.take()
    it.advance()
    second = it.receiver.take()
    it.advance()

    assert (length, oldest) == (2, "first")
    assert (first.text, again, second.text) == ("first", None, "zweite Nachricht: ü")
    assert first.signal_strength == pytest.approx(1.0 / distance**2)
    assert first.direction == pytest.approx(way / distance)
    assert it.receiver.take() is None


def test_a_receiver_on_another_channel_receives_nothing(detecting):
    """Robots that share a world use the channels to keep their texts apart."""
    _, it = detecting
    it.receiver.set_channel(5)
    it.emitter.send("not for you")
    it.advance()
    length, channel = it.receiver.queue_length, it.receiver.channel
    it.receiver.set_channel(4)

    assert (length, channel) == (0, 5)
    assert it.receiver.take() is None


def test_a_keyboard_has_the_keys_that_are_pressed_in_each_step(detecting):
    """A pod has no keyboard, so a program must be able to press keys."""
    _, it = detecting
    for key in (ord("W"), UP_KEY):
        it.keyboard.press(key)
    it.advance()
    both = it.keyboard.value
    it.keyboard.release(UP_KEY)
    it.advance()
    one = it.keyboard.value
    it.keyboard.release()
    it.advance()

    assert (both, one, it.keyboard.value) == ((ord("W"), UP_KEY), (ord("W"),), ())


def test_a_key_that_is_not_pressed_cannot_be_released(detecting):
    """The program assumes a wrong state of the key, so it must get an error."""
    _, it = detecting

    with pytest.raises(WrongData, match="keyboard: 65 is not pressed"):
        it.keyboard.release(65)


def test_a_joystick_has_buttons_axes_and_hat_switches(detecting):
    """Until a joystick is connected, all positions are 0."""
    _, it = detecting
    before = it.joystick.value, it.joystick.connected
    it.joystick.press(2)
    it.joystick.move(axes=[-128, 5, 127], povs=[1])
    it.advance()
    pressed = it.joystick.value
    it.joystick.release()
    it.joystick.move(axes=[0])
    it.advance()

    assert before == (((), (0, 0, 0), (0,)), False)
    assert (pressed, it.joystick.connected) == (((2,), (-128, 5, 127), (1,)), True)
    assert it.joystick.value == ((), (0, 5, 127), (1,))


@pytest.mark.parametrize("button", [-2, 128])
def test_a_button_that_no_joystick_has_is_refused(detecting, button):
    """The message has no space for such a number, so the number would crash the simulator."""
    _, it = detecting

    with pytest.raises(WrongData, match=f"joystick refuses to press {button}"):
        it.joystick.press(button)
    it.advance()


def test_a_position_that_no_joystick_has_is_refused(detecting):
    """A position must fit into one byte of the message."""
    _, it = detecting

    with pytest.raises(WrongData, match=r"joystick refuses set_axes with \[128\]"):
        it.joystick.move(axes=[128])


PLATE = """TouchSensor { name "%s" type "%s" lookupTable [ ] translation %s 0 0.2
  boundingObject Box { size 0.2 0.2 0.02 } physics Physics { density -1 mass 2 } }"""
CAMERA = """Camera { name "camera" width 80 height 60 fieldOfView 0.9
  recognition Recognition { segmentation TRUE } }"""
BALL = frame((1.0, 0.2, 0.1), (0.0, 0.0, 1.0), 0.7)
SEEN = f"""DEF BALL Solid {{ {BALL.fields} name "ball" model "ball" recognitionColors [ 1 0 0.5 ]
  children [ Shape {{ geometry Sphere {{ radius 0.1 }} }} ] }}"""


class Feeling(OwnRobot):
    """A robot with sensors of force and a camera that recognizes objects."""

    definition = "R"

    def equip(self):
        """Add the devices."""
        name = self.node_name
        self.pressure, self.force = ForceSensor(name, "pressure"), Force3DSensor(name, "force")
        self.objects, self.segments = RecognizedObjects(name, "camera"), SegmentedImage(name, "camera")
        self.simulation.add([self.pressure, self.force, self.objects, self.segments], [])


def test_forces_and_objects_are_read_in_mujoco(master, tmp_path):
    """No object touches the plates, so `force-3d` measures a plate's own weight. The camera looks along x."""
    del master
    plates = PLATE % ("pressure", "force", "1") + PLATE % ("force", "force-3d", "-1")
    text = Setting("mujoco").text(robot(plates + CAMERA, "boundingObject Box { size 3 0.5 0.2 }") + SEEN)
    with running(text, tmp_path, "mujoco", Feeling) as (_, it):
        for _ in range(10):
            it.advance()
        (ball,) = it.objects.value
        segments = it.segments.value.copy()

    assert it.force.value == pytest.approx((0.0, 0.0, -2.0 * 9.81), abs=1e-3)
    assert it.pressure.value == pytest.approx(0.0, abs=1e-3)
    assert ball.position == pytest.approx(BALL.position, abs=1e-3)
    assert ball.orientation == pytest.approx(quaternion(BALL.rotation), abs=1e-3)
    assert (ball.colors, ball.model) == (((1.0, 0.0, 0.5),), "ball")
    focal_px = 40.0 / math.tan(0.45)
    x, y = 40.0 - focal_px * 0.2, 30.0 - focal_px * 0.1
    assert ball.position_on_image == pytest.approx((x, y), abs=2.0)
    assert ball.size_on_image == pytest.approx((0.2 * focal_px, 0.2 * focal_px), abs=3.0)
    assert segments[round(y), round(x)].tolist() == [128, 0, 255, 255]  # the ball's color as BGRA
    of_ball = (segments[..., :3] > 0).any(axis=-1)
    assert of_ball.sum() == pytest.approx(math.pi * (0.1 * focal_px) ** 2, rel=0.1)


def test_the_stub_refuses_a_camera_that_recognizes(master, tmp_path):
    """The stub renders no image, so it cannot detect which objects are visible."""
    del master

    class Seeing(OwnRobot):
        definition = "R"

        def equip(self):
            self.simulation.add([RecognizedObjects(self.node_name, "camera")], [])

    text = Setting("stub").text(robot(CAMERA) + SEEN)
    with (
        pytest.raises(WorldMisfit, match="a simulator that renders images"),
        running(text, tmp_path, "stub", Seeing),
    ):
        pass


def test_a_recognition_of_a_simulator_that_does_not_run_is_a_dead_simulator(master):
    """To explain a fault, the facade sends one more request, which must not wait for a dead simulator."""
    del master
    objects = RecognizedObjects("absent", "camera")

    with pytest.raises(SimulatorDead):
        _ = objects.recognizes
    with pytest.raises(SimulatorDead):
        objects.enable(32)


def test_a_touch_sensor_of_another_type_is_a_wrong_world(master, tmp_path):
    """The sensor's messages have another type, so without this error the simulator would seem to be dead."""
    del master

    class Pressed(OwnRobot):
        definition = "R"

        def equip(self):
            self.simulation.add([ForceSensor(self.node_name, "plate")], [])

    plate = """TouchSensor { name "plate" boundingObject Box { size 0.1 0.1 0.1 } }"""
    text = Setting("stub").text(robot(plate))
    refused = 'plate has the type "bumper", which TouchSensor reads'
    with pytest.raises(WorldMisfit, match=refused), running(text, tmp_path, "stub", Pressed):
        pass
