"""Simulated time passes only inside `with webots:` and `webots.run(...)`."""

import pytest

from palaestra_trainer.errors import Paused, SimulatorFault, WrongData
from palaestra_trainer.robots import Pose
from palaestra_trainer.webots import Mode


def test_a_step_while_paused_is_refused_and_the_next_context_goes_on(arena):
    """If the step were accepted, the controller would block until time passes, and could not be resumed."""
    with arena.webots:
        arena.robot.advance()
    pid, before = arena.pid, arena.webots.observer.time()

    with pytest.raises(Paused, match="robotino is paused; step inside `with webots:`"):
        arena.robot.advance()

    with arena.webots:
        assert arena.robot.advance() == 0
    assert arena.webots.observer.time() == pytest.approx(before + 0.192)
    assert arena.pid == pid


def test_a_reset_while_paused_is_refused_before_it_has_begun(arena):
    """If the reset began, half of it would take effect in the next step of any client."""
    with arena.webots:
        arena.scene.reset(1, Pose(-1.0, 0.0, 0.0), (1.0, 0.0))

    with pytest.raises(Paused):
        arena.scene.reset(2, Pose(0.0, 1.0, 0.0), (1.0, 0.0))

    with arena.webots:
        arena.robot.advance()
    assert arena.robot.pose().x_m == pytest.approx(-1.0)


def test_a_step_while_paused_is_no_fault_of_the_simulator():
    """A fault would make training restart a working simulator repeatedly."""
    assert not issubclass(Paused, SimulatorFault)


def test_a_simulator_that_did_not_confirm_its_mode_is_not_taken_for_paused(start):
    """The next step shows whether the simulator runs. If that step fails, the simulator has a fault."""
    arena = start("--fault=wrong_shape:service=supervisor/simulation_set_mode,call=4")
    arena.webots.supervisor.set_mode(Mode.PAUSE)
    with pytest.raises(WrongData):
        arena.webots.supervisor.set_mode(Mode.FAST)

    assert arena.robot.advance() == 0


def test_only_the_outermost_context_pauses(arena):
    """The paper calls `run` inside a `with` block, to collect and to evaluate."""
    with arena.webots:
        with arena.webots:
            arena.robot.advance()
        arena.webots.run(arena.robot.advance)
        inside = arena.webots.observer.mode()
        arena.robot.advance()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_after_a_context_that_broke_the_outermost_one_pauses_still(arena):
    """An exception in a notebook's cell must not leave the simulator running."""
    with arena.webots:
        with pytest.raises(ZeroDivisionError):
            arena.webots.run(lambda: 1 / 0)
        inside = arena.webots.observer.mode()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_a_simulator_that_was_started_stands_until_it_is_let_go(arena):
    """A started stub would run and a started Webots would not, so both are paused.

    Code that works with the stub must work with Webots too.
    """
    arena.webots()

    mode = arena.webots.observer.mode()

    assert mode is Mode.PAUSE
    with pytest.raises(Paused):
        arena.robot.advance()


def test_a_simulator_that_is_restarted_inside_of_a_context_runs(arena):
    """A restart in a `with` block must not leave the simulator paused for the rest of the block."""
    with arena.webots:
        arena.webots()
        inside = arena.webots.observer.mode()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_a_simulator_that_is_stopped_inside_of_a_context_need_not_be_paused(arena):
    """A stopped simulator cannot be paused, so the end of the block must not fail."""
    with arena.webots:
        arena.webots.stop()
    with arena.webots:
        arena.robot.advance()

    assert arena.webots.observer.mode() is Mode.PAUSE


def test_a_refused_mode_raises_an_error(arena):
    """Until Webots R2020b, 3 was the number of the mode FAST.

    A client that still uses this number would otherwise wait forever.
    """
    with pytest.raises(WrongData, match="robotino: refuses mode 3"):
        arena.webots.supervisor.set_mode(3)
