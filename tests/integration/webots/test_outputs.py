"""The facades of devices that take commands, in each simulator."""

import numpy as np
import pytest
from PIL import Image

from palaestra_trainer.errors import ConfigurationError, WorldMisfit, WrongData
from palaestra_trainer.webots import LED, Brake, Connector, Display, Emitter, Pen, Speaker, VacuumGripper
from tests.integration.webots.own_world import OwnRobot, running
from tests.values.worlds import PHYSICS, Setting, robot

WIDTH_PX, HEIGHT_PX = 12, 8
RED, GREEN, BLUE, BLACK = (255, 0, 0), (0, 255, 0), (0, 0, 255), (0, 0, 0)
DEVICES = """Display { name "display" width 12 height 8 }
  LED { name "led" } Pen { name "pen" } Connector { name "connector" } Speaker { name "speaker" }
  VacuumGripper { name "vacuumgripper" }
  Emitter { name "emitter" channel 3 range 2 maxRange 5 bufferSize 100 }
  HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 } device Brake { name "brake" }
    endPoint Solid { } }"""


class Commanded(OwnRobot):
    """A robot with one device of each facade."""

    definition = "R"

    def equip(self):
        """Add the devices."""
        kinds = (LED, Brake, Connector, Display, Emitter, Pen, Speaker, VacuumGripper)
        self.devices = {kind: kind(self.node_name, kind.__name__.lower()) for kind in kinds}
        self.simulation.add([], list(self.devices.values()))


@pytest.fixture(scope="module", params=PHYSICS)
def devices(request, master, tmp_path_factory):
    """Yield the devices of a robot in a running simulator."""
    del master
    text = Setting(request.param).text(robot(DEVICES))
    with running(text, tmp_path_factory.mktemp("world"), request.param, Commanded) as (_, commanded):
        yield commanded.devices


def test_a_led_has_the_value_that_was_set(devices):
    """One part of a program may read the LED that another part has set."""
    devices[LED].set(3)

    assert devices[LED].value == 3


@pytest.mark.parametrize(
    ("kind", "commands", "state"),
    [(Connector, ("lock", "unlock"), "locked"), (VacuumGripper, ("turn_on", "turn_off"), "on")],
)
def test_a_connector_and_a_gripper_have_the_state_of_the_last_command(devices, kind, commands, state):
    """A locked connector without a partner counts as locked, as in Webots; this gripper can hold nothing."""
    device = devices[kind]
    states = []
    for command in commands:
        getattr(device, command)()
        states.append(getattr(device, state))

    assert states == [True, False]


def test_an_emitter_has_the_channel_and_the_range_that_were_set(devices):
    """Before the first command the world file determines the values, and afterwards the command does."""
    emitter = devices[Emitter]
    before = emitter.channel, emitter.range_m, emitter.buffer_bytes

    emitter.set_channel(7)
    emitter.set_range(4.5)
    emitter.send("here")

    assert before == (3, 2.0, 100)
    assert (emitter.channel, emitter.range_m) == (7, 4.5)


def test_a_range_that_the_simulator_ignores_is_an_error(devices):
    """Webots would confirm the command but keep the old range, so texts would reach too few receivers."""
    with pytest.raises(WrongData, match="emitter ignores the range 6 and keeps"):
        devices[Emitter].set_range(6.0)


def test_a_sound_that_loops_plays_until_it_is_stopped(devices):
    """In the stub and in MuJoCo, a sound that does not loop ends at once."""
    speaker = devices[Speaker]
    speaker.play("sounds/beep.wav", volume=0.5, loop=True)
    during = speaker.plays("sounds/beep.wav"), speaker.plays()

    speaker.stop("sounds/beep.wav")
    speaker.speak("hello")

    assert during == (True, True)
    assert (speaker.plays(), speaker.speaking) == (False, False)


def test_a_pen_and_a_brake_take_their_commands(devices):
    """Each simulator must confirm the commands; no service returns their effect."""
    devices[Pen].write(on=True)
    devices[Pen].set_ink(0xFF0000, density=0.5)
    devices[Brake].set_damping(2.0)


def test_a_negative_damping_is_refused(devices):
    """Webots ignores a negative damping without an error, so the joint would keep its old damping."""
    with pytest.raises(ConfigurationError, match="the damping -1 is negative; use 0 or more"):
        devices[Brake].set_damping(-1.0)


def shown(display, folder):
    """Return the visible image of a display: shape (height, width, 3), RGB."""
    display.save(folder / "display.png")
    return np.asarray(Image.open(folder / "display.png").convert("RGB"))


def fill(display, rgb):
    """Fill the whole display with a color."""
    display.set_opacity(1.0)
    display.set_alpha(1.0)
    display.set_color(rgb)
    display.draw_rectangle((0, 0), display.size, fill=True)


@pytest.mark.parametrize(
    ("draw", "inside", "outside"),
    [
        (lambda it: it.draw_pixel((3, 2)), [(3, 2)], [(2, 2), (3, 3)]),
        (lambda it: it.draw_line((1, 1), (6, 1)), [(1, 1), (4, 1), (6, 1)], [(0, 1), (7, 1), (3, 2)]),
        (lambda it: it.draw_rectangle((1, 1), (5, 4)), [(1, 1), (5, 1), (1, 4)], [(2, 2), (7, 4)]),
        (lambda it: it.draw_rectangle((1, 1), (5, 4), fill=True), [(1, 1), (3, 3), (5, 4)], [(6, 1), (1, 5)]),
        (lambda it: it.draw_oval((5, 4), (3, 2)), [(8, 4), (5, 2)], [(5, 4), (8, 2)]),
        (lambda it: it.draw_oval((5, 4), (3, 2), fill=True), [(5, 4), (8, 4)], [(8, 2), (2, 6)]),
        (lambda it: it.draw_polygon([(1, 1), (7, 1), (1, 7)]), [(1, 1), (7, 1), (1, 7)], [(3, 3), (7, 7)]),
        (lambda it: it.draw_polygon([(1, 1), (7, 1), (1, 7)], fill=True), [(2, 2), (3, 3)], [(7, 7)]),
    ],
)
def test_a_display_shows_what_is_drawn(devices, tmp_path, draw, inside, outside):
    """Points are x and y from the upper left corner."""
    display = devices[Display]
    fill(display, 0x0000FF)
    display.set_color(0xFF0000)

    draw(display)
    image = shown(display, tmp_path)

    assert display.size == (WIDTH_PX, HEIGHT_PX)
    assert image.shape == (HEIGHT_PX, WIDTH_PX, 3)
    assert {tuple(image[y, x]) for x, y in inside} == {RED}
    assert {tuple(image[y, x]) for x, y in outside} == {BLUE}


def test_a_display_shows_images_and_files(devices, tmp_path):
    """An image replaces the old pixels, or alpha mixes both. A file must be on the simulator's machine."""
    display = devices[Display]
    fill(display, 0)
    image = np.zeros((2, 3, 3), np.uint8)
    image[0], image[1, 2] = RED, GREEN
    half = np.full((1, 2, 4), (0, 0, 255, 128), np.uint8)
    Image.new("RGB", (2, 2), GREEN).save(tmp_path / "green.png")

    display.draw_image(image, (1, 1))
    display.draw_image(half, (1, 1), blend=True)
    display.draw_file(tmp_path / "green.png", (8, 5))
    pixels = shown(display, tmp_path)

    assert pixels[1, 1] == pytest.approx((127, 0, 128), abs=2)
    assert [tuple(pixels[y, x]) for x, y in [(3, 1), (3, 2), (1, 2), (4, 1)]] == [RED, GREEN, BLACK, BLACK]
    assert [tuple(pixels[y, x]) for x, y in [(8, 5), (9, 6), (10, 6)]] == [GREEN, GREEN, BLACK]


def test_a_display_writes_texts_in_the_color_and_size_that_were_set(devices, tmp_path):
    """The glyphs differ from Webots', so only their color and extent are compared."""
    display = devices[Display]
    fill(display, 0)
    display.set_color(0x00FF00)
    display.set_font("Arial", 6, smooth=False)

    display.draw_text("I", (1, 1))
    pixels = shown(display, tmp_path)

    written = np.argwhere(pixels.any(axis=2))
    assert {tuple(pixels[y, x]) for y, x in written} == {GREEN}
    assert written.min() >= 1


@pytest.mark.parametrize(
    "image", [np.zeros((2, 2), np.uint8), np.zeros((2, 2, 3)), np.zeros((0, 2, 3), np.uint8)]
)
def test_an_array_that_is_no_image_is_refused(devices, image):
    """The simulator would read its bytes as other colors, or in other rows."""
    with pytest.raises(ConfigurationError, match="cannot be drawn; use"):
        devices[Display].draw_image(image)


def test_a_file_that_is_no_image_is_refused(devices, tmp_path):
    """Webots reports this mistake only on its console, which the program does not read."""
    with pytest.raises(WrongData, match=r"display refuses image_load for .*missing.png; use a PNG or JPEG"):
        devices[Display].draw_file(tmp_path / "missing.png")


def test_a_camera_that_the_robot_lacks_is_not_attached(devices):
    """Without the error, the display would show no background, and the program would not know why."""
    devices[Display].detach_camera()

    with pytest.raises(WrongData, match="display refuses attach_camera with value 'eye'"):
        devices[Display].attach_camera("eye")


def test_a_device_that_the_world_lacks_is_an_error_when_the_robot_connects(master, tmp_path):
    """Otherwise the first command would look like a simulator that does not respond."""
    del master
    text = Setting("stub").text(robot(""))
    with pytest.raises(WorldMisfit, match="led"), running(text, tmp_path, "stub", Commanded):
        pass
