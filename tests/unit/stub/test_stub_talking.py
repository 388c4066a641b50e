"""Emitters, receivers, connectors, speakers, pens and grippers: devices that affect other devices."""

import pytest

from palaestra_sim.ros.node import ServiceFailed

TALKER = """Robot {{ name "{0}" translation {1} 0 0 supervisor TRUE controller "ros"
  controllerArgs [ "--name={0}" "--synchronize" ] synchronization FALSE children [ {2} ] }}"""
EMITTER = 'Emitter { name "mouth" range 2 maxRange 5 channel 1 bufferSize 10 }'
RECEIVER = 'Receiver { name "ear" channel 1 rotation 0 0 1 1.5707963 }'


@pytest.fixture
def pair(start, world, ros):
    """`pair(here, there, distance)` returns the nodes of two robots, each with one of these devices."""

    def begin(here, there, distance_m=1.0):
        start(world(robot=f"{TALKER.format('here', 0, here)} {TALKER.format('there', distance_m, there)}"))
        return ros.node("here"), ros.node("there")

    return begin


def step(*robots):
    """Make one basic step with each robot."""
    for robot in robots:
        robot.call("robot/time_step", value=32)


def test_a_packet_arrives_after_the_next_step(pair):
    """The receiver is turned by 90 degrees, and gets the direction in its own frame.

    The signal strength is 1 / distance squared.
    """
    here, there = pair(EMITTER, RECEIVER, 2.0)
    heard = there.inbox("ear/data")
    assert there.get("ear/enable", value=32) is True
    assert here.get("mouth/send", value="hello") is True
    assert there.get("ear/get_queue_length") == 0

    step(here, there)

    assert there.get("ear/get_queue_length") == 1
    assert there.get("ear/get_data_size") == 5
    assert there.get("ear/get_signal_strength") == pytest.approx(0.25)
    assert there.get("ear/get_emitter_direction") == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert [message["data"] for message in heard][-1] == "hello"


def test_a_robot_does_not_hear_itself(pair):
    """In Webots too, a robot's receiver gets no packet from the robot's own emitter, on any channel."""
    here, there = pair(EMITTER + RECEIVER, RECEIVER)
    for robot in (here, there):
        robot.call("ear/enable", value=32)
    here.call("mouth/send", value="hello")
    step(here, there)

    assert here.get("ear/get_queue_length") == 0
    assert there.get("ear/get_queue_length") == 1


def test_packets_wait_in_a_queue(pair):
    """`next_packet` drops the oldest packet. In an empty queue there is no packet to read."""
    here, there = pair(EMITTER, RECEIVER)
    there.call("ear/enable", value=32)
    here.call("mouth/send", value="one")
    here.call("mouth/send", value="two")
    step(here, there)

    assert there.get("ear/get_queue_length") == 2
    assert [there.get("ear/next_packet") for _ in range(3)] == [True, True, False]
    assert there.get("ear/get_data_size") == -1
    assert there.get("ear/get_signal_strength") == -1.0
    assert there.get("ear/get_emitter_direction") == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("emitter", "receiver", "arrives"),
    [
        (1, 1, True),
        (1, 2, False),
        (-1, 2, True),
        (1, -1, True),
    ],
)
def test_a_channel_is_heard_by_those_who_listen_to_it(pair, emitter, receiver, arrives):
    """A receiver on channel -1 gets the packets of all channels."""
    here, there = pair(EMITTER, RECEIVER)
    there.call("ear/enable", value=32)
    assert here.get("mouth/set_channel", value=emitter) is True
    assert there.get("ear/set_channel", value=receiver) is True
    here.call("mouth/send", value="hello")
    step(here, there)

    assert there.get("ear/get_queue_length") == int(arrives)
    assert here.get("mouth/get_channel") == emitter
    assert there.get("ear/get_channel") == receiver


def test_a_packet_does_not_reach_beyond_the_range(pair):
    """A range above `maxRange` is limited, and -1 means `maxRange`. Other negative values are ignored."""
    here, there = pair(EMITTER, RECEIVER, 3.0)
    there.call("ear/enable", value=32)
    for range_m in (2.0, 4.0, 6.0):
        assert here.get("mouth/set_range", value=range_m) is True
        here.call("mouth/send", value="hello")
        step(here, there)

    assert here.get("mouth/get_range") == 5.0
    assert there.get("ear/get_queue_length") == 2
    for range_m, set_m in ((1.0, 1.0), (-2.0, 1.0), (-1.0, 5.0)):
        assert here.get("mouth/set_range", value=range_m) is True
        assert here.get("mouth/get_range") == set_m


def test_a_receiver_that_is_not_enabled_hears_nothing(pair):
    """A receiver drops its packets when a client disables it."""
    here, there = pair(EMITTER, RECEIVER)
    here.call("mouth/send", value="early")
    step(here, there)
    there.call("ear/enable", value=32)
    here.call("mouth/send", value="now")
    step(here, there)
    assert there.get("ear/get_queue_length") == 1

    there.call("ear/enable", value=0)
    assert there.get("ear/get_queue_length") == 0


def test_a_full_buffer_takes_no_more(pair):
    """The buffer has 10 bytes. As in Webots, a send to a full buffer still succeeds."""
    here, there = pair(EMITTER, RECEIVER)
    there.call("ear/enable", value=32)
    for text in ("0123456", "789a", "bcd"):
        assert here.get("mouth/send", value=text) is True
    step(here, there)

    assert here.get("mouth/get_buffer_size") == 10
    assert there.get("ear/get_queue_length") == 2


@pytest.mark.parametrize(
    ("there", "presence"),
    [
        ('Connector { name "plug" model "a" rotation 0 0 1 3.14159 }', 1),
        ('Connector { name "plug" model "b" rotation 0 0 1 3.14159 }', 0),
        ('Connector { name "plug" model "a" type "passive" rotation 0 0 1 3.14159 }', 0),
        ('Connector { name "plug" model "a" }', 0),
    ],
)
def test_a_connector_feels_a_fitting_one_that_faces_it(pair, there, presence):
    """The other connector has the same model and type, is near, and faces along the same axis."""
    here, _ = pair('Connector { name "socket" model "a" }', there, 0.005)
    felt = here.inbox("socket/presence")
    assert here.get("socket/presence_sensor/enable", value=32) is True
    step(here)

    assert felt == [presence]
    assert here.get("socket/presence_sensor/get_sampling_period") == 32


def test_a_passive_connector_has_no_sensor_and_every_one_can_be_locked(pair):
    """A lock without another connector joins nothing, so the stub can accept it."""
    here, _ = pair('Connector { name "socket" type "passive" }', "")
    felt = here.inbox("socket/presence")
    here.call("socket/presence_sensor/enable", value=32)
    step(here)

    assert felt == [-1]
    assert here.get("socket/is_locked") is False
    assert here.get("socket/lock", value=True) is True
    assert here.get("socket/is_locked") is True


def test_a_speaker_loops_a_sound_until_it_is_stopped(pair):
    """The stub plays no sound, so a sound that does not loop ends at once."""
    here, _ = pair('Speaker { name "horn" }', "")
    play = {"volume": 1.0, "pitch": 1.0, "balance": 0.0}
    for sound, loop in (("a.wav", False), ("b.wav", True), ("c.wav", True)):
        assert here.get("horn/play_sound", sound=sound, loop=loop, **play) == 1
    playing = [here.get("horn/is_sound_playing", sound=sound) for sound in ("a.wav", "b.wav", "")]
    assert playing == [False, True, True]

    assert here.get("horn/stop", value="b.wav") is True
    assert here.get("horn/is_sound_playing", sound="b.wav") is False
    assert here.get("horn/stop", value="") is True
    assert here.get("horn/is_sound_playing", sound="") is False


def test_a_speaker_knows_the_languages_of_its_engine(pair):
    """Each engine has its own languages, and a client must see that its language is missing."""
    here, _ = pair('Speaker { name "horn" }', "")

    assert here.get("horn/get_engine") == "pico"
    assert here.get("horn/set_language", value="ja-JP") is False
    assert here.get("horn/set_engine", value="microsoft") is True
    assert here.get("horn/set_language", value="ja-JP") is True
    assert here.get("horn/get_language") == "ja-JP"
    assert here.get("horn/set_engine", value="gramophone") is False
    assert here.get("horn/speak", text="hello", volume=1.0) == 1
    assert here.get("horn/is_speaking") is False


def test_a_pen_takes_its_ink(pair):
    """The stub draws no strokes, but the services respond as in Webots."""
    here, _ = pair('Pen { name "pen" }', "")

    assert here.get("pen/write", value=False) is True
    assert here.get("pen/set_ink_color", color=0xFF0000, density=0.7) == 1


def test_a_gripper_that_nothing_can_touch_holds_nothing(pair):
    """In Webots, a gripper without a boundingObject cannot hold an object."""
    here, _ = pair('VacuumGripper { name "cup" }', "")
    felt = here.inbox("cup/presence")
    assert here.get("cup/presence_sensor/enable", value=32) is True
    assert here.get("cup/turn_on", value=True) is True
    step(here)

    assert felt == [False]
    assert here.get("cup/is_on") is True
    assert here.get("cup/turn_on", value=False) is True
    assert here.get("cup/is_on") is False
    with pytest.raises(KeyError):
        here.call("cup/enable", value=32)


def test_a_gripper_that_would_hold_something_is_not_switched_on(pair):
    """If the call succeeded, the client would believe that the gripper holds the object."""
    here, _ = pair('VacuumGripper { name "cup" boundingObject Box { size 0.1 0.1 0.1 } }', "")

    with pytest.raises(ServiceFailed, match="cup has a boundingObject"):
        here.call("cup/turn_on", value=True)
    assert here.get("cup/is_on") is False


def test_connectors_that_fit_are_not_locked(pair):
    """In Webots the lock would join the two robots, and the stub cannot simulate joined robots."""
    other = 'Connector { name "plug" model "a" rotation 0 0 1 3.14159 }'
    here, _ = pair('Connector { name "socket" model "a" }', other, 0.005)

    with pytest.raises(ServiceFailed, match="joining them is not simulated"):
        here.call("socket/lock", value=True)
    assert here.get("socket/is_locked") is False
