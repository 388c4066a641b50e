"""Signals that set an event, tested in a child process, because signal handlers belong to a whole process."""

import subprocess
import sys

SCRIPT = """
import os, signal, threading
from palaestra_protocol.signals import set_at_signals

class Noting(threading.Event):
    def set(self):
        self.by_main = threading.current_thread() is threading.main_thread()
        super().set()

event = Noting()
signal.signal(signal.SIGUSR2, lambda *_: None)
set_at_signals(event, (signal.SIGUSR1,))
os.kill(os.getpid(), signal.SIGUSR2)
print(event.wait(0.2))
os.kill(os.getpid(), signal.SIGUSR1)
print(event.wait(30), event.by_main)
"""


def test_a_signal_sets_the_event_in_a_thread_that_waits_for_nothing_else():
    """A signal handler runs in the main thread, and would hang if this thread just began to wait.

    A ROS master once did not end for that reason. Other signals do not set the event.
    """
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=60, check=False
    )

    assert ended.stdout == "False\nTrue False\n", ended.stderr
