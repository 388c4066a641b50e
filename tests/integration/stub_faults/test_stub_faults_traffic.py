"""The responses and messages that a client gets from a stub with faults."""

import math
import select
import threading
import xmlrpc.client

import pytest

from palaestra_trainer.errors import SimulatorHung, WrongData
from palaestra_trainer.ros import RosService, RosSubscriber
from tests.integration.stub_faults.conftest import DEADLINE_S
from tests.waiting import eventually

PERIOD_MS = 192
SLOW_MS = 3000  # so long that all other requests are faster


@pytest.fixture
def connected(player):
    """Yield `connected("slow:...")`, which returns a started `Player` and a function for its services."""
    services = []

    def make(*faults):
        played = player(*faults)
        played.start()

        def service(path, type_name="get_float", deadline_s=5.0):
            services.append(RosService(f"/robotino/{path}", f"webots_ros/{type_name}", deadline_s))
            return services[-1]

        return played, service

    yield make
    for each in services:
        each.close()


def test_everything_else_waits_behind_a_slow_step(connected):
    """Webots holds a mutex during a step, so all clients wait for a slow step."""
    _, service = connected("slow:latency_ms=300,step=1")
    step, get_time = service("robot/time_step", "set_int"), service("robot/get_time")
    get_time(ask=True)
    step.begin(value=PERIOD_MS)

    time_s = get_time(ask=True).value

    assert time_s == pytest.approx(PERIOD_MS / 1000)
    assert step.finish().success


def test_only_its_own_client_waits_for_a_slow_service(connected):
    """A slow service must not delay the controller."""
    _, service = connected(f"slow:service=robot/get_model,latency_ms={SLOW_MS}")
    get_model, get_time = service("robot/get_model", "get_string", DEADLINE_S), service("robot/get_time")
    get_time(ask=True)
    get_model.begin(ask=True)

    assert get_time(ask=True).value == 0.0
    assert select.select([get_model], [], [], 0) == ([], [], [])
    get_model.finish()


def test_a_service_that_hangs_leaves_the_others_alone(connected):
    """A second connection to this service must hang too, and other services must respond."""
    played, service = connected("hang:service=robot/get_model")
    for _ in range(2):
        with pytest.raises(SimulatorHung):
            service("robot/get_model", "get_string", deadline_s=0.2)(ask=True)

    played.step()
    assert service("robot/get_time")(ask=True).value == pytest.approx(PERIOD_MS / 1000)


def test_one_call_can_go_wrong(connected):
    """Only the second call has the fault, so a test can choose the call."""
    _, service = connected("wrong_value:service=robot/get_basic_time_step,call=2,value=inf")
    ask = service("robot/get_basic_time_step")

    assert [ask(ask=True).value for _ in range(3)] == [32.0, math.inf, 32.0]


def test_numbers_inside_of_an_answer_go_wrong_too(connected):
    """The numbers of a position are one level deeper in the response."""
    _, service = connected("wrong_value:service=supervisor/node/get_position,value=-inf")
    node = service("supervisor/get_from_def", "supervisor_get_from_def")(name="ROBOTINO").node

    position = service("supervisor/node/get_position", "node_get_position")(node=node).position

    assert (position.x, position.y, position.z) == (-math.inf,) * 3


def test_an_answer_cut_short_cannot_be_read(connected):
    """The frame is complete, so the client can read the next response."""
    _, service = connected("wrong_shape:service=robot/get_basic_time_step,call=1")
    ask = service("robot/get_basic_time_step")

    with pytest.raises(WrongData, match="4 bytes instead of 8"):
        ask(ask=True)
    assert ask(ask=True).value == 32.0


def test_a_message_cut_short_cannot_be_read(connected):
    """A reader that decodes only the last bytes of a message must also check the length."""
    _, service = connected("wrong_shape:topic=ir1/value,step=1")
    subscriber = RosSubscriber("/robotino/ir1/value", "sensor_msgs/Range")
    subscriber.connect()
    step = service("robot/time_step", "set_int")

    step(value=PERIOD_MS)
    with pytest.raises(WrongData):
        subscriber.next()
    step(value=PERIOD_MS)
    assert subscriber.next().range > 0.0
    subscriber.close()


def test_late_messages_come_after_newer_ones(connected):
    """The author of a client must be able to test it with messages in another order than the steps."""
    _, service = connected(f"late:topic=ir1/value,latency_ms={SLOW_MS},step=1")
    subscriber = RosSubscriber("/robotino/ir1/value", "sensor_msgs/Range", deadline_s=DEADLINE_S)
    subscriber.connect()
    step = service("robot/time_step", "set_int")
    for _ in range(2):
        step(value=PERIOD_MS)

    sequence = [subscriber.next().header.seq for _ in range(2)]

    assert sequence == [2, 1]
    subscriber.close()


def test_messages_of_other_sensors_are_left_alone(connected):
    """A star selects several topics: here all distances, but not the bumper."""
    _, service = connected("lost:topic=ir*/value")
    silent = RosSubscriber("/robotino/ir1/value", "sensor_msgs/Range", deadline_s=0.2)
    heard = RosSubscriber("/robotino/touch_sensor/value", "webots_ros/BoolStamped")
    for subscriber in (silent, heard):
        subscriber.connect()

    service("robot/time_step", "set_int")(value=PERIOD_MS)

    assert heard.next().data is False
    with pytest.raises(SimulatorHung):
        silent.next()
    for subscriber in (silent, heard):
        subscriber.close()


def test_a_client_that_gave_up_a_slow_step_does_not_block_the_next(connected):
    """The stub must drop the step of the client that left, and serve the next client."""
    _, service = connected("slow:latency_ms=500,step=1")
    impatient = service("robot/time_step", "set_int", deadline_s=0.1)
    with pytest.raises(SimulatorHung):
        impatient(value=PERIOD_MS)

    assert service("robot/time_step", "set_int")(value=PERIOD_MS).success
    assert service("robot/get_time")(ask=True).value == pytest.approx(PERIOD_MS / 1000)


def test_two_clients_are_served_after_a_slow_step(connected):
    """Each waiting client must get its response after the step."""
    _, service = connected("slow:latency_ms=300,step=1")
    step = service("robot/time_step", "set_int")
    answers = []
    clients = [service("robot/get_time") for _ in range(2)]
    for client in clients:
        client(ask=True)
    step.begin(value=PERIOD_MS)
    waiting = [threading.Thread(target=lambda it=it: answers.append(it(ask=True).value)) for it in clients]
    for thread in waiting:
        thread.start()
    for thread in waiting:
        thread.join(5)

    assert answers == [pytest.approx(PERIOD_MS / 1000)] * 2
    assert step.finish().success


def test_a_subscriber_that_has_gone_is_listed_no_more(connected, master):
    """`rosnode info` must not list the subscribers that have disconnected."""
    connected("lost:topic=ir1/value,every=20")
    with xmlrpc.client.ServerProxy(master) as names:
        node = xmlrpc.client.ServerProxy(names.lookupNode("/test", "/robotino")[2])
    with node:
        before = node.getBusInfo("/test")[2]
        subscriber = RosSubscriber("/robotino/ir1/value", "sensor_msgs/Range")
        subscriber.connect()
        eventually(lambda: len(node.getBusInfo("/test")[2]) == len(before) + 1)
        subscriber.close()

        eventually(lambda: node.getBusInfo("/test")[2] == before)
