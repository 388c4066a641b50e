"""Select the signals that a program handles, and set an event when such a signal arrives.

All programs of Palaestra use these rules.
"""

import os
import signal
import threading
from collections.abc import Collection, Iterable


def obeyed(numbers: Iterable[signal.Signals]) -> list[signal.Signals]:
    """Return the signals that may get a handler: SIGTERM, and each signal that the process does not ignore.

    If a signal was ignored when the program started, it must stay ignored. Examples are SIGINT for a
    background command of a script, and SIGHUP under nohup.
    """
    return [
        number
        for number in numbers
        if number is signal.SIGTERM or signal.getsignal(number) is not signal.SIG_IGN
    ]


def set_at_signals(event: threading.Event, numbers: Collection[signal.Signals]) -> None:
    """From now on, set `event` when one of these signals arrives; call this once, in the main thread.

    A separate thread sets the event, because Python runs signal handlers in the main thread. The main thread
    holds the event's lock while it begins to wait for the event. A handler that set the event at that moment
    would wait for the same lock forever.
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
