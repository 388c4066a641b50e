"""`time_step`: the accepted values, the time of the response, and the synchronization of controllers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.stepping import Stepping
from palaestra_sim.world import builtin
from tests.scenes import load_scene

PENDING = "pending"


def outcome(node, number):
    """Return whether a request succeeded, or PENDING before its response."""
    answer = node.answers.get(number)
    return PENDING if answer is None else answer.success


@pytest.mark.parametrize("step_ms", [32, 64, 192, 3200])
def test_a_multiple_of_the_basic_step_is_simulated(robot, step_ms):
    """One control period of a policy may consist of several basic steps."""
    assert robot.get("robot/time_step", value=step_ms) is True
    assert robot.get("robot/get_time") == pytest.approx(step_ms / 1000)


@pytest.mark.parametrize("step_ms", [1, 31, 33, 100, -1, -32, -192])
def test_any_other_step_is_refused_and_changes_nothing(robot, step_ms):
    """A client must see from the response that its step was refused, because the time does not advance."""
    assert robot.get("robot/time_step", value=step_ms) is False
    assert robot.get("robot/get_time") == 0.0


def test_a_step_of_0_is_one_basic_step(robot):
    """In Webots, a client that leaves sends a step of 0."""
    robot.call("robot/time_step", value=192)

    assert robot.get("robot/time_step", value=0) is True
    assert robot.get("robot/get_time") == pytest.approx(0.224)


def test_a_step_in_pause_is_not_answered(ros, start):
    """Webots holds the mutex of the controller until the step is done."""
    start(mode=Mode.PAUSE)
    robot = ros.node("robotino")

    number = robot.ask("robot/time_step", value=32)
    ros.advance(60)

    assert outcome(robot, number) == PENDING
    assert robot.blocked()


def test_every_other_service_waits_behind_a_pending_step(ros, start):
    """A client that steps while paused, and then sets the run mode at the same controller, is deadlocked."""
    start(mode=Mode.PAUSE)
    robot = ros.node("robotino")
    robot.ask("robot/time_step", value=32)

    set_mode = robot.ask("supervisor/simulation_set_mode", value=Mode.FAST)
    get_time = robot.ask("robot/get_time")
    ros.advance(60)

    assert set_mode not in robot.answers
    assert get_time not in robot.answers


def test_another_supervisor_ends_the_deadlock(ros, start):
    """The pending step is done first, and then the waiting calls get their responses in order."""
    start(builtin("two_robots"), mode=Mode.PAUSE)
    supervisor, robotino = ros.node("supervisor"), ros.node("robotino")
    step = robotino.ask("robot/time_step", value=32)
    time = robotino.ask("robot/get_time")

    supervisor.call("supervisor/simulation_set_mode", value=Mode.FAST)
    assert outcome(robotino, step) == PENDING
    supervisor.call("robot/time_step", value=32)

    assert outcome(robotino, step) is True
    assert robotino.answers[time].value == pytest.approx(0.032)


def test_the_world_waits_until_all_synchronised_robots_asked(two_robots, ros):
    """The world moves when each robot has requested a step.

    Then each robot gets the response to its step.
    """
    supervisor, robotino = two_robots

    first = supervisor.ask("robot/time_step", value=192)
    ros.advance(60)
    assert outcome(supervisor, first) == PENDING
    second = robotino.ask("robot/time_step", value=192)
    ros.advance(0)

    assert outcome(supervisor, first) is True
    assert outcome(robotino, second) is True
    assert supervisor.get("robot/get_time") == pytest.approx(0.192)


def test_steps_of_different_length_are_served_piece_by_piece(two_robots):
    """Robots may have different control periods: one makes six short steps during the other's long step."""
    supervisor, robotino = two_robots
    long = supervisor.ask("robot/time_step", value=192)

    for _ in range(5):
        assert robotino.get("robot/time_step", value=32) is True
    assert outcome(supervisor, long) == PENDING
    robotino.call("robot/time_step", value=32)

    assert outcome(supervisor, long) is True
    assert robotino.get("robot/get_time") == pytest.approx(0.192)


def test_a_robot_with_synchronization_false_holds_nobody(ros, start):
    """The step of such a robot ends when another robot has moved the world."""
    world = builtin("two_robots").replace(b'name "supervisor"', b'name "supervisor" synchronization FALSE', 1)
    start(world)
    supervisor, robotino = ros.node("supervisor"), ros.node("robotino")

    assert robotino.get("robot/time_step", value=32) is True
    pending = supervisor.ask("robot/time_step", value=32)
    ros.advance(60)
    assert outcome(supervisor, pending) == PENDING
    robotino.call("robot/time_step", value=32)

    assert outcome(supervisor, pending) is True
    assert supervisor.get("robot/get_synchronization") is False


def test_a_sleeping_stub_answers_after_its_sleep(ros, start):
    """The sleep imitates a world that takes long to simulate."""
    start(step_sleep_s=0.003)
    robot = ros.node("robotino")

    number = robot.ask("robot/time_step", value=192)
    ros.advance(0.0029)
    assert outcome(robot, number) == PENDING
    ros.advance(0.0002)

    assert outcome(robot, number) is True
    assert not robot.blocked()


def test_real_time_takes_as_long_as_it_says(ros, start):
    """A hundred steps of 32 ms take 3.2 s, however fast a client requests them."""
    start(mode=Mode.REAL_TIME)
    robot = ros.node("robotino")
    begun_s = ros.now_s

    for _ in range(100):
        number = robot.ask("robot/time_step", value=32)
        while number not in robot.answers:
            ros.advance(0.001)

    assert ros.now_s - begun_s == pytest.approx(3.2, abs=0.1)


def test_real_time_does_not_make_up_for_a_client_that_was_away(ros, start):
    """The first of ten basic steps is done at once, and the other nine take their time."""
    start(mode=Mode.REAL_TIME)
    robot = ros.node("robotino")
    robot.ask("robot/time_step", value=32)
    ros.advance(10)

    number = robot.ask("robot/time_step", value=320)
    ros.advance(0.287)
    assert outcome(robot, number) == PENDING
    ros.advance(0.002)

    assert outcome(robot, number) is True


@pytest.mark.parametrize(("mode", "known"), [(0, True), (1, True), (2, True), (3, False), (-1, False)])
def test_modes_are_those_since_r2021a(robot, mode, known):
    """The modes are PAUSE 0, REAL_TIME 1 and FAST 2. The former FAST, 3, is rejected."""
    assert robot.get("supervisor/simulation_set_mode", value=mode) is known
    assert robot.get("supervisor/simulation_get_mode") == (mode if known else Mode.FAST)


@given(
    orders=st.lists(st.tuples(st.integers(0, 1), st.sampled_from([32, 64, 96, 192])), min_size=1, max_size=30)
)
def test_no_robot_is_ever_ahead_of_another_by_more_than_it_asked_for(orders):
    """The time of the world is the smallest of the total times that the robots have requested."""
    simulation = load_scene(builtin("two_robots"))
    stepping = Stepping(simulation)
    for robot in simulation.robots:
        stepping.join(robot)
    asked = [0, 0]
    waiting = [False, False]

    for index, step_ms in orders:
        if not waiting[index]:
            asked[index] += step_ms
            waiting[index] = True
            stepping.ask(simulation.robots[index], step_ms, lambda _, i=index: waiting.__setitem__(i, False))

    assert simulation.time_ms == min(asked)
    assert waiting == [total > simulation.time_ms for total in asked]


class OtherSimulation:
    """A simulation of another simulator, which records calls."""

    def __init__(self):
        self.mode = Mode.FAST
        self.quit_status = None
        self.asked = []

    def advance(self, duration_ms):
        """Record the duration of a step."""
        self.asked.append(duration_ms)

    def sample(self):
        """Record that the sensors were sampled."""
        self.asked.append("sample")


def test_any_simulation_can_be_stepped():
    """All simulators share these controllers. A step advances the simulation, and then samples once."""
    simulation, answers = OtherSimulation(), []
    stepping = Stepping(simulation)

    stepping.ask(object(), 192, answers.append)

    assert simulation.asked == [192, "sample"]
    assert answers == [True]
