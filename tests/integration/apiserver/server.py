"""An API server that misbehaves: a test prepares the responses, which go over real sockets."""

import json
import socket
import ssl
import struct
import threading
from base64 import b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from hashlib import sha1
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qsl, urlsplit

MAGIC = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # Source: RFC 6455, section 1.3
Answer = Callable[["Exchange"], None]


@dataclass(frozen=True)
class Asked:
    """One request as the server received it."""

    method: str
    path: str
    query: dict[str, str]
    headers: dict[str, str]
    body: Any
    lines: tuple[tuple[str, str], ...] = ()  # all header lines; `headers` has only one line for each name

    @property
    def watches(self):
        """Return whether the request is a watch."""
        return self.query.get("watch") == "true"


@dataclass
class Script:
    """Recorded requests and prepared responses; the last response of each kind repeats."""

    asked: list[Asked] = field(default_factory=list)
    calls: list[Answer] = field(default_factory=list)
    watches: list[Answer] = field(default_factory=list)
    over: threading.Event = field(default_factory=threading.Event)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def next(self, asked: Asked) -> Answer:
        """Record a request and return its response."""
        with self.lock:
            self.asked.append(asked)
            answers = self.watches if asked.watches else self.calls
            return answers.pop(0) if len(answers) > 1 else answers[0]

    def of(self, *, watches: bool) -> list[Asked]:
        """Return the watches that were received, or all other requests."""
        with self.lock:
            return [asked for asked in self.asked if asked.watches == watches]


class Exchange(BaseHTTPRequestHandler):
    """One connection; the server's script contains the responses."""

    protocol_version = "HTTP/1.1"
    script: Script

    def answer(self):
        """Send the script's next response."""
        address = urlsplit(self.path)
        length = int(self.headers.get("Content-Length") or 0)
        body = json.loads(self.rfile.read(length)) if length else None
        query, lines = dict(parse_qsl(address.query)), tuple(self.headers.items())
        asked = Asked(self.command, address.path, query, dict(self.headers), body, lines)
        self.script.next(asked)(self)

    do_GET = do_POST = do_PATCH = do_DELETE = answer  # noqa: N815 - the names are http.server's

    def send(self, code: int, body: bytes, **headers: str) -> None:
        """Send a complete response."""
        self.send_response(code)
        for name, value in {"Content-Length": str(len(body)), **headers}.items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        self.wfile.write(body)

    def chunk(self, data: bytes) -> None:
        """Send a part of a chunked response."""
        self.wfile.write(b"%x\r\n%s\r\n" % (len(data), data))
        self.wfile.flush()

    def log_message(self, *arguments):
        """Write no log."""


def reply(code: int = 200, obj: Any = None, **headers: str) -> Answer:
    """Return a response with JSON."""
    return lambda exchange: exchange.send(code, json.dumps(obj or {}).encode(), **headers)


def raw(body: bytes, code: int = 200) -> Answer:
    """Return a response whose body is exactly these bytes."""
    return lambda exchange: exchange.send(code, body)


def refusal(code: int, reason: str, **headers: str) -> Answer:
    """Return a response with a Status object."""
    return reply(code, {"kind": "Status", "code": code, "reason": reason, "message": "no"}, **headers)


def hang(exchange: Exchange) -> None:
    """Send nothing, as a server at the other end of a half-open connection."""
    exchange.script.over.wait(30)
    exchange.close_connection = True


def hang_up(exchange: Exchange) -> None:
    """Close the connection without a response."""
    exchange.close_connection = True


def trickle(exchange: Exchange) -> None:
    """Send a byte from time to time, and never complete the response."""
    exchange.send_response(200)
    exchange.send_header("Content-Length", "100000")
    exchange.end_headers()
    while not exchange.script.over.wait(0.1):
        exchange.wfile.write(b" ")


def stream(*events: Any, ends: str = "properly") -> Answer:
    """Return a response with the events of a watch.

    The watch `ends` properly, stays silent, or breaks in the middle of a line.
    """

    def answer(exchange: Exchange) -> None:
        exchange.send_response(200)
        exchange.send_header("Transfer-Encoding", "chunked")
        exchange.end_headers()
        for event in events:
            exchange.chunk(event if isinstance(event, bytes) else json.dumps(event).encode() + b"\n")
        if ends == "silent":
            exchange.script.over.wait(30)
        elif ends == "broken":
            exchange.chunk(b'{"type": "ADDED", "object": {"metadata": {"name": "half')
            exchange.close_connection = True
            return
        exchange.chunk(b"")

    return answer


def command(*messages: bytes, ends: str = "properly") -> Answer:
    """Return a response with the messages of a command; the first byte of a message numbers its stream.

    The command `ends` properly by closing the websocket, stays silent, or breaks.
    """

    def answer(exchange: Exchange) -> None:
        key = exchange.headers["Sec-WebSocket-Key"] + MAGIC
        exchange.send_response(101)
        exchange.send_header("Upgrade", "websocket")
        exchange.send_header("Connection", "Upgrade")
        exchange.send_header("Sec-WebSocket-Protocol", "v5.channel.k8s.io")
        exchange.send_header("Sec-WebSocket-Accept", b64encode(sha1(key.encode()).digest()).decode())
        exchange.end_headers()
        for message in messages:
            exchange.wfile.write(struct.pack("!BBH", 0x82, 126, len(message)) + message)
        if ends == "silent":
            exchange.script.over.wait(30)
        if ends == "properly":
            exchange.wfile.write(b"\x88\x00")
        exchange.close_connection = True

    return answer


@contextmanager
def serving(tls: ssl.SSLContext | None = None, address: str = "127.0.0.1") -> Iterator[tuple[str, Script]]:
    """Serve on a free port, and yield the URL and the script."""
    script = Script()
    handler = type("Scripted", (Exchange,), {"script": script})

    class Server(ThreadingHTTPServer):
        daemon_threads = True
        address_family = socket.AF_INET6 if ":" in address else socket.AF_INET

        def handle_error(self, *arguments):
            """Ignore the error: the tests make clients disconnect first."""

    server = Server((address, 0), handler)
    if tls is not None:  # each thread does its own handshake
        server.socket = tls.wrap_socket(server.socket, server_side=True, do_handshake_on_connect=False)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        host = f"[{address}]" if ":" in address else address
        yield f"{'https' if tls else 'http'}://{host}:{server.server_port}", script
    finally:
        script.over.set()
        with suppress(OSError):
            server.shutdown()
        server.server_close()
        thread.join()
