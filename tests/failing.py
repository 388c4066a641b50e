"""System calls that fail as on machines that a test cannot have."""

import os
from collections.abc import Callable
from typing import NoReturn


def failing(number: int) -> Callable[..., NoReturn]:
    """Return a function that always fails with this error number."""

    def fail(*_: object) -> NoReturn:
        raise OSError(number, os.strerror(number))

    return fail
