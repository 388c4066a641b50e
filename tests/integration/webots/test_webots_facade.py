"""The facade over a real simulator: on demand, controlled, and honest about what answers."""

import os
import signal

import pytest

from palaestra_trainer.errors import SimulatorDead, SimulatorHung
from palaestra_trainer.robots import Pose
from palaestra_trainer.webots import Mode


def test_a_started_simulator_is_available_until_it_is_stopped(own_arena):
    """Availability is a real round trip, not a memory of calls."""
    available = [own_arena.webots.available()]

    own_arena.webots.stop()

    assert [*available, own_arena.webots.available()] == [True, False]


def test_a_stop_is_no_fault(own_arena):
    """It was announced before the supervisor was asked to quit."""
    own_arena.webots.stop()

    state = own_arena.launcher.state()
    assert (state.faults, state.last_exit.expected, state.last_exit.code) == (0, True, 0)


def test_calling_the_facade_restarts_the_simulator(own_arena):
    """Another process answers under the same name."""
    before = own_arena.pid

    own_arena.webots()

    assert own_arena.webots.available()
    assert own_arena.pid != before


def test_inside_the_context_time_is_fast_and_outside_it_stands(own_arena):
    """A simulator takes a whole core between steps unless it is paused."""
    with own_arena.webots:
        inside = own_arena.webots.observer.mode()

    assert (inside, own_arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_run_returns_what_the_callback_returns(own_arena):
    """`run(callback)` and the context are two ways to say the same."""
    assert own_arena.webots.run(own_arena.webots.observer.mode) is Mode.FAST
    assert own_arena.webots.observer.mode() is Mode.PAUSE


def test_run_can_restart_before_the_callback(own_arena):
    """What the paper's training loop does after 24 resets."""
    before = own_arena.pid

    own_arena.webots.run(lambda: None, restart=True)

    assert own_arena.pid != before


def test_entering_starts_a_simulator_that_does_not_run(own_arena):
    """On demand: nobody has to call start()."""
    own_arena.webots.stop()

    with own_arena.webots:
        assert own_arena.webots.available()


def test_a_killed_simulator_is_dead_and_comes_back_with_the_same_objects(own_arena):
    """Robot, scene and environment are kept over restarts."""
    os.kill(own_arena.pid, signal.SIGKILL)
    with pytest.raises(SimulatorDead):
        own_arena.robot.advance()
    own_arena.launcher.wait_stopped(60.0)

    own_arena.webots()

    assert own_arena.webots.run(own_arena.robot.advance) == 0
    assert own_arena.launcher.state().faults == 1


def test_a_stopped_process_hangs_and_can_be_restarted(own_arena):
    """Its sockets are open, and the kernel even accepts new connections for it."""
    os.kill(own_arena.pid, signal.SIGSTOP)

    with pytest.raises(SimulatorHung):
        own_arena.robot.advance()

    assert not own_arena.webots.available()
    own_arena.webots()
    assert own_arena.webots.available()


def test_the_observer_changes_nothing(own_arena):
    """Time stands while it asks."""
    observer = own_arena.webots.observer
    before = observer.time()

    seen = (observer.basic_time_step_ms(), observer.exists("ROBOTINO"), observer.exists("NOBODY"))

    assert seen == (32, True, False)
    assert "touch sensor" in observer.devices()
    assert observer.world_path().endswith("arena.wbt")
    assert observer.time() == before


def test_a_reload_brings_the_world_back_with_new_handles(own_arena):
    """Old handles dangle; asked for again, they are looked up again."""
    own_arena.robot.drive(0.5, 0.0, 0.0)
    for _ in range(3):
        own_arena.robot.advance()
    moved = own_arena.robot.pose()

    own_arena.robot.close()
    own_arena.webots.supervisor.reload()
    own_arena.webots.wait_available()
    own_arena.robot.connect()

    assert moved.x_m > 0.1
    assert own_arena.robot.pose() == Pose(0.0, 0.0, 0.0)
