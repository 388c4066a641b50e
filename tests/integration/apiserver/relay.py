"""Proxies that speak CONNECT or SOCKS5 and record requests; they connect every client to one server."""

import selectors
import socket
import ssl
import struct
import threading
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from socketserver import StreamRequestHandler, ThreadingTCPServer

ACCEPTED = b"\x05\x00\x00\x01\x00\x00\x00\x00\x00\x00"  # Source: RFC 1928, section 6
BY_PASSWORD = 2


@dataclass
class Notes:
    """The requests that a proxy received.

    Attributes:
            targets: host and port of each connection.
            users: user and password of each connection, or "".
            refuses: whether the proxy refuses all connections.
    """

    targets: list[str] = field(default_factory=list)
    users: list[str] = field(default_factory=list)
    refuses: bool = False


class _Relay(StreamRequestHandler):
    """One connection."""

    notes: Notes
    to: tuple[str, int]
    tls: ssl.SSLContext | None

    def setup(self):
        """Wrap the connection in TLS if the proxy has a certificate."""
        if self.tls is not None:
            self.request = self.tls.wrap_socket(self.request, server_side=True)
        self.rbufsize = 0  # a buffer could take bytes after the request, which are for the server
        super().setup()

    def handle(self):
        """Read the target by the protocol that the first byte names, and relay the connection."""
        first = self.rfile.read(1)
        granted = self._socks() if first == b"\x05" else self._connect(first)
        if not granted:
            return
        with socket.create_connection(self.to, timeout=10) as server:
            _relay(self.request, server)

    def finish(self):
        """Close the connection here, because socketserver closes only the TCP connection below TLS."""
        super().finish()
        self.request.close()

    def _connect(self, first: bytes) -> bool:
        request = first
        while not request.endswith(b"\r\n\r\n") and (byte := self.rfile.read(1)):
            request += byte
        line, *headers = request.decode().split("\r\n")
        given = {name.lower(): value for name, _, value in (header.partition(": ") for header in headers)}
        token = given.get("proxy-authorization", "").removeprefix("Basic ")
        self._note(line.split()[1], b64decode(token).decode())
        answer = b"407 Proxy Authentication Required" if self.notes.refuses else b"200 OK"
        self.wfile.write(b"HTTP/1.1 " + answer + b"\r\n\r\n")
        return not self.notes.refuses

    def _socks(self) -> bool:
        methods = self.rfile.read(self.rfile.read(1)[0])
        user = ""
        if BY_PASSWORD in methods:
            self.wfile.write(bytes((5, BY_PASSWORD)))
            self.rfile.read(1)
            name, password = (self.rfile.read(self.rfile.read(1)[0]).decode() for _ in range(2))
            user = f"{name}:{password}"
            self.wfile.write(b"\x01\x00")
        else:
            self.wfile.write(b"\x05\x00")
        kind = self.rfile.read(4)[3]
        if kind == 3:
            host = self.rfile.read(self.rfile.read(1)[0]).decode()
        else:
            family, size = (socket.AF_INET, 4) if kind == 1 else (socket.AF_INET6, 16)
            host = socket.inet_ntop(family, self.rfile.read(size))
        self._note(f"{host}:{struct.unpack('!H', self.rfile.read(2))[0]}", user)
        self.wfile.write(ACCEPTED)
        return True

    def _note(self, target: str, user: str) -> None:
        self.notes.targets.append(target)
        self.notes.users.append(user)


def _relay(client: socket.socket, server: socket.socket) -> None:
    """Copy bytes in both directions until one side ends."""
    other = {client: server, server: client}
    with selectors.DefaultSelector() as selector, suppress(OSError):
        for end in other:
            selector.register(end, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                data = key.fileobj.recv(1 << 16)
                if not data:
                    return
                other[key.fileobj].sendall(data)
                while isinstance(key.fileobj, ssl.SSLSocket) and key.fileobj.pending():
                    other[key.fileobj].sendall(key.fileobj.recv(1 << 16))


@contextmanager
def relaying(port: int, tls: ssl.SSLContext | None = None) -> Iterator[tuple[str, Notes]]:
    """Run a proxy to one port of this machine.

    Yields:
        The proxy's host and port, and its record of requests.
    """
    notes = Notes()
    handler = type("Noted", (_Relay,), {"notes": notes, "to": ("127.0.0.1", port), "tls": tls})

    class Server(ThreadingTCPServer):
        daemon_threads = True

        def handle_error(self, *arguments):
            """Ignore the error, because a client that disconnects is not an error of the proxy."""

    server = Server(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield f"127.0.0.1:{server.server_address[1]}", notes
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
