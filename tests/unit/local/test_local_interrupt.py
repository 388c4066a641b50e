"""A run ends early through a person's signals or through its deadline."""

import asyncio
import os
import signal

import pytest

from palaestra.local.interrupt import Interrupt

PATIENCE_S = 20.0


class Target:
    """A target that can be stopped and killed, and queues the requests."""

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
    """Return the requests to a target, and the interrupt, after a deadline and some signals."""

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
    """The trainer saves a checkpoint, but the end is not a person's."""
    told, interrupt = ended_by(0, deadline_s=0.01)

    assert told == ["stop"]
    assert (interrupt.expired, interrupt.signals, interrupt.killed) == (True, 0, False)


def test_a_first_signal_after_the_deadline_does_not_kill():
    """The person may not know that the run is already stopping."""
    told, interrupt = ended_by(2, deadline_s=0.01)

    assert told == ["stop", "stop", "kill"]
    assert interrupt.killed


@pytest.mark.parametrize("signals", [1, 2])
def test_a_run_that_a_person_ends_has_not_expired(signals):
    """This does not depend on how long the end takes."""
    told, interrupt = ended_by(signals)

    assert told == ["stop", "kill"][:signals]
    assert not interrupt.expired


@pytest.fixture(params=[signal.SIGINT, signal.SIGHUP], ids=lambda number: number.name)
def ignored(request):
    """A signal that is ignored, as this process would inherit it."""
    before = signal.signal(request.param, signal.SIG_IGN)
    yield request.param
    signal.signal(request.param, before)


def test_a_signal_that_was_ignored_at_the_start_stays_ignored(ignored):
    """Scripts ignore SIGINT for background programs, nohup ignores SIGHUP; SIGTERM still ends the run."""

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
