"""The screen of `palaestra watch`."""

import io

import pytest
from rich.console import Console

from palaestra.view import History, live
from palaestra.view.history import MOST
from tests.unit.view.jobs import NOW, running_job


@pytest.fixture
def draw():
    """Return the screen for a job and its earlier states, on a terminal of 80 columns."""

    def drawn(job, *before):
        history = History()
        for each in (*before, job):
            history.add(each.status)
        console = Console(file=io.StringIO(), width=80)
        console.print(live(job, history, NOW))
        return console.file.getvalue()

    return drawn


def test_a_line_rises_as_training_goes_on(draw):
    """The height of a bar is the success rate, from 0 to 1."""
    before = [running_job(step=step, successRate=rate) for step, rate in ((1000, 0.0), (2000, 0.5))]

    text = draw(running_job(step=3000, successRate=1.0), *before)

    assert "▁▅█" in text
    assert "100%" in text


def test_a_full_history_fits_into_a_terminal_of_80_columns(draw):
    """If the terminal cut off the newest bars, a person would see only old values."""
    before = [running_job(step=step, successRate=0.0) for step in range(MOST)]

    text = draw(running_job(step=MOST, successRate=1.0), *before)

    assert "▁" * (MOST - 1) + "█" in text
    assert all(len(line) <= 80 for line in text.splitlines())


def test_the_phase_its_reason_and_the_simulators_are_shown(draw):
    """A person sees the reason of the phase without another command."""
    text = draw(running_job())

    assert "job  Running" in text
    assert "Because: so it is" in text
    assert "Training: the trainer runs" in text
    assert "1/2, 3 restarts" in text


def test_a_job_that_nobody_has_seen_is_drawn(draw):
    """People run the command right after `kubectl apply`, before an operator has reconciled the job."""
    job = running_job(step=None, target=None, simulators=[], lastCheckpoint=None)
    unseen = job.model_copy(update={"status": type(job.status)()})

    assert "not reconciled by an operator yet" in draw(unseen)


def test_a_status_without_news_adds_nothing_to_the_history():
    """Only ages have changed since the last poll, so the history gets no new point."""
    history = History()
    history.add(running_job().status)
    history.add(running_job().status)

    assert len(history.of(0)) == 1


def test_the_history_forgets_what_no_line_has_room_for():
    """A command that runs for a week must not use more and more memory."""
    history = History()
    for step in range(MOST + 5):
        history.add(running_job(step=step).status)

    assert len(history.of(0)) == MOST
    assert history.of(0)[0].step == 5


def test_a_replica_without_figures_is_one_line(draw):
    """Figures, a progress bar or an attempt 0 would look like those of a run that has begun."""
    empty = dict.fromkeys(("reason", "message", "pod", "step", "target", "successRate", "meanReturn"))
    empty |= {"stepsPerSecond": None, "simulators": [], "lastCheckpoint": None, "attempt": 0}

    text = draw(running_job(**empty))

    replica = text.partition("replica 0")[2]
    assert replica.split() == ["Running"]


def test_a_run_of_unknown_length_has_steps_and_no_bar(draw):
    """A program of the user's own may count steps without a target."""
    text = draw(running_job(step=300, target=None))

    assert "300, 50 a second" in text
    assert "━" not in text
