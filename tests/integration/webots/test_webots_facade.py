"""The facade over a real simulator: on demand, controlled, and honest about what answers."""

import os
import signal

import pytest

from palaestra_trainer.errors import SimulatorDead, SimulatorHung
from palaestra_trainer.robots import Pose
from palaestra_trainer.webots import Mode


def test_a_started_simulator_is_available_until_it_is_stopped(arena):
    """Availability is a real round trip, not a memory of calls."""
    available = [arena.webots.available()]

    arena.webots.stop()

    assert [*available, arena.webots.available()] == [True, False]


def test_a_stop_is_no_fault(arena):
    """It was announced before the supervisor was asked to quit."""
    arena.webots.stop()

    state = arena.launcher.state()
    assert (state.faults, state.last_exit.expected, state.last_exit.code) == (0, True, 0)


def test_calling_the_facade_restarts_the_simulator(arena):
    """Another process answers under the same name."""
    before = arena.pid

    arena.webots()

    assert arena.webots.available()
    assert arena.pid != before


def test_inside_the_context_time_is_fast_and_outside_it_stands(arena):
    """A simulator takes a whole core between steps unless it is paused."""
    with arena.webots:
        inside = arena.webots.observer.mode()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_run_returns_what_the_callback_returns(arena):
    """`run(callback)` and the context are two ways to say the same."""
    assert arena.webots.run(arena.webots.observer.mode) is Mode.FAST
    assert arena.webots.observer.mode() is Mode.PAUSE


def test_run_can_restart_before_the_callback(arena):
    """What the paper's training loop does after 24 resets."""
    before = arena.pid

    arena.webots.run(lambda: None, restart=True)

    assert arena.pid != before


def test_entering_starts_a_simulator_that_does_not_run(arena):
    """On demand: nobody has to call start()."""
    arena.webots.stop()

    with arena.webots:
        assert arena.webots.available()


def test_a_killed_simulator_is_dead_and_comes_back_with_the_same_objects(arena):
    """Robot, scene and environment are kept over restarts."""
    os.kill(arena.pid, signal.SIGKILL)
    with pytest.raises(SimulatorDead):
        arena.robot.advance()
    arena.launcher.wait_stopped(60.0)

    arena.webots()

    assert arena.webots.run(arena.robot.advance) == 0
    assert arena.launcher.state().faults == 1


def test_a_stopped_process_hangs_and_can_be_restarted(arena):
    """Its sockets are open, and the kernel even accepts new connections for it."""
    os.kill(arena.pid, signal.SIGSTOP)

    with pytest.raises(SimulatorHung):
        arena.robot.advance()

    assert not arena.webots.available()
    arena.webots()
    assert arena.webots.available()


def test_the_observer_changes_nothing(arena):
    """Time stands while it asks."""
    observer = arena.webots.observer
    before = observer.time()

    seen = (observer.basic_time_step_ms(), observer.exists("ROBOTINO"), observer.exists("NOBODY"))

    assert seen == (32, True, False)
    assert "touch sensor" in observer.devices()
    assert observer.world_path().endswith("arena.wbt")
    assert observer.time() == before


def test_a_reload_brings_the_world_back_with_new_handles(arena):
    """Old handles dangle; asked for again, they are looked up again."""
    arena.robot.drive(0.5, 0.0, 0.0)
    for _ in range(3):
        arena.robot.advance()
    moved = arena.robot.pose()

    arena.robot.close()
    arena.webots.supervisor.reload()
    arena.webots.wait_available()
    arena.robot.connect()

    assert moved.x_m > 0.1
    assert arena.robot.pose() == Pose(0.0, 0.0, 0.0)
