"""One selector loop for every socket and timer of a simulator.

The loop is independent of ROS: links register sockets, and the simulator registers timers. Other threads may
call only `post`.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import os
import select
import signal
import socket
import time
from collections import deque
from collections.abc import Callable

Callback = Callable[[], None]
_File = int | socket.socket

# In a virtual machine a wake-up takes 30 us, longer than the response to a request. So if the last _STREAK
# waits were all shorter than _QUICK_S, the loop polls up to _LOOKS times before it waits, and yields the
# processor between two polls. A step of a trainer causes fewer than _STREAK waits. So if each step contains
# one longer wait, the loop never polls: most polls would find nothing, and would take processor time from
# other simulators.
_QUICK_S = 200e-6
_STREAK = 10  # more waits than a step of a trainer causes
_LOOKS = 30

_EVENTS = 32  # maximum number of ready files in one poll; the next poll returns the others

# If a callback, such as the end of a step, is due within this time, the peers wait for its result. They send
# nothing before the result, so polls would only take processor time from other programs.
_NEAR_S = 10e-3


class Loop:
    """Runs callbacks when sockets are ready, when timers are due, or when other threads have posted them."""

    def __init__(self) -> None:
        self._epoll = select.epoll()
        self._watched: dict[int, Callback] = {}
        self._timers: list[tuple[float, int, Callback]] = []
        self._order = itertools.count()
        self._posted: deque[Callback] = deque()
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_read, False)
        os.set_blocking(self._wake_write, False)
        self.watch(self._wake_read, self._run_posted)
        self._running = False
        self._quick_waits = 0
        self._wakes_on_signals = False

    def watch(self, file: _File, ready: Callback, *, writing: bool = False) -> None:
        """Call `ready` whenever `file` can be read; with `writing`, also whenever it can be written."""
        number = _number(file)
        change = self._epoll.modify if number in self._watched else self._epoll.register
        change(number, select.EPOLLIN | (select.EPOLLOUT if writing else 0))
        self._watched[number] = ready

    def forget(self, file: _File) -> None:
        """Stop watching `file`; call this method before the file is closed."""
        number = _number(file)
        if self._watched.pop(number, None) is not None:
            self._epoll.unregister(number)

    def later(self, delay_s: float, callback: Callback) -> None:
        """Call `callback` once after `delay_s` seconds; 0 means after the callbacks that are ready now."""
        heapq.heappush(self._timers, (time.monotonic() + delay_s, next(self._order), callback))

    def post(self, callback: Callback) -> None:
        """Call `callback` in the loop's thread; only `post` is safe in other threads and signal handlers."""
        self._posted.append(callback)
        # If the pipe is full, a wake-up is already pending.
        with contextlib.suppress(BlockingIOError):
            os.write(self._wake_write, b"\0")

    def wake_on_signals(self) -> None:
        """Let a signal end the wait of the loop, even if it arrives just before the wait begins.

        Python runs the handler of a signal only after the wait.
        """
        signal.set_wakeup_fd(self._wake_write, warn_on_full_buffer=False)
        self._wakes_on_signals = True

    def stop(self) -> None:
        """Let `run` return after the callbacks that are ready."""
        self._running = False

    def run(self) -> None:
        """Run until `stop`."""
        self._running = True
        while self._running:
            for number, _ in self._ready():
                # An earlier callback of this round may have called `forget` for this file.
                if (ready := self._watched.get(number)) is not None:
                    ready()
            while self._timers and self._timers[0][0] <= time.monotonic():
                heapq.heappop(self._timers)[2]()

    def close(self) -> None:
        """Close the loop's own files; signals no longer end a wait."""
        if self._wakes_on_signals:
            signal.set_wakeup_fd(-1)
        self._epoll.close()
        os.close(self._wake_read)
        os.close(self._wake_write)

    def _ready(self) -> list[tuple[int, int]]:
        """Wait until a file is ready or a timer is due; return the ready files.

        If recent waits were short, poll a few times before the wait.
        """
        wait_s = self._wait_s()
        if wait_s == 0.0:
            return self._epoll.poll(0, _EVENTS)
        began = time.monotonic()
        ready = self._look() if self._quick_waits >= _STREAK and (wait_s is None or wait_s > _NEAR_S) else []
        ready = ready or self._epoll.poll(wait_s, _EVENTS)
        quick = time.monotonic() - began < _QUICK_S
        self._quick_waits = self._quick_waits + 1 if quick else 0
        return ready

    def _look(self) -> list[tuple[int, int]]:
        """Poll a few times; return the ready files, or an empty list if no file becomes ready."""
        for _ in range(_LOOKS):
            if ready := self._epoll.poll(0, _EVENTS):
                return ready
            os.sched_yield()
        return []

    def _wait_s(self) -> float | None:
        return max(0.0, self._timers[0][0] - time.monotonic()) if self._timers else None

    def _run_posted(self) -> None:
        os.read(self._wake_read, 4096)
        while self._posted:
            self._posted.popleft()()


def _number(file: _File) -> int:
    return file if isinstance(file, int) else file.fileno()
