"""Sensors over ROS: the rules of `enable`, and the times and contents of messages."""

import pytest

from palaestra_sim.scene.mode import Mode


def test_enable_takes_multiples_of_the_basic_step_before_the_first_step(robot):
    """A sensor cannot measure between two steps, so for any other period the call returns false."""
    assert robot.get("ir1/enable", value=31) is False
    assert robot.get("ir1/get_sampling_period") == 0

    assert robot.get("ir1/enable", value=64) is True
    assert robot.get("ir1/get_sampling_period") == 64


def test_enable_takes_multiples_of_the_last_step_afterwards(robot):
    """After a step of 192 ms, a period of 32 ms is not a multiple of the step any more."""
    robot.call("robot/time_step", value=192)

    assert robot.get("ir1/enable", value=32) is False
    assert robot.get("ir1/enable", value=384) is True


def test_a_refused_step_does_not_change_what_enable_takes(robot):
    """Only a step that was accepted changes the accepted periods."""
    robot.call("robot/time_step", value=33)

    assert robot.get("ir1/enable", value=32) is True


def test_negative_multiples_pass_as_in_webots(robot):
    """As in the real controller, the remainder of -32 / 32 is 0, so the client itself must check the sign."""
    assert robot.get("ir1/enable", value=-32) is True
    assert robot.get("ir1/get_sampling_period") == -32


def test_the_same_period_again_changes_nothing(robot):
    """With a second publisher, each message would arrive twice."""
    robot.call("ir1/enable", value=32)

    assert robot.get("ir1/enable", value=32) is True
    assert len(robot.publishers("ir1/value")) == 1


def test_another_period_adds_a_second_publisher(robot):
    """Both publishers send messages, so a client must disable the sensor before it changes the period."""
    robot.call("ir1/enable", value=64)
    robot.call("ir1/enable", value=32)
    inbox = robot.inbox("ir1/value")

    for _ in range(2):
        robot.call("robot/time_step", value=32)

    assert len(robot.publishers("ir1/value")) == 2
    assert len(inbox) == 3
    assert robot.get("ir1/get_sampling_period") == 32


def test_enable_0_takes_all_publishers_back(robot):
    """A client calls `enable(0)` and then `enable(p)` to change the period."""
    robot.call("ir1/enable", value=64)
    robot.call("ir1/enable", value=32)

    assert robot.get("ir1/enable", value=0) is True
    assert robot.publishers("ir1/value") == []
    assert robot.get("ir1/get_sampling_period") == 0


def test_no_message_comes_before_the_next_step(robot, ros):
    """The controller's loop sleeps until a step has increased the count."""
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=32)
    ros.advance(60)
    assert inbox == []

    robot.call("robot/time_step", value=32)

    assert len(inbox) == 1


def test_each_due_sensor_sends_one_message_a_step(robot):
    """The trainer's facade assigns messages to steps by this rule."""
    paths = [f"ir{i}/value" for i in range(1, 10)] + ["touch_sensor/value", "wheel0_joint_sensor/value"]
    inboxes = [robot.inbox(path) for path in paths]
    for path in paths:
        robot.call(path.replace("value", "enable"), value=192)

    for _ in range(5):
        robot.call("robot/time_step", value=192)

    assert [len(inbox) for inbox in inboxes] == [5] * len(paths)


def test_a_period_of_three_steps_sends_every_third_time(robot):
    """A sensor is due if the count of steps times the step is a multiple of its period."""
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=96)
    sizes = []

    for _ in range(6):
        robot.call("robot/time_step", value=32)
        sizes.append(len(inbox))

    assert sizes == [0, 0, 1, 1, 1, 2]


def test_the_phase_is_a_product_not_a_sum(robot):
    """Two steps of 32 ms and one of 64 ms count as 3 * 64 = 192 ms for the controller, not as 128 ms."""
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=192)
    for _ in range(2):
        robot.call("robot/time_step", value=32)

    robot.call("robot/time_step", value=64)

    assert len(inbox) == 1


def test_a_step_of_0_sets_the_count_back(robot):
    """When the count is 0, each enabled sensor is due."""
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=3200)
    robot.call("robot/time_step", value=32)
    assert inbox == []

    robot.call("robot/time_step", value=0)

    assert len(inbox) == 1


def test_messages_come_after_the_answer(ros, start):
    """By default the messages follow the response at once; `publish_delay_s` delays them."""
    start(publish_delay_s=0.002)
    robot = ros.node("robotino")
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=32)

    assert robot.get("robot/time_step", value=32) is True
    assert inbox == []
    ros.advance(0.002)

    assert len(inbox) == 1


def test_an_impatient_client_gets_every_message_without_the_fault(ros, start):
    """The client steps again before the messages arrive, and still gets the messages of all three steps."""
    start(publish_delay_s=0.002)
    robot = ros.node("robotino")
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=32)

    for _ in range(3):
        robot.call("robot/time_step", value=32)
    ros.advance(0.002)

    assert len(inbox) == 3


def test_an_impatient_client_loses_messages_with_the_fault(ros, start):
    """With `lost_wakeup`, the second step comes while the loop handles the first.

    The messages of the second step never come.
    """
    start(publish_delay_s=0.002, lost_wakeup=True)
    robot = ros.node("robotino")
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=32)

    for _ in range(2):
        assert robot.get("robot/time_step", value=32) is True
    ros.advance(1)

    assert len(inbox) == 1


def test_a_client_that_waits_for_the_message_can_lose_the_next_one(ros, start):
    """The loop sends messages before it stores the count. A message does not prove that the loop is ready."""
    start(publish_delay_s=0.002, lost_wakeup=True)
    robot = ros.node("robotino")
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=32)
    robot.call("robot/time_step", value=32)
    ros.advance(0.002)
    assert len(inbox) == 1

    robot.call("robot/time_step", value=32)
    ros.advance(1)
    assert len(inbox) == 1
    robot.call("robot/time_step", value=32)
    ros.advance(1)

    assert len(inbox) == 2


def test_a_distance_sensor_sends_its_constants_with_every_value(robot):
    """min_range and max_range are volts from the second column of the lookup table."""
    robot.call("ir2/enable", value=32)

    (publisher,) = robot.publishers("ir2/value")

    assert publisher.type_name == "sensor_msgs/Range"
    assert publisher.template == {
        "header": {"frame_id": "robotino/ir2"},
        "radiation_type": 0,
        "field_of_view": 1.5708,
        "min_range": 0.31,
        "max_range": 3.03,
    }


def test_an_infra_red_sensor_says_so(ros, start, world, simple_robot):
    """`radiation_type` is 1 only for a sensor of type "infra-red"."""
    start(world(robot=simple_robot.replace('name "ir1"', 'name "ir1" type "infra-red"')))
    robot = ros.node("robotino")
    robot.call("ir1/enable", value=32)

    (publisher,) = robot.publishers("ir1/value")

    assert publisher.template["radiation_type"] == 1
    assert robot.get("ir1/get_type") == 1


def test_a_bumper_sends_booleans_and_a_position_sensor_numbers(robot):
    """The table of topics has a message type for each type of sensor."""
    types = {}
    for device in ("touch_sensor", "wheel0_joint_sensor", "battery_sensor", "keyboard"):
        robot.call(f"{device}/enable", value=32)
    for topic in ("touch_sensor/value", "wheel0_joint_sensor/value", "battery_sensor/value", "keyboard/key"):
        types[topic] = robot.publishers(topic)[0].type_name

    assert types == {
        "touch_sensor/value": "webots_ros/BoolStamped",
        "wheel0_joint_sensor/value": "webots_ros/Float64Stamped",
        "battery_sensor/value": "webots_ros/Float64Stamped",
        "keyboard/key": "webots_ros/Int32Stamped",
    }


def test_pseudo_devices_can_be_enabled_and_have_nothing_to_tell(robot):
    """Each robot has a battery sensor, a keyboard and a joystick, even if none is connected."""
    keys = robot.inbox("keyboard/key")

    for device in ("battery_sensor", "keyboard", "joystick"):
        assert robot.get(f"{device}/enable", value=64) is True
        assert robot.get(f"{device}/get_sampling_period") == 64
        robot.call("robot/time_step", value=32)
        assert robot.get(f"{device}/enable", value=0) is True

    assert keys == []


def test_a_distance_sensor_tells_its_table(robot):
    """The trainer's facade needs the table to convert volts to meters."""
    table = robot.get("ir1/get_lookup_table")

    assert list(table[:6]) == [0.03, 3.03, 0.005, 0.035, 2.78, 0.005]
    assert len(table) == 3 * 18
    assert robot.get("ir1/get_min_value") == 0.31
    assert robot.get("ir1/get_max_value") == 3.03
    assert robot.get("ir1/get_aperture") == 1.5708
    assert robot.get("ir1/get_type") == 0


def test_devices_tell_their_names_and_kinds(robot):
    """The type of a node is a number of webots/nodes.h."""
    assert robot.get("touch_sensor/get_name") == "touch sensor"
    assert robot.get("touch_sensor/get_type") == 0
    assert robot.get("touch_sensor/get_node_type") == 60
    assert robot.get("ir1/get_node_type") == 42
    assert robot.get("wheel0_joint/get_node_type") == 57
    assert robot.get("wheel0_joint_sensor/get_node_type") == 52


def test_the_clock_tells_simulated_time(robot):
    """A controller with the argument `--clock` publishes whole milliseconds after each step."""
    inbox = robot.inbox("/clock")

    for _ in range(40):
        robot.call("robot/time_step", value=32)

    assert inbox[0] == {"clock": {"secs": 0, "nsecs": 32_000_000}}
    assert inbox[-1] == {"clock": {"secs": 1, "nsecs": 280_000_000}}


@pytest.mark.usefixtures("two_robots")
def test_only_a_robot_with_the_argument_publishes_the_clock(ros):
    """A ROS master may have only one publisher of the clock."""
    assert len(ros.topic("/clock").publishers) == 1


def test_auto_publish_enables_every_sensor(ros, start, world, simple_robot):
    """The sampling period is the basic step."""
    start(world(robot=simple_robot.replace('"--synchronize"', '"--synchronize" "--auto-publish"')))
    robot = ros.node("robotino")

    periods = [
        robot.get(f"{name}/get_sampling_period") for name in ("ir1", "touch_sensor", "wheel2_joint_sensor")
    ]

    assert periods == [32, 32, 32]


def test_enabling_is_possible_in_pause(ros, start):
    """The trainer's facade enables sensors of a simulator that was started with --mode=pause."""
    start(mode=Mode.PAUSE)

    assert ros.node("robotino").get("ir1/enable", value=192) is True
