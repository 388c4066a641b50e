"""Select the signals that a program handles, with the same rule for every program."""

import signal
from collections.abc import Iterable


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
