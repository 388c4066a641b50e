"""A pod is not to be trusted: what a poller takes from it, and how long it lets it take."""

import json
import socketserver
import threading
from contextlib import contextmanager

import pytest

from palaestra.operator.poller import MOST_BYTES, Poller, Target
from palaestra_sim.protocol.status import TrainerStatus

JOB = ("robots", "job")
STATUS = TrainerStatus(step=7, target=10, episodes=1, phase="collecting")
BODY = json.dumps(STATUS.to_json()).encode()
OK = b"HTTP/1.0 200 OK\r\nContent-Type: application/json\r\n\r\n"
WAIT_S = 10.0


class Trainer(socketserver.ThreadingTCPServer):
    """Answers every connection with the same bytes, and then says nothing for as long as it is told."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, answer, silent=None):
        self.answer, self.silent = answer, silent
        super().__init__(("127.0.0.1", 0), Answering)
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()


class Answering(socketserver.BaseRequestHandler):
    """One connection."""

    def handle(self):
        """Answer it."""
        self.request.recv(4096)
        try:
            self.request.sendall(self.server.answer)
        except OSError:
            return
        if self.server.silent is not None:
            self.server.silent.wait(WAIT_S)


@contextmanager
def trainer(answer, silent=None):
    """Serve one answer; yields where."""
    server = Trainer(answer, silent)
    try:
        yield Target(key=JOB, uid="pod", host="127.0.0.1", port=server.server_address[1])
    finally:
        if silent is not None:
            silent.set()
        server.shutdown()
        server.server_close()


@contextmanager
def polling(*targets, deadline_s=3.0):
    """Poll in quick rounds; yields the poller, and a function that waits for so many more rounds."""
    rounds = threading.Semaphore(0)
    changed = threading.Event()

    def current():
        rounds.release()
        return targets

    poller = Poller(current, lambda _: changed.set(), period_s=0.01, deadline_s=deadline_s)
    poller.changed = changed

    def finished(count):
        for _ in range(count + 1):  # the start of a round is the end of the one before
            assert rounds.acquire(timeout=WAIT_S)

    poller.start()
    try:
        yield poller, finished
    finally:
        poller.stop(WAIT_S)


def test_a_running_trainer_says_where_it_stands():
    """The numbers of `kubectl get tj`."""
    with trainer(OK + BODY) as target, polling(target) as (poller, finished):
        finished(1)

        assert poller.known()["pod"].status == STATUS


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        b"SSH-2.0-OpenSSH_9.2\r\n",
        b"HTTP/1.0 302 Found\r\nLocation: http://127.0.0.1/secret\r\n\r\n",
        b"HTTP/1.0 200 OK\r\n" + b"x: y\r\n" * 5000 + b"\r\n",
        OK + b"[]",
        OK + b"{" * 2000,
        OK + json.dumps({**STATUS.to_json(), "step": -1}).encode(),
        OK + b" " * (MOST_BYTES + 1) + BODY,
    ],
    ids=["nothing", "another protocol", "redirect", "endless head", "list", "deep", "negative", "endless"],
)
def test_what_is_no_answer_is_unknown(answer):
    """No exception, no guess, and nothing is followed."""
    with trainer(answer) as target, polling(target) as (poller, finished):
        finished(2)

        assert poller.known() == {}


def test_a_trainer_that_drips_does_not_hold_the_others_up():
    """The deadline is for the whole answer, not for the next byte."""
    silent = threading.Event()
    with trainer(OK + BODY[:20], silent) as slow, trainer(OK + BODY) as quick:
        targets = [slow, Target(key=JOB, uid="quick", host=quick.host, port=quick.port)]
        with polling(*targets, deadline_s=1.0) as (poller, finished):
            finished(1)

            assert set(poller.known()) == {"quick"}


def test_who_stops_answering_becomes_unknown_again():
    """What was true once is no sign of life; stalled is for the trainer to say."""
    with trainer(OK + BODY) as target:
        targets = [target]
        with polling(target) as (poller, finished):
            finished(1)
            assert set(poller.known()) == {"pod"}
            targets.clear()

    with polling(target) as (poller, finished):
        finished(1)

        assert poller.known() == {}


def test_a_job_is_looked_at_when_its_trainer_says_something_new_only():
    """A hundred idle trainers make no work."""
    with trainer(OK + BODY) as target, polling(target) as (poller, finished):
        assert poller.changed.wait(WAIT_S)
        poller.changed.clear()
        finished(3)

        assert not poller.changed.is_set()
