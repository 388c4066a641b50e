"""Send updates to nodes, in one thread per node that has updates.

A node gets its updates in order, and each update is sent once. While an update waits to be sent, a newer
update of the same subject replaces it. A node that does not respond delays only its own updates.
"""

from __future__ import annotations

import logging
import threading
import xmlrpc.client
from collections import deque
from collections.abc import Callable
from typing import Any

from palaestra_protocol.xmlrpc.client import call
from palaestra_protocol.xmlrpc.documents import UnreadableDocument
from palaestra_protocol.xmlrpc.responses import WRONG
from palaestra_trainer.ros_master.api import MASTER, Update

DEADLINE_S = 5.0
MOST_THREADS = 128  # further nodes wait until a thread is free

log = logging.getLogger(__name__)

_Queue = dict[tuple[str, str], Update]


class Updates:
    """The updates of one master that are not yet sent.

    Args:
        refused: called, in any thread, with an update of a parameter that the node refused.
        deadline_s: deadline for one update.
    """

    def __init__(self, refused: Callable[[Update], None], deadline_s: float = DEADLINE_S) -> None:
        self._refused = refused
        self._deadline_s = deadline_s
        self._lock = threading.Lock()
        self._queues: dict[str, _Queue] = {}  # keys: URIs of nodes; each queue begins with the oldest update
        self._turns: deque[str] = deque()  # URIs with updates and without a thread
        self._threads = 0

    def add(self, updates: list[Update]) -> None:
        """Send these updates after the earlier updates of each node; return at once."""
        with self._lock:
            for update in updates:
                self._put(update)
            starting = min(len(self._turns), MOST_THREADS - self._threads)
            self._threads += starting
        for _ in range(starting):
            threading.Thread(target=self._work, daemon=True).start()

    def _put(self, update: Update) -> None:
        if update.uri not in self._queues:
            self._queues[update.uri] = {}
            self._turns.append(update.uri)
        queue, about = self._queues[update.uri], (update.method, update.subject)
        queue.pop(about, None)
        queue[about] = update  # at the end, so that no older update follows and undoes a newer change

    def _work(self) -> None:
        while True:
            with self._lock:
                if not self._turns:
                    self._threads -= 1
                    return
                uri = self._turns.popleft()
            self._send_all(uri)

    def _send_all(self, uri: str) -> None:
        while True:
            with self._lock:
                queue = self._queues[uri]
                if not queue:
                    del self._queues[uri]
                    return
                update = queue.pop(next(iter(queue)))
            self._send(update)

    def _send(self, update: Update) -> None:
        try:
            response: Any = call(update.uri, self._deadline_s, update.method, MASTER, *_arguments(update))
        except (OSError, UnreadableDocument, xmlrpc.client.Fault, TypeError, OverflowError) as error:
            log.info("%s does not take %s of %s: %s", update.uri, update.method, update.subject, error)
            return
        match response:
            case [int(code), *_] if code == WRONG and update.method == "paramUpdate":
                self._refused(update)


def _arguments(update: Update) -> tuple[Any, ...]:
    return (update.value,) if update.method == "shutdown" else (update.subject, update.value)
