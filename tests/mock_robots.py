"""Mock robots as processes, and a REST client for them that uses no code of Palaestra."""

import contextlib
import http.client
import io
import json
import os
import socket
import subprocess
import sys
import threading

import numpy as np
from PIL import Image

from tests.waiting import eventually

PROGRAM = (sys.executable, "-m", "palaestra_sim.mock_robot.entry", "--listen=127.0.0.1:0")
DEADLINE_S = 30.0  # the waits take moments on an idle machine
# From a pole's axis, in m: an episode ends at 0.45 m by odometry, which drifts. How far the robot then rolls
# towards the pole depends on the load, because the mock's clock is faster than real time.
ARRIVED_M = 0.6
SPEED = (
    2.0  # the speed of a mock robot's clock; at higher speeds, a delay of this machine is a lost connection
)


class Client:
    """A client with one connection, which stays open."""

    def __init__(self, url):
        self.address = url.strip().removeprefix("http://")
        self.connection = http.client.HTTPConnection(self.address, timeout=DEADLINE_S)

    def ask(self, method, path, body=None):
        """Return status and JSON content of a response; None if the body is empty."""
        text = body if body is None or isinstance(body, str) else json.dumps(body)
        self.connection.request(method, path, body=text)
        status, content = self._response()
        return status, json.loads(content) if content else None

    def get(self, path):
        """Return the content of a path."""
        status, content = self.ask("GET", path)
        assert status == 200
        return content

    def picture(self, size):
        """Return the picture of the camera, reduced to a size, shape (height, width, 3), RGB."""
        self.connection.request("GET", "/cam0")
        status, content = self._response()
        assert status == 200
        return np.asarray(Image.open(io.BytesIO(content)).convert("RGB").resize(size))

    def _response(self):
        response = self.connection.getresponse()
        return response.status, response.read()

    def send(self, path, body):
        """Send a body with PUT or POST, whichever the path requires."""
        method = "PUT" if path.startswith("/data/") else "POST"
        assert self.ask(method, path, body) == (200, None)


def started(*options, program=PROGRAM, **variables):
    """Return a process of the mock robot that is ready, and its client.

    `variables` are variables of its environment, in addition to those of this process.
    """
    environment = {**os.environ, **variables}
    process = subprocess.Popen((*program, *options), stdout=subprocess.PIPE, text=True, env=environment)
    return process, Client(process.stdout.readline())


def ended(process, client):
    """Kill a process, and close its pipe and the connection to it."""
    client.connection.close()
    process.kill()
    process.communicate()


def settled(client):
    """Put the robot into the middle of the arena, at rest and without a charger, and return its client."""
    client.send("/data/omnidrive", [0, 0, 0])
    client.send("/mock/charger", {"connected": False})
    client.send("/mock/place", [0, 0, 0])
    eventually(lambda: client.get("/mock/truth")["vx"] == 0.0, pace_s=0.005)
    return client


def drive(robot, twist, periods):
    """Drive at a velocity for some periods."""
    for _ in range(periods):
        robot.drive(*twist)
        robot.advance()


class Cable:
    """A network cable between a program and a robot: a proxy on loopback that can be cut.

    A cut passes nothing on and closes nothing, so each side sees only silence.
    """

    def __init__(self, client):
        self._robot = client.address.split(":")
        self._cut = threading.Event()
        self._sockets = []
        self._threads = []
        self._server = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._server.getsockname()[1]}"
        self._begin(self._serve)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for each in (self._server, *self._sockets):
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join(DEADLINE_S)
        for each in (self._server, *self._sockets):
            each.close()

    def cut(self):
        """Cut the cable."""
        self._cut.set()

    def _begin(self, task, *arguments):
        thread = threading.Thread(target=task, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._server.accept()
                self._sockets.append(near)
                if self._cut.is_set():
                    continue
                far = socket.create_connection(self._robot)
                self._sockets.append(far)
                for one, other in ((near, far), (far, near)):
                    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._begin(self._pass, one, other)

    def _pass(self, source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(65_536):
                if not self._cut.is_set():
                    sink.sendall(data)
        if not self._cut.is_set():
            with contextlib.suppress(OSError):
                sink.shutdown(socket.SHUT_RDWR)
