"""The steps of a robot in Webots, in a thread of their own.

`robot_step` returns only after Webots has simulated the step; while the simulation is paused, it does not
return. So it runs in its own thread, and the event loop continues to serve the sockets.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from queue import SimpleQueue
from typing import Final

from palaestra_sim.ros.loop import Loop
from palaestra_sim.webots.library import Library

_QUIT: Final = -1  # the result of robot_step if the controller has to end

Done = Callable[[bool], None]


class WebotsSteps:
    """Requests steps from Webots, one at a time.

    Args:
        library: the library of Webots.
        loop: the event loop, in which the callbacks run.
        ended: called when Webots requests the end of the controller.
    """

    def __init__(self, library: Library, loop: Loop, ended: Callable[[], None]) -> None:
        self._library = library
        self._loop = loop
        self._ended = ended
        self._requests: SimpleQueue[tuple[int, Done]] = SimpleQueue()
        threading.Thread(target=self._run, name="steps", daemon=True).start()

    def join(self) -> None:
        """Do nothing: Webots waits for every controller whose field `synchronization` is TRUE."""

    def leave(self) -> None:
        """Do nothing: Webots stops waiting for a controller that ends."""

    def ask(self, duration_ms: int, done: Done) -> None:
        """Request a step; then call `done` with True if Webots has simulated the step, else with False."""
        self._requests.put((duration_ms, done))

    def await_end(self, duration_ms: int) -> None:
        """Wait for the end of this controller, after a request that ends or reloads the world.

        Webots announces the end in the response to a step. Otherwise it would terminate the controller one
        second later.
        """
        self.ask(duration_ms, lambda _done: None)

    def _run(self) -> None:
        while True:
            duration_ms, done = self._requests.get()
            stepped = self._library.robot_step(duration_ms) != _QUIT
            self._loop.post(partial(self._finish, done, stepped=stepped))
            if not stepped:
                return  # after -1, the next step would end the process within libController

    def _finish(self, done: Done, *, stepped: bool) -> None:
        done(stepped)
        if not stepped:
            self._ended()
