"""Time passes only inside `with webots:` and `webots.run(...)`."""

import pytest

from palaestra_trainer.errors import Paused, SimulatorFault, WrongData
from palaestra_trainer.robots import Pose
from palaestra_trainer.webots import Mode


def test_a_step_while_paused_is_refused_and_the_next_context_goes_on(arena):
    """The controller would wait for time to pass, and could not be resumed during that wait."""
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
    """Otherwise the next step of any client would carry out half a reset."""
    with arena.webots:
        arena.scene.reset(1, Pose(-1.0, 0.0, 0.0), (1.0, 0.0))

    with pytest.raises(Paused):
        arena.scene.reset(2, Pose(0.0, 1.0, 0.0), (1.0, 0.0))

    with arena.webots:
        arena.robot.advance()
    assert arena.robot.pose().x_m == pytest.approx(-1.0)


def test_a_step_while_paused_is_no_fault_of_the_simulator():
    """Otherwise training would restart a working simulator again and again."""
    assert not issubclass(Paused, SimulatorFault)


def test_a_simulator_that_did_not_confirm_its_mode_is_not_taken_for_paused(start):
    """The next step shows whether it runs, and its failure is a fault, no error of the caller."""
    arena = start("--fault=wrong_shape:service=supervisor/simulation_set_mode,call=4")
    arena.webots.supervisor.set_mode(Mode.PAUSE)
    with pytest.raises(WrongData):
        arena.webots.supervisor.set_mode(Mode.FAST)

    assert arena.robot.advance() == 0


def test_only_the_outermost_context_pauses(arena):
    """The paper has `run` inside a `with`, for collection and for evaluation."""
    with arena.webots:
        with arena.webots:
            arena.robot.advance()
        arena.webots.run(arena.robot.advance)
        inside = arena.webots.observer.mode()
        arena.robot.advance()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_after_a_context_that_broke_the_outermost_one_pauses_still(arena):
    """An exception in a notebook's cell must not leave a simulator running."""
    with arena.webots:
        with pytest.raises(ZeroDivisionError):
            arena.webots.run(lambda: 1 / 0)
        inside = arena.webots.observer.mode()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_a_simulator_that_was_started_stands_until_it_is_let_go(arena):
    """Without the pause the stub would run and Webots would not.

    Code for one must work with the other.
    """
    arena.webots()

    mode = arena.webots.observer.mode()

    assert mode is Mode.PAUSE
    with pytest.raises(Paused):
        arena.robot.advance()


def test_a_simulator_that_is_restarted_inside_of_a_context_runs(arena):
    """A restart does not end the context."""
    with arena.webots:
        arena.webots()
        inside = arena.webots.observer.mode()

    assert (inside, arena.webots.observer.mode()) == (Mode.FAST, Mode.PAUSE)


def test_a_simulator_that_is_stopped_inside_of_a_context_need_not_be_paused(arena):
    """A stopped simulator cannot be paused; the next context starts it."""
    with arena.webots:
        arena.webots.stop()
    with arena.webots:
        arena.robot.advance()

    assert arena.webots.observer.mode() is Mode.PAUSE


def test_a_refused_mode_raises_an_error(arena):
    """The number 3 was FAST until Webots R2020b.

    A client that still uses it would wait for ever.
    """
    with pytest.raises(WrongData, match="robotino: refuses mode 3"):
        arena.webots.supervisor.set_mode(3)
