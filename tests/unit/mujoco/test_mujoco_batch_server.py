"""The socket of a batched world, served in the test's own process."""

import contextlib
import logging
import os
import signal
import socket
import threading

import numpy as np
import pytest

from palaestra_protocol.batch import (
    HEADER,
    BatchRequest,
    FrameKind,
    ResetParts,
    description_of,
    frame,
    json_frame,
    kind_and_length,
    read_parts,
    reset_frame,
)
from palaestra_protocol.control import BATCH_FILE
from palaestra_sim.mujoco.batched.program import batch_of, serve
from palaestra_sim.mujoco.batched.server import BatchServer
from palaestra_sim.mujoco.mjcf.loader import load as load_model
from palaestra_sim.scene.mode import Mode
from tests.unit.mujoco.test_mujoco_batch import CART, CARTPOLE, carts, upright
from tests.waiting import eventually

PATIENCE_S = 30.0
ROWS = 2
OPEN = json_frame(FrameKind.OPEN, CART)
STILL = np.zeros((ROWS, 1))


class Trainer:
    """A client of the server that sends raw frames."""

    def __init__(self, address: str) -> None:
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=PATIENCE_S)
        self._file = self.socket.makefile("rb")

    def ask(self, request: bytes) -> tuple[FrameKind, bytes]:
        """Return kind and content of the response to a frame."""
        self.socket.sendall(request)
        kind, length = kind_and_length(self._file.read(HEADER.size))
        return kind, self._file.read(length)

    def is_closed(self) -> bool:
        """Return whether the server has closed the connection; wait until it closes or sends."""
        with contextlib.suppress(ConnectionResetError):
            return not self._file.read(1)
        return True

    def close(self) -> None:
        """Close the connection."""
        self._file.close()
        self.socket.close()


@pytest.fixture
def server(tmp_path):
    """Yield a running server of cart-poles, and its address."""
    file = tmp_path / "address"
    it = BatchServer(carts(tmp_path, ROWS, limited=False), ROWS, file)
    thread = threading.Thread(target=it.run, daemon=True)
    thread.start()
    yield it, file.read_text().strip()
    it.stop()
    thread.join(PATIENCE_S)


@pytest.fixture
def trainer(server):
    """Yield a function that connects to the server."""
    _, address = server
    made = []

    def connect():
        made.append(Trainer(address))
        return made[-1]

    yield connect
    for each in made:
        each.close()


def step(commands):
    """Return the frame of a step."""
    return frame(FrameKind.STEP, np.asarray(commands, "<f8").tobytes())


def reset(rows, *, joints=0.0):
    """Return the frame of a reset of these rows."""
    return reset_frame(
        len(rows),
        ResetParts(
            rows=np.array(rows, "<u4").tobytes(),
            seeds=np.array(rows, "<i8").tobytes(),
            places=b"",
            joints=np.full(len(rows), joints, "<f8").tobytes(),
            commands=np.zeros(len(rows), "<f8").tobytes(),
        ),
    )


def at_rest(rows):
    """Return the reset of `reset(rows)` as the world gets it."""
    it = upright(rows)
    it.joints[:] = 0.0
    return it


def read(response, rows=ROWS):
    """Return the values of a READ frame, the numbers of the failed rows, and the reasons."""
    kind, content = response
    assert kind is FrameKind.READ
    parts = read_parts(memoryview(content), rows=rows, values=len(CART.sensors))
    values = np.frombuffer(parts.values, "<f8").reshape(rows, -1)
    return values, np.flatnonzero(np.frombuffer(parts.failed, np.uint8)).tolist(), parts.reasons


def test_the_responses_have_the_bits_of_the_world(trainer, tmp_path) -> None:
    """A resume compares bits, so the wire must not change a number."""
    client, world = trainer(), carts(tmp_path, ROWS, limited=False)
    world.open(CART)

    kind, content = client.ask(OPEN)

    assert kind is FrameKind.OPENED
    assert description_of(content).rows == ROWS
    assert np.array_equal(read(client.ask(reset((0, 1))))[0], world.reset(at_rest((0, 1))).values)
    for force in (1.0, -3.0):
        commands = np.array([[force], [2.0 * force]])
        assert np.array_equal(read(client.ask(step(commands)))[0], world.step(commands).values)
    assert np.array_equal(read(client.ask(reset((1,))), 1)[0], world.reset(at_rest((1,))).values)


def test_a_failed_row_is_reported_with_zeros_and_its_reason(trainer) -> None:
    """A NaN in an observation would spoil the normalization of all rows."""
    client = trainer()
    client.ask(OPEN)

    for _ in range(10):
        values, failed, reasons = read(client.ask(step([[0.0], [1e300]])))

    assert failed == [1]
    assert set(reasons) == {1}
    assert np.isfinite(values).all()
    assert not values[1].any()


def test_a_refusal_of_the_world_keeps_the_connection(trainer) -> None:
    """The trainer reports the reason, and may open with another request."""
    client = trainer()
    wrong = BatchRequest.from_json({**CART.to_json(), "sensors": ["nose"]})

    kind, reason = client.ask(json_frame(FrameKind.OPEN, wrong))

    assert kind is FrameKind.REFUSED
    assert b"the model has no sensor 'nose'" in reason
    assert client.ask(OPEN)[0] is FrameKind.OPENED


@pytest.mark.parametrize(
    ("requests", "fact"),
    [
        ([b"GET / HTTP/1.1\r\n\r\n"], "something else than a frame"),
        ([step(STILL)], "a step or reset before OPEN"),
        ([reset((0,))], "a step or reset before OPEN"),
        ([frame(FrameKind.OPEN, b"{}")], "version: is missing"),
        ([OPEN, step(np.zeros((ROWS + 1, 1)))], "3 commands do not fit 2 rows"),
        ([OPEN, frame(FrameKind.READ)], "READ is not a request"),
        ([OPEN, frame(FrameKind.RESET)], "a reset without rows"),
        ([OPEN, reset(())], "the rows of a reset must increase, from 0 to 1"),
        ([OPEN, reset((1, 0))], "the rows of a reset must increase, from 0 to 1"),
        ([OPEN, reset((0, 0))], "the rows of a reset must increase, from 0 to 1"),
        ([OPEN, reset((0, ROWS))], "the rows of a reset must increase, from 0 to 1"),
        ([OPEN, reset((2**32 - 1,))], "the rows of a reset must increase, from 0 to 1"),
        ([OPEN, reset((0,), joints=np.nan)], "a place or joint position of a reset is not finite"),
    ],
)
def test_a_wrong_request_closes_its_connection_and_no_other(trainer, caplog, requests, fact) -> None:
    """The state of such a client is unknown, but its program may connect again."""
    client = trainer()
    with caplog.at_level(logging.WARNING):
        *_, (kind, reason) = map(client.ask, requests)

        assert kind is FrameKind.REFUSED
        assert fact in reason.decode()
        assert client.is_closed()
    assert fact in caplog.text

    again = trainer()
    assert again.ask(OPEN)[0] is FrameKind.OPENED
    assert read(again.ask(step(STILL)))[1] == []


@pytest.mark.parametrize("sent", [b"", OPEN[:3], OPEN[:-1]])
def test_a_trainer_that_ends_within_a_frame_does_not_end_the_server(trainer, sent) -> None:
    """A trainer that is killed is replaced, and its simulator keeps the compiled world."""
    killed = trainer()
    killed.ask(OPEN)
    killed.socket.sendall(sent)
    killed.close()

    assert trainer().ask(OPEN)[0] is FrameKind.OPENED


def test_a_new_connection_replaces_the_old_one_and_opens_again(trainer) -> None:
    """A trainer that lost a response connects again before the system closes its old connection."""
    old = trainer()
    old.ask(OPEN)

    new = trainer()

    assert new.ask(step(STILL))[1].decode() == "a step or reset before OPEN"
    assert old.is_closed()


def test_a_stopped_server_closes_its_connection_and_its_port(server, trainer) -> None:
    """A trainer then learns at once that its simulator ended, and does not wait for a timeout."""
    running, address = server
    client = trainer()
    client.ask(OPEN)

    running.stop()

    assert client.is_closed()
    with pytest.raises(ConnectionRefusedError):
        Trainer(address)


def test_without_a_file_the_address_is_in_the_log(tmp_path, caplog) -> None:
    """A person who starts the program by hand reads the address there."""
    with caplog.at_level(logging.INFO):
        server = BatchServer(carts(tmp_path, ROWS), ROWS, None)
    server.stop()
    server.run()

    assert "batch of 2 rows at 127.0.0.1:" in caplog.text


@pytest.fixture
def handlers():
    """Restore the handlers of the signals that a program sets."""
    numbers = (signal.SIGTERM, signal.SIGINT)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_program_with_code_0(tmp_path, monkeypatch, number) -> None:
    """A sidecar that stops its simulator must not report a failure."""
    path, address = tmp_path / "cartpole.xml", tmp_path / "address"
    path.write_text(CARTPOLE.format(limits=""))
    monkeypatch.setenv(BATCH_FILE, str(address))
    opened = []

    def play():
        client = Trainer(eventually(lambda: address.exists() and address.read_text().strip()))
        opened.append(client.ask(OPEN)[0])
        os.kill(os.getpid(), number)
        client.close()

    thread = threading.Thread(target=play, daemon=True)
    thread.start()
    code = serve(load_model(path, Mode.FAST), path, ROWS, 0)
    thread.join(PATIENCE_S)

    assert code == 0
    assert opened == [FrameKind.OPENED]


def test_a_simulation_of_another_engine_has_no_batch_form() -> None:
    """The program then fails with the name of the class, and does not serve a wrong world."""
    with pytest.raises(TypeError, match="NoneType is not a simulation of MuJoCo"):
        batch_of(None, "world.wbt", ROWS, 1)
