"""Run functions at the same time, each in its own thread, until all have returned or one has raised."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, CancelledError, ThreadPoolExecutor, wait
from typing import TypeVar

from palaestra_trainer.waiting.check import Check

LOOK_EVERY_S = 0.1

Result = TypeVar("Result")


def at_once(works: Sequence[Callable[[Check], Result]], check: Check, name: str) -> list[Result]:
    """Return the results in order; if a function raises, raise its error after all have ended.

    Args:
        works: the functions. Each gets a check and must call it often; the check raises after another
            function has failed.
        check: called in this thread every tenth of a second; if it raises, all functions end and its error is
            raised.
        name: prefix of the names of the threads.
    """
    over = threading.Event()

    def check_all() -> None:
        if over.is_set():
            raise CancelledError

    with ThreadPoolExecutor(len(works), name) as pool:
        begun = [pool.submit(work, check_all) for work in works]
        left = set(begun)
        try:
            while left:
                done, left = wait(left, LOOK_EVERY_S, FIRST_EXCEPTION)
                for future in done:
                    future.result()
                check()
        finally:
            over.set()
    return [future.result() for future in begun]
