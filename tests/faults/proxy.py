"""A proxy between an operator and its API server. It passes all requests on, and causes one fault by a plan.

The operator speaks plain HTTP to the proxy on the loopback interface. The proxy uses the operator's
certificate, so the API server checks and logs the operator's own permissions. The proxy does not change the
data.
"""

import http.server
import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import urllib3
import yaml
from urllib3.exceptions import HTTPError

from tests.faults.course import Course
from tests.faults.plans import CODES, KILLS, Fault, Kind
from tests.faults.requests import WATCH, Asked, asked

HOP = frozenset({"connection", "keep-alive", "transfer-encoding", "host"})
REASONS = {
    409: "Conflict",
    410: "Expired",
    429: "TooManyRequests",
    500: "InternalError",
    503: "ServiceUnavailable",
}
CONNECTIONS = 64
LONGEST_S = 700.0  # longer than a watch of the operator lives
LOOK_S = 0.05  # the delay until the server notices that it must stop
BOOKMARK = b'"type":"BOOKMARK"'


class Broken(Exception):
    """The proxy must close the connection at once, without another byte."""


class Proxy:
    """A proxy on the loopback interface, which runs until it is closed.

    Attributes:
        course: counts the requests.
        kill: kills the operator and returns when it is dead; set this before the operator starts.
    """

    def __init__(self, kubeconfig: Path, course: Course) -> None:
        self.course = course
        self.kill: Callable[[], None] = lambda: None
        self._upstream, self._pool = _pool(kubeconfig)
        self._open: dict[int, Any] = {}
        self._closing = threading.Event()
        handler = type("Handler", (_Handler,), {"proxy": self})
        self._server = _Server(("127.0.0.1", 0), handler)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(LOOK_S,), daemon=True)
        self._thread.start()

    def kubeconfig(self, path: Path) -> Path:
        """Write a kubeconfig for this proxy, and return its path."""
        host, port = self._server.server_address[:2]
        content = {
            "apiVersion": "v1",
            "kind": "Config",
            "clusters": [{"name": "here", "cluster": {"server": f"http://{host}:{port}"}}],
            "users": [{"name": "operator", "user": {}}],
            "contexts": [{"name": "here", "context": {"cluster": "here", "user": "operator"}}],
            "current-context": "here",
        }
        path.write_text(json.dumps(content))
        return path

    @property
    def closing(self) -> bool:
        """Whether the proxy is closing."""
        return self._closing.is_set()

    def pause(self, seconds: float) -> None:
        """Wait, but return at once when the proxy closes."""
        self._closing.wait(seconds)

    def send(self, method: str, target: str, headers: dict[str, str], body: bytes) -> Any:
        """Return the API server's response, of which only the head has been read.

        Raises:
            Broken: the API server sent no response.
        """
        try:
            answer = self._pool.request(
                method,
                self._upstream + target,
                body=body or None,
                headers=headers,
                timeout=urllib3.Timeout(connect=10, read=LONGEST_S),
                retries=False,
                redirect=False,
                preload_content=False,
                decode_content=False,
            )
        except (HTTPError, OSError) as error:
            raise Broken from error
        self._open[id(answer)] = answer
        return answer

    def done(self, answer: Any) -> None:
        """Close a response after it was read, or when nobody needs it any more."""
        self._open.pop(id(answer), None)
        answer.close()

    def break_all(self) -> None:
        """End every response in progress, including those of watches."""
        for answer in list(self._open.values()):
            with suppress(ValueError, RuntimeError, OSError):  # the response has already ended
                answer.shutdown()

    def close(self) -> None:
        """Stop the proxy, and end all responses, including those of watches."""
        self._closing.set()
        self._server.shutdown()
        self._thread.join()
        self.break_all()
        self._server.server_close()
        self._pool.clear()


class _Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = CONNECTIONS

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Close the connection without a log line: the tests break connections on purpose."""


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    proxy: Proxy

    def log_message(self, *_: Any) -> None:
        pass

    def handle_expect_100(self) -> bool:
        return True

    def do_GET(self) -> None:
        self._pass_on()

    do_POST = do_PUT = do_PATCH = do_DELETE = do_GET  # noqa: N815 - the standard library defines these names

    def _pass_on(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        what = asked(self.command, self.path, dict(self.headers))
        try:
            self._disturbed(what, body)
        except (Broken, OSError, HTTPError):
            self._break()

    def _disturbed(self, what: Asked, body: bytes) -> None:
        fault = self.proxy.course.request(what)
        kind = fault.kind if fault else None
        if kind == Kind.AWAY:
            self.proxy.break_all()
        if self.proxy.course.away:
            raise Broken
        if fault and fault.kind in CODES:
            self._refuse(CODES[fault.kind])
            return
        if kind == Kind.KILL_BEFORE:
            self.proxy.kill()
            raise Broken
        if fault and kind == Kind.DELAY:
            self.proxy.pause(fault.seconds)
        answer = self.proxy.send(self.command, self.path, self._headers(), body)
        try:
            if kind in {Kind.KILL_AFTER, Kind.DROP}:
                self._swallow(answer, fatal=kind in KILLS)
            elif what.verb == WATCH and answer.status == http.HTTPStatus.OK:
                self._stream(answer, what)
            else:
                self._answer(answer.status, dict(answer.headers), answer.read())
        finally:
            self.proxy.done(answer)

    def _swallow(self, answer: Any, *, fatal: bool) -> None:
        answer.read()
        if fatal:
            self.proxy.kill()
        raise Broken

    def _stream(self, answer: Any, what: Asked) -> None:
        self.send_response(answer.status)
        self.send_header("Content-Type", answer.headers.get("Content-Type", "application/json"))
        self.send_header("Transfer-Encoding", "chunked")
        self.end_headers()
        for line in self._lines(answer):
            bookmark = BOOKMARK in line[: 2 * len(BOOKMARK)]
            fault = None if bookmark else self.proxy.course.change(what)
            if fault and fault.kind in CODES:
                error = {"type": "ERROR", "object": _status(CODES[fault.kind])}
                self._chunk(json.dumps(error).encode() + b"\n")
                break
            self._chunk(self._disturbed_line(fault, line))
        self._chunk(b"")

    def _lines(self, answer: Any) -> Iterator[bytes]:
        pending = b""
        while part := answer.read1(1 << 16):
            *lines, pending = (pending + part).split(b"\n")
            yield from (line + b"\n" for line in lines)
        if self.proxy.course.away:
            raise Broken

    def _disturbed_line(self, fault: Fault | None, line: bytes) -> bytes:
        if fault and fault.kind == Kind.FREEZE:
            self.proxy.pause(fault.seconds)
        elif fault and fault.kind == Kind.CUT:
            self._chunk(line[: len(line) // 2])
            raise Broken
        return line

    def _refuse(self, code: int) -> None:
        headers = {"Content-Type": "application/json"}
        if code == http.HTTPStatus.TOO_MANY_REQUESTS:
            headers["Retry-After"] = "0"
        self._answer(code, headers, json.dumps(_status(code)).encode())

    def _answer(self, code: int, headers: dict[str, str], body: bytes) -> None:
        self.send_response(code)
        for name, value in headers.items():
            if name.lower() not in HOP | {"content-length", "date", "server"}:
                self.send_header(name, value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def _chunk(self, data: bytes) -> None:
        self.wfile.write(b"%x\r\n%b\r\n" % (len(data), data))

    def _headers(self) -> dict[str, str]:
        return {name: value for name, value in self.headers.items() if name.lower() not in HOP}

    def _break(self) -> None:
        self.close_connection = True
        with suppress(OSError):
            self.connection.shutdown(socket.SHUT_RDWR)


def _status(code: int) -> dict[str, Any]:
    return {
        "kind": "Status",
        "apiVersion": "v1",
        "status": "Failure",
        "code": code,
        "reason": REASONS[code],
        "message": f"a fault of the rig: {code}",
    }


def _pool(kubeconfig: Path) -> tuple[str, urllib3.PoolManager]:
    """Return the API server's address and a connection pool, from a kubeconfig with certificates."""
    content = yaml.safe_load(kubeconfig.read_text())
    cluster, user = content["clusters"][0]["cluster"], content["users"][0]["user"]
    pool = urllib3.PoolManager(
        maxsize=CONNECTIONS,
        cert_reqs="CERT_REQUIRED",
        ca_certs=cluster["certificate-authority"],
        cert_file=user["client-certificate"],
        key_file=user["client-key"],
    )
    return cluster["server"], pool
