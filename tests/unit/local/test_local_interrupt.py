"""A user's signals or the deadline end a run early."""

import asyncio
import os
import signal

import pytest

from palaestra.local.interrupt import Interrupt

PATIENCE_S = 20.0


class Target:
    """A target that puts each request to stop or kill it into a queue."""

    def __init__(self):
        self.told = asyncio.Queue()

    def stop(self):
        """Queue a request to stop."""
        self.told.put_nowait("stop")

    def kill(self):
        """Queue a request to kill."""
        self.told.put_nowait("kill")

    async def next(self):
        """Return the next request."""
        return await asyncio.wait_for(self.told.get(), PATIENCE_S)


def ended_by(signals, deadline_s=None):
    """Return the requests that a target gets after a deadline and some signals, and the interrupt."""

    async def play():
        interrupt, target, told = Interrupt(), Target(), []
        interrupt.pass_to(target)
        with interrupt.listening(deadline_s):
            if deadline_s is not None:
                told.append(await target.next())
            for _ in range(signals):
                os.kill(os.getpid(), signal.SIGINT)
                told.append(await target.next())
        return told, interrupt

    return asyncio.run(play())


def test_a_deadline_stops_as_a_first_signal_does():
    """The trainer saves a checkpoint, but the run counts as expired, not as interrupted by a user."""
    told, interrupt = ended_by(0, deadline_s=0.01)

    assert told == ["stop"]
    assert (interrupt.expired, interrupt.signals, interrupt.killed) == (True, 0, False)


def test_a_first_signal_after_the_deadline_does_not_kill():
    """The user may not have noticed that the run is already stopping."""
    told, interrupt = ended_by(2, deadline_s=0.01)

    assert told == ["stop", "stop", "kill"]
    assert interrupt.killed


@pytest.mark.parametrize("signals", [1, 2])
def test_a_run_that_a_person_ends_has_not_expired(signals):
    """The run counts as ended by the user, however long the trainer takes to stop."""
    told, interrupt = ended_by(signals)

    assert told == ["stop", "kill"][:signals]
    assert not interrupt.expired


@pytest.fixture(params=[signal.SIGINT, signal.SIGHUP], ids=lambda number: number.name)
def ignored(request):
    """Ignore a signal, as a process does that inherits this setting from its parent."""
    before = signal.signal(request.param, signal.SIG_IGN)
    yield request.param
    signal.signal(request.param, before)


def test_a_signal_that_was_ignored_at_the_start_stays_ignored(ignored):
    """Shells ignore SIGINT for background programs, and nohup ignores SIGHUP. SIGTERM still ends the run."""

    async def play():
        interrupt, target = Interrupt(), Target()
        interrupt.pass_to(target)
        with interrupt.listening():
            os.kill(os.getpid(), ignored)
            os.kill(os.getpid(), signal.SIGTERM)
            await target.next()
        return interrupt

    assert asyncio.run(play()).signals == 1
    assert signal.getsignal(ignored) is signal.SIG_IGN
