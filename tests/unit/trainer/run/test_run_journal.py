"""The journal keeps times and faults of an attempt that is killed."""

from __future__ import annotations

import pytest

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.journal import Journal
from palaestra_trainer.run.telemetry.progress import Counters, Progress

KILLED = ZeroDivisionError("as good as a kill")


@pytest.fixture
def progress(clock):
    """Return the progress of a run."""
    return Progress(100, [("collect-0", "Collect")], clock)


@pytest.fixture
def journal(tmp_path, clock):
    """Return the journal of a run."""
    return Journal(tmp_path / "journal.json", clock)


def test_what_came_after_the_checkpoint_is_not_forgotten(journal, progress, clock):
    """The time and the faults since the checkpoint count. The steps and episodes since then are repeated."""
    progress.counters = Counters(episodes=3, goodput={"learning": 10.0})
    saved = progress.counted()
    with progress.spending(Cause.LEARNING):
        clock.now = 6.0
        progress.fault("collect-0", SimulatorDead("collect-0", "gone"), steps_lost=0)
        progress.collected(47, [{"episode": {"r": 1.0, "l": 7}}])
        journal.keep(progress)

    regained = journal.regained(40, saved)

    assert (regained.faults["dead"], regained.seconds, regained.steps_lost) == (1, 16.0, 7)
    assert regained.episodes == 3


def test_a_checkpoint_that_is_newer_counts(journal, progress, clock):
    """A checkpoint has all counters up to its own time."""
    clock.now = 6.0
    journal.keep(progress)
    clock.now = 7.0
    saved = progress.counted(kept=0)

    assert journal.regained(0, saved) == saved


def test_a_journal_is_written_now_and_then(journal, progress, clock, tmp_path):
    """A write at each step would take too much time."""
    written = []
    for now in (1.0, 5.0, 9.0, 10.0):
        clock.now = now
        (tmp_path / "journal.json").unlink(missing_ok=True)
        journal.keep(progress)
        written.append((tmp_path / "journal.json").exists())

    assert written == [False, True, False, True]


@pytest.mark.parametrize("text", [None, "", "[]", "{}", '{"step": "x"}', '{"step": 3, "counters": 5}'])
def test_without_a_readable_journal_the_checkpoint_counts(journal, tmp_path, text):
    """After a crash of the machine, the journal may be truncated."""
    if text is not None:
        (tmp_path / "journal.json").write_text(text)
    saved = Counters(episodes=3)

    assert journal.regained(40, saved) is saved


def test_a_journal_that_cannot_be_written_ends_no_run(progress, clock, tmp_path):
    """The journal is only for statistics, so its failure must not end a run."""
    journal = Journal(tmp_path / "none" / "journal.json", clock)
    clock.now = 6.0

    journal.keep(progress)

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("step", [30, 70], ids=["before the first checkpoint", "after it"])
def test_a_killed_attempt_s_faults_and_steps_are_in_the_next_one_s_counters(
    play, job, directory, monkeypatch, step
):
    """A run that is often killed must not seem to have had fewer faults."""
    monkeypatch.setattr("palaestra_trainer.run.journal.EVERY_S", 0.0)
    play(job(), {"collect-0": {"steps": {20: SimulatorDead("collect-0", "gone"), step: KILLED}}})
    found = checkpoint.newest(directory.checkpoints)

    play(job())

    ended = Counters.from_json(checkpoint.newest(directory.checkpoints).manifest.counters)
    saved = Counters.from_json(found.manifest.counters) if found else Counters()
    kept = found.manifest.step if found else 0
    assert (found is None) == (step == 30)
    assert ended.faults["dead"] == 1
    lost_besides_an_episode = ended.steps_lost - saved.steps_lost - (step - kept)
    assert abs(lost_besides_an_episode) <= 8
    assert ended.seconds > saved.seconds
