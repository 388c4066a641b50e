"""A server on a Unix socket that responds to the launcher's calls of the Docker API.

A container is a process of this machine without isolation. It has the environment variables of the request,
and runs the programs of this Python environment.
Source of the API: https://docs.docker.com/reference/api/engine/
"""

import contextlib
import http.server
import json
import os
import re
import signal
import socket
import socketserver
import struct
import subprocess
import sys
import threading
import uuid
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

API = "1.45"
_ENDS_S = 20
_STREAMS = {1: "stdout", 2: "stderr"}


@dataclass
class Container:
    """A container, with the request that created it."""

    request: dict
    process: subprocess.Popen | None = None
    attached: socket.socket | None = None
    gone: threading.Event = field(default_factory=threading.Event)

    def start(self, path):
        """Start the process, and forward its input and output."""
        self.process = subprocess.Popen(
            [*self.request["Entrypoint"], *self.request["Cmd"]],
            env={**dict(each.split("=", 1) for each in self.request["Env"]), "PATH": path, "HOME": "/tmp"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        threads = [
            threading.Thread(target=self._output, args=(number, getattr(self.process, name)))
            for number, name in _STREAMS.items()
        ]
        for thread in [*threads, threading.Thread(target=self._input)]:
            thread.daemon = True
            thread.start()
        threading.Thread(target=self._end, args=(threads,), daemon=True).start()

    def _input(self):
        """Close the input of the process when its only client disconnects, as StdinOnce requires."""
        with contextlib.suppress(OSError):
            while self.attached.recv(4096):
                pass
        self.process.stdin.close()

    def _output(self, number, pipe):
        while text := pipe.read1(65536):
            with contextlib.suppress(OSError):  # the client has disconnected
                self.attached.sendall(struct.pack(">BxxxL", number, len(text)) + text)

    def _end(self, threads):
        self.process.wait()
        for thread in threads:
            thread.join()
        self.process.stdout.close()
        self.process.stderr.close()
        with contextlib.suppress(OSError):
            self.attached.shutdown(socket.SHUT_RDWR)
        self.gone.set()


class Engine(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    """The server. `images`, `security_options`, `networks` and `refusal` may be changed by a test.

    Args:
        folder: the folder of the socket.
    """

    daemon_threads = True

    def __init__(self, folder):
        self.path = folder / "docker.sock"
        self.host = f"unix://{self.path}"
        self.images = set()
        self.security_options = ["name=seccomp,profile=builtin"]
        self.networks = {}
        self.refusal = None  # the message with which `start` is refused
        self.created = {}
        self.programs = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        super().__init__(str(self.path), Call)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def running(self):
        """Return the ids of the containers that exist."""
        return [name for name, container in self.created.items() if not container.gone.is_set()]

    def close(self):
        """End the server and all containers."""
        self.shutdown()
        self.server_close()
        for name in self.running():
            if process := self.created[name].process:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait(_ENDS_S)


class Call(http.server.BaseHTTPRequestHandler):
    """One connection of a client."""

    protocol_version = "HTTP/1.1"

    def do_GET(self):
        """Answer a call that reads."""
        match self._words():
            case ["version"]:
                self._answer(200, {"ApiVersion": API, "MinAPIVersion": "1.24"})
            case ["info"]:
                self._answer(200, {"SecurityOptions": self.server.security_options})
            case ["networks", name] if name in self.server.networks:
                self._answer(200, self.server.networks[name])
            case ["networks", name]:
                self._answer(404, {"message": f"network {name} not found"})
            case ["containers", name, "json"] if name in self.server.running():
                self._answer(200, {"Id": name, "Name": f"/{name}", "NetworkSettings": {"Networks": {}}})
            case _:
                self._answer(404, {"message": f"No such container: {self.path}"})

    def do_POST(self):
        """Answer a call that changes something."""
        body = json.loads(self.rfile.read(int(self.headers.get("Content-Length") or 0)) or "{}")
        match self._words():
            case ["containers", "create"] if body["Image"] not in self.server.images:
                self._answer(404, {"message": f"No such image: {body['Image']}"})
            case ["containers", "create"]:
                name = uuid.uuid4().hex
                self.server.created[name] = Container(body)
                self._answer(201, {"Id": name, "Warnings": []})
            case ["containers", name, word] if name in self.server.running():
                getattr(self, f"_{word}")(self.server.created[name])
            case _:
                self._answer(404, {"message": f"No such container: {self.path}"})

    def do_DELETE(self):
        """Remove a container."""
        match self._words():
            case ["containers", name] if name in self.server.running():
                if process := self.server.created[name].process:
                    os.killpg(process.pid, signal.SIGKILL)
                else:
                    self.server.created[name].gone.set()
                self._answer(204)
            case _:
                self._answer(404, {"message": f"No such container: {self.path}"})

    def _attach(self, container):
        self.send_response(101, "UPGRADED")
        self.send_header("Content-Type", "application/vnd.docker.raw-stream")
        self.send_header("Connection", "Upgrade")
        self.send_header("Upgrade", "tcp")
        self.end_headers()
        container.attached = self.connection
        container.gone.wait()
        self.close_connection = True

    def _start(self, container):
        if self.server.refusal:
            self._answer(500, {"message": self.server.refusal})
            return
        container.start(self.server.programs)
        self._answer(204)

    def _stop(self, container):
        if container.process is None:
            self._answer(304)
            return
        container.process.terminate()
        container.gone.wait(_ENDS_S)
        self._answer(204)

    def _wait(self, container):
        assert parse_qs(urlsplit(self.path).query)["condition"] == ["removed"]
        container.gone.wait(_ENDS_S)
        self._answer(200, {"StatusCode": 0})

    def _words(self):
        return re.sub(r"^/v[\d.]+", "", urlsplit(self.path).path).strip("/").split("/")

    def _answer(self, status, body=None):
        text = b"" if body is None else json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)

    def address_string(self):
        """Return "unix", because a client of a Unix socket has no address."""
        return "unix"

    def log_message(self, *_):
        """Log nothing."""
