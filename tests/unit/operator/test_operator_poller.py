"""The poller does not trust pods: it limits the size and the duration of their responses."""

import json
import socketserver
import threading
from contextlib import ExitStack, contextmanager

import pytest
from structlog.testing import capture_logs

from palaestra.operator.poll_schedule import PollTarget
from palaestra.operator.poller import MOST_BYTES, Poller
from palaestra_protocol.pod.status import TrainerStatus

JOB = ("robots", "job")
STATUS = TrainerStatus(step=7, target=10, episodes=1, phase="collecting")
BODY = json.dumps(STATUS.to_json()).encode()
OK = b"HTTP/1.0 200 OK\r\nContent-Type: application/json\r\n\r\n"
WAIT_S = 60.0


class Trainer(socketserver.ThreadingTCPServer):
    """A server that sends the same bytes on every connection and then waits until `silent` is set."""

    daemon_threads = True
    block_on_close = False
    request_queue_size = 128

    def __init__(self, answer, silent=None):
        self.answer, self.silent = answer, silent
        self.questions = threading.Semaphore(0)
        super().__init__(("127.0.0.1", 0), Answering)
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()

    def target(self, uid="pod", key=JOB):
        """Return a poll target with the address of this server."""
        return PollTarget(key=key, uid=uid, host="127.0.0.1", port=self.server_address[1])

    def asked(self, count):
        """Wait until `count` further polls have ended; a poll has ended when the next one starts."""
        while self.questions.acquire(blocking=False):
            pass  # ignore polls from before this call, which a busy machine may delay
        for _ in range(count + 1):
            assert self.questions.acquire(timeout=WAIT_S)


class Answering(socketserver.BaseRequestHandler):
    """The handler of one connection to `Trainer`."""

    def handle(self):
        """Send the response."""
        self.request.recv(4096)
        self.server.questions.release()
        try:
            self.request.sendall(self.server.answer)
        except OSError:
            return
        if self.server.silent is not None:
            self.server.silent.wait(WAIT_S)


@contextmanager
def trainer(answer, silent=None):
    """Yield a server that sends one response."""
    server = Trainer(answer, silent)
    try:
        yield server
    finally:
        if silent is not None:
            silent.set()
        server.shutdown()
        server.server_close()


@contextmanager
def polling(*targets, deadline_s=3.0):
    """Poll often, and yield the poller, whose targets may be replaced."""
    poller = Poller(lambda: poller.asks, lambda _: poller.changed.set(), period_s=0.01, deadline_s=deadline_s)
    poller.asks, poller.changed = targets, threading.Event()
    poller.start()
    try:
        yield poller
    finally:
        poller.stop(WAIT_S)


def test_a_running_trainer_says_where_it_stands():
    """`kubectl get tj` shows these numbers."""
    with trainer(OK + BODY) as pod, polling(pod.target()) as poller:
        pod.asked(1)

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
    """The poller raises no exception, guesses no values and follows no redirect."""
    with trainer(answer) as pod, polling(pod.target()) as poller:
        pod.asked(2)

        assert poller.known() == {}


def test_a_trainer_that_drips_does_not_hold_the_others_up():
    """The deadline applies to the whole response, not to each byte."""
    silent = threading.Event()
    with (
        trainer(OK + BODY[:20], silent) as slow,
        trainer(OK + BODY) as quick,
        polling(slow.target("slow"), quick.target("quick"), deadline_s=1.0) as poller,
    ):
        quick.asked(3)

        assert set(poller.known()) == {"quick"}


def test_silent_pods_delay_nobody():
    """640 pods do not respond.

    The poller still polls ten other pods in every period and uses their responses at once.
    """
    silent, quick = threading.Event(), [trainer(OK + BODY) for _ in range(10)]
    with ExitStack() as stack:
        ten = [stack.enter_context(each) for each in quick]
        mute = stack.enter_context(trainer(b"", silent))
        targets = [mute.target(f"silent {number}", ("theirs", "job")) for number in range(640)]
        targets += [pod.target(f"quick {number}") for number, pod in enumerate(ten)]
        with polling(*targets, deadline_s=1.5) as poller:
            for pod in ten:
                pod.asked(20)

            assert set(poller.known()) == {f"quick {number}" for number in range(10)}


def test_who_stops_answering_becomes_unknown_again():
    """An old response does not prove that the trainer still runs.

    Only the trainer itself can report a stall.
    """
    with trainer(OK + BODY) as pod, polling(pod.target()) as poller:
        pod.asked(1)
        before = set(poller.known())
        pod.answer = b""
        pod.asked(2)

        assert (before, dict(poller.known())) == ({"pod"}, {})


def test_what_a_pod_said_is_forgotten_with_it():
    """The uid of a deleted pod never returns, so its response would use memory for nothing."""
    with trainer(OK + BODY) as pod, polling(pod.target()) as poller:
        pod.asked(1)
        poller.changed.clear()
        poller.asks = ()

        assert poller.changed.wait(WAIT_S)
        assert poller.known() == {}


def test_an_answer_that_nobody_foresaw_ends_no_other_question(monkeypatch):
    """One pod's response must not end the thread, and with it the operator for all users."""
    read = TrainerStatus.from_json
    monkeypatch.setattr(TrainerStatus, "from_json", lambda body: read(body) if body["step"] != 8 else 1 // 0)
    with (
        trainer(OK + BODY.replace(b'"step": 7', b'"step": 8')) as odd,
        trainer(OK + BODY) as sound,
        polling(odd.target("odd"), sound.target("sound")) as poller,
    ):
        odd.asked(2)
        sound.asked(2)

        assert set(poller.known()) == {"sound"}


def test_a_pod_that_lies_for_ever_is_logged_once():
    """With a line for each poll, a thousand such pods would fill the operator's log."""
    with trainer(OK + b"[]") as pod, capture_logs() as logs, polling(pod.target()):
        pod.asked(5)

    assert [each["event"] for each in logs if each["log_level"] == "warning"] == ["response refused"]


def test_a_job_is_looked_at_when_its_trainer_says_something_new_only():
    """The ages in a response always grow, but without progress they must not cause a reconcile."""
    with trainer(OK + BODY) as pod, polling(pod.target()) as poller:
        assert poller.changed.wait(WAIT_S)
        poller.changed.clear()
        pod.answer = OK + json.dumps(STATUS.to_json() | {"last_progress_age_s": 5.0}).encode()
        pod.asked(3)
        quiet = not poller.changed.is_set()
        pod.answer = OK + json.dumps(STATUS.to_json() | {"step": 8}).encode()

        assert poller.changed.wait(WAIT_S)
        assert quiet
