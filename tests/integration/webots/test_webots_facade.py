"""The facade of a real simulator starts it on demand, controls it, and reports its state."""

import os
import signal
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest

from palaestra_trainer.errors import SimulatorDead, SimulatorHung
from palaestra_trainer.robots import Pose
from palaestra_trainer.webots import Mode, Observer, facade

DEADLINE_S = 60.0


def test_a_started_simulator_is_available_until_it_is_stopped(own_arena):
    """`available` sends a request, so it reports the real state."""
    available = [own_arena.webots.available()]

    own_arena.webots.stop()

    assert [*available, own_arena.webots.available()] == [True, False]


def test_a_stop_is_no_fault(own_arena):
    """The sidecar must count the end of a simulator as a fault only if no client requested a stop."""
    own_arena.webots.stop()

    state = own_arena.launcher.state()
    assert (state.faults, state.last_exit.expected, state.last_exit.code) == (0, True, 0)


def test_calling_the_facade_restarts_the_simulator(own_arena):
    """A new process must respond under the same name."""
    before = own_arena.pid

    own_arena.webots()

    assert own_arena.webots.available()
    assert own_arena.pid != before


def test_inside_the_context_time_is_fast_and_outside_it_stands(own_arena):
    """A simulator that is not paused between steps uses a whole processor."""
    with own_arena.webots:
        inside = own_arena.webots.observer.mode()

    assert (inside, own_arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_run_returns_what_the_callback_returns(own_arena):
    """A program needs the result of its callback.

    Apart from that, `run(callback)` has the same effect as the `with` block.
    """
    assert own_arena.webots.run(own_arena.webots.observer.mode) is Mode.FAST
    assert own_arena.webots.observer.mode() is Mode.PAUSE


def test_run_can_restart_before_the_callback(own_arena):
    """The paper's training loop restarts its simulator after 24 resets."""
    before = own_arena.pid

    own_arena.webots.run(lambda: None, restart=True)

    assert own_arena.pid != before


def test_entering_starts_a_simulator_that_does_not_run(own_arena):
    """A user need not call `start`."""
    own_arena.webots.stop()

    with own_arena.webots:
        assert own_arena.webots.available()


def test_a_killed_simulator_is_dead_and_comes_back_with_the_same_objects(own_arena):
    """Robot, scene and environment of a program must survive a restart."""
    os.kill(own_arena.pid, signal.SIGKILL)
    with pytest.raises(SimulatorDead):
        own_arena.robot.advance()
    own_arena.launcher.wait_stopped(60.0)

    own_arena.webots()

    assert own_arena.webots.run(own_arena.robot.advance) == 0
    assert own_arena.launcher.state().faults == 1


def test_a_stopped_process_hangs_and_can_be_restarted(own_arena):
    """The sockets of a stopped process are open, and the kernel even accepts new connections."""
    os.kill(own_arena.pid, signal.SIGSTOP)

    with pytest.raises(SimulatorHung):
        own_arena.robot.advance()

    assert not own_arena.webots.available()
    own_arena.webots()
    assert own_arena.webots.available()


def test_the_observer_changes_nothing(own_arena):
    """A request of the observer must not advance the simulated time."""
    observer = own_arena.webots.observer
    before = observer.time()

    seen = (observer.basic_time_step_ms(), observer.exists("ROBOTINO"), observer.exists("NOBODY"))

    assert seen == (32, True, False)
    assert "touch sensor" in observer.devices()
    assert observer.world_path().endswith("arena.wbt")
    assert observer.time() == before


def test_a_reload_brings_the_world_back_with_new_handles(own_arena):
    """The old handles are invalid, so the facade must look them up again."""
    own_arena.robot.drive(0.5, 0.0, 0.0)
    for _ in range(3):
        own_arena.robot.advance()
    moved = own_arena.robot.pose()

    own_arena.robot.close()
    own_arena.webots.reload()
    own_arena.robot.connect()

    assert moved.x_m > 0.1
    assert own_arena.robot.pose() == Pose(0.0, 0.0, 0.0)


def test_a_start_waits_for_the_controllers_of_all_robots(own_arena, make, name):
    """In Webots, the supervisor's controller may respond before the controller of a robot has started."""
    webots = own_arena.webots
    webots.at_start("late", lambda: None, [name])

    def devices():
        webots.wait_available()
        with closing(Observer(name)) as observer:
            return observer.devices()

    with ThreadPoolExecutor() as pool:
        found = pool.submit(devices)
        make().start()

        assert "touch sensor" in found.result(DEADLINE_S)


def test_a_robot_without_a_controller_is_named(own_arena, monkeypatch):
    """A wrong name in the world is a mistake, so the error must come long before the deadline of a start."""
    monkeypatch.setattr(facade, "_CONTROLLERS_S", 0.5)
    own_arena.webots.at_start("absent", lambda: None, ["absent"])

    with pytest.raises(SimulatorDead, match="absent: no node serves /absent/robot/get_device_list"):
        own_arena.webots.wait_available()
