"""Run a command in a container: its unchanged output, and its result.

The first byte of each websocket message is the number of a stream. At the end, the API server sends the
result of the command on a separate stream. If the API server sends no result, the output is incomplete.
"""

import json
import time
from collections.abc import Iterator, Mapping
from socket import socket
from typing import Any

import websocket

from palaestra.cluster.client_config import Headers
from palaestra.cluster.errors import SERVER_ERROR, ApiError, CommandFailed, Unreachable, from_status

PROTOCOLS = ["v5.channel.k8s.io", "v4.channel.k8s.io"]
STDOUT, STDERR, STATUS = 1, 2, 3
MOST_STDERR = 4096  # the first bytes of standard error are kept, because they name the cause
EXIT_CODE = "ExitCode"
UNKNOWN_CODE = -1


def open_socket(connection: socket, url: str, headers: Headers, wait_s: float) -> websocket.WebSocket:
    """Return the socket of a running command; the caller closes it. A read waits at most `wait_s`.

    Args:
        connection: the TLS connection to the API server, which may go through a proxy.
        url: the url of the command.
        headers: the headers of the request.
        wait_s: longest time in seconds until the command runs.

    Raises:
        ApiError: the API server refuses, or cannot be reached.
    """
    connection.settimeout(wait_s)
    try:
        return websocket.create_connection(
            url.replace("http", "ws", 1),
            socket=connection,
            timeout=wait_s,
            header=[f"{name}: {value}" for name, value in headers],
            subprotocols=PROTOCOLS,
            suppress_origin=True,
            skip_utf8_validation=True,
            redirect_limit=0,  # a redirect would send the credentials to another server
        )
    except websocket.WebSocketBadStatusException as error:
        raise from_status(error.status_code, _decoded(error.resp_body)) from error
    except (websocket.WebSocketException, OSError) as error:
        raise Unreachable(0, "Unreachable", f"{url.partition('?')[0]}: no response ({error})") from error


def output(command: websocket.WebSocket, deadline: float) -> Iterator[bytes]:
    """Yield the command's standard output until it has succeeded.

    Args:
        command: the socket from `open_socket`; it is closed at the end.
        deadline: the time on the monotonic clock by which the command must have ended.

    Raises:
        CommandFailed: the exit code of the command is not 0.
        ApiError: the command could not be started.
        Unreachable: the connection broke, or the command did not end in time.
    """
    said = bytearray()
    try:
        while True:
            stream, content = _message(command, deadline)
            if stream == STDOUT:
                yield content
            elif stream == STDERR:
                said += content[: MOST_STDERR - len(said)]
            elif stream == STATUS:
                if failure := _failure(_decoded(content), said.decode(errors="replace")):
                    raise failure
                return
    finally:
        # The socket is closed without the websocket's closing handshake, to which a dead peer would not
        # respond. The socket must be closed here, because the library does not close TLS within TLS.
        if command.sock is not None:
            command.sock.close()
        command.shutdown()


def _message(command: websocket.WebSocket, deadline: float) -> tuple[int, bytes]:
    left_s = deadline - time.monotonic()
    if left_s <= 0:
        raise Unreachable(0, "Timeout", "the command did not end in time")
    command.settimeout(left_s)
    try:
        opcode, frame = command.recv_data_frame(control_frame=True)
    except websocket.WebSocketTimeoutException as error:
        raise Unreachable(0, "Timeout", "the command did not end in time") from error
    except (websocket.WebSocketException, OSError) as error:
        raise Unreachable(0, "Unreachable", f"the command's output ended early ({error})") from error
    if opcode == websocket.ABNF.OPCODE_CLOSE:
        raise Unreachable(0, "Unreachable", "the command's output ended early (the connection was closed)")
    if opcode not in (websocket.ABNF.OPCODE_BINARY, websocket.ABNF.OPCODE_TEXT) or not frame.data:
        return -1, b""  # the frame is empty, or a ping to which the library has responded
    return frame.data[0], frame.data[1:]


def _failure(status: Mapping[str, Any], said: str) -> CommandFailed | ApiError | None:
    """Return the exception for a failed command, or None."""
    if status.get("status") == "Success":
        return None
    causes = (status.get("details") or {}).get("causes") or ()
    codes = [str(cause.get("message")) for cause in causes if cause.get("reason") == EXIT_CODE]
    if not codes:
        return from_status(SERVER_ERROR, status)
    return CommandFailed(int(codes[0]) if codes[0].isdecimal() else UNKNOWN_CODE, said.strip())


def _decoded(body: bytes | str | None) -> dict[str, Any]:
    try:
        found = json.loads(body or b"")
    except ValueError:  # a proxy may respond with HTML
        return {}
    return found if isinstance(found, dict) else {}
