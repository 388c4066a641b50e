"""Select the signals that a program handles, and let them set an event; the same rules for every program."""

import os
import signal
import threading
from collections.abc import Collection, Iterable


def obeyed(numbers: Iterable[signal.Signals]) -> list[signal.Signals]:
    """Return the signals that may get a handler: SIGTERM, and those that are not ignored.

    A signal that was ignored when the program started stays ignored. Examples are SIGINT for a background
    command of a script, and SIGHUP under nohup.
    """
    return [
        number
        for number in numbers
        if number is signal.SIGTERM or signal.getsignal(number) is not signal.SIG_IGN
    ]


def set_at_signals(event: threading.Event, numbers: Collection[signal.Signals]) -> None:
    """From now on, set `event` at each of these signals; call it in the main thread, once.

    A thread sets the event. Python runs handlers in the main thread. A handler that set the event would wait
    for the event's lock forever if the signal arrived just when the main thread begins to wait for the event.
    """
    read, write = os.pipe()
    os.set_blocking(write, False)
    signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    for number in numbers:
        signal.signal(number, lambda *_: None)
    threading.Thread(target=_set, args=(event, numbers, read), name="signals", daemon=True).start()


def _set(event: threading.Event, numbers: Collection[signal.Signals], read: int) -> None:
    while True:
        if any(number in numbers for number in os.read(read, 64)):
            event.set()
