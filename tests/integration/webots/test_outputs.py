"""The facades of devices that take commands, in each simulator."""

import pytest

from palaestra_trainer.errors import ConfigurationError, WorldMisfit, WrongData
from palaestra_trainer.webots import LED, Brake, Connector, Emitter, Pen, Speaker
from tests.integration.webots.own_world import OwnRobot, running
from tests.values.worlds import PHYSICS, Setting, robot

DEVICES = """LED { name "led" } Pen { name "pen" } Connector { name "connector" } Speaker { name "speaker" }
  Emitter { name "emitter" channel 3 range 2 maxRange 5 bufferSize 100 }
  HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 } device Brake { name "brake" }
    endPoint Solid { } }"""


class Commanded(OwnRobot):
    """A robot with one device of each facade."""

    definition = "R"

    def equip(self):
        """Add the devices."""
        kinds = (LED, Brake, Connector, Emitter, Pen, Speaker)
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
    """A program may read the LED of another part of the program."""
    devices[LED].set(3)

    assert devices[LED].value == 3


def test_a_connector_is_locked_and_unlocked(devices):
    """A locked connector without a partner counts as locked, as in Webots."""
    connector = devices[Connector]
    states = []
    for command in (connector.lock, connector.unlock):
        command()
        states.append(connector.locked)

    assert states == [True, False]


def test_an_emitter_has_the_channel_and_the_range_that_were_set(devices):
    """The first values are those of the world file."""
    emitter = devices[Emitter]
    before = emitter.channel, emitter.range_m, emitter.buffer_bytes

    emitter.set_channel(7)
    emitter.set_range(4.5)
    emitter.send("here")

    assert before == (3, 2.0, 100)
    assert (emitter.channel, emitter.range_m) == (7, 4.5)


def test_a_range_that_the_simulator_ignores_is_an_error(devices):
    """Webots confirms the command all the same, and texts would reach fewer receivers than expected."""
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
    """The simulator confirms them; nothing can be read back."""
    devices[Pen].write(on=True)
    devices[Pen].set_ink(0xFF0000, density=0.5)
    devices[Brake].set_damping(2.0)


def test_a_negative_damping_is_refused(devices):
    """Webots ignores it without an error, so the joint would keep its old brake."""
    with pytest.raises(ConfigurationError, match="the damping -1 is negative; use 0 or more"):
        devices[Brake].set_damping(-1.0)


def test_a_device_that_the_world_lacks_is_an_error_when_the_robot_connects(master, tmp_path):
    """Otherwise the first command would look like a simulator that does not respond."""
    del master
    text = Setting("stub").text(robot(""))
    with pytest.raises(WorldMisfit, match="led"), running(text, tmp_path, "stub", Commanded):
        pass
