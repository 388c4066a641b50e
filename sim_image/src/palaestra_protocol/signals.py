"""Which signals a program obeys, at every end alike."""

import signal
from collections.abc import Iterable


def obeyed(numbers: Iterable[signal.Signals]) -> list[signal.Signals]:
    """Return those of the signals that may get a handler: SIGTERM, and those that are not ignored.

    A signal that was ignored when the program started stays ignored: SIGINT of a command in the background of
    a script, SIGHUP under nohup.
    """
    return [
        number
        for number in numbers
        if number is signal.SIGTERM or signal.getsignal(number) is not signal.SIG_IGN
    ]
