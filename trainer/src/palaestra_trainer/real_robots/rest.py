"""The connection to a Robotino over REST, which all system images of the robot since V4 provide.

Commands and each kind of reading have a persistent connection and a thread of their own. On one connection a
request would wait for the response to the previous request, and a delay of 50 ms would hold back the commands
until the robot's timeout of 200 ms stops the robot.
"""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Callable, Mapping
from typing import Final
from urllib.parse import urlsplit

import httpx
import structlog

from palaestra_trainer.errors import ConfigurationError, LinkError, RobotUnfit
from palaestra_trainer.real_robots.camera import MOST_BYTES as MOST_PICTURE_BYTES
from palaestra_trainer.real_robots.camera import ImageSize, decoded
from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.real_robots.rest_answers import (
    MOST_BYTES,
    bumped_of,
    charges,
    distances_of,
    odometry_of,
)
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.safety import STANDING, stands
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.geometry import Twist

log = structlog.get_logger(__name__)

SocketOption = tuple[int, int, int] | tuple[int, int, bytes]

# Timeout of a request. After a failed request there is time for one more, before the robot's timeout stops
# the robot.
TIMEOUT_S: Final = 0.1
_FIRST_TIMEOUT_S: Final = 2.0  # before the robot moves, a slow network may take longer
_POLL_S: Final = 0.05
_CAMERA: Final = "/cam0"
# Timeout of a request for a picture, which has more bytes than other readings. If the picture is older than
# 0.3 s, the robot is held back.
_CAMERA_S: Final = 0.2
_HTTP: Final = 80
_CLIENT: Final = {"sid": "palaestra"}  # the clients in the official example send a name as `sid`
# A command that was not confirmed must not arrive later, after a command to stand. So the operating system
# drops the unsent data of a closed connection, and repeats a lost packet only for a short time.
_SOCKET_OPTIONS: Final[list[SocketOption]] = [
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
    (socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0)),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 200),
]

Reader = Callable[[bytes, float], None]


class RestLink:
    """The connection to one Robotino; see `RobotLink`.

    Args:
        address: the address of the robot, such as http://192.168.0.1.
        sensors: how the robot reports its distance sensors.
        clock: the robot's clock.

    Raises:
        ConfigurationError: the address is not an HTTP address.
    """

    def __init__(
        self, address: str, sensors: SensorLayout | None = None, clock: RobotClock | None = None
    ) -> None:
        self.address, self._host, self._port = _parts(address)
        self._sensors = sensors or SensorLayout()
        self._clock = clock or RobotClock()
        self._base = self.address  # after `_resolve`, with the IP address of the host
        self._commands: httpx.Client | None = None
        self._newest = (-1.0, STANDING)  # number and velocity of the newest odometry
        self._over = threading.Event()
        self._threads: list[threading.Thread] = []

    def refuse_unfit(self, speed_m_s: float, turn_rad_s: float) -> None:
        """Refuse a robot that does not respond as a Robotino, or that charges; REST has no limit of speed."""
        del speed_m_s, turn_rad_s
        self._resolve()
        with self._client(_FIRST_TIMEOUT_S) as client:
            try:
                odometry_of(self._got(client, "/data/odometry"))
                charging = charges(self._got(client, "/data/powermanagement"))
            except LinkError as error:
                raise RobotUnfit(
                    f"{self.address}: {error}; check the address, and that the robot is switched on"
                ) from error
        if charging:
            raise RobotUnfit(f"{self.address}: the robot is connected to its charger; unplug the charger")

    def start(self, store: ReadingStore) -> None:
        """Begin to request odometry, distances and bumper 20 times a second."""
        self._commands = self._client(TIMEOUT_S)
        readers: Mapping[str, Reader] = {
            "odometry": lambda body, at_s: self._read_odometry(store, body, at_s),
            "distancesensorarray": lambda body, at_s: store.set_distances(
                distances_of(body, self._sensors), at_s
            ),
            "bumper": lambda body, at_s: store.set_bumped(at_s, bumped=bumped_of(body)),
        }
        for route, read in readers.items():
            name = f"robot-{route}"
            thread = threading.Thread(
                target=self._poll, args=(f"/data/{route}", read), name=name, daemon=True
            )
            thread.start()
            self._threads.append(thread)

    def use_camera(self, store: ReadingStore, size: ImageSize) -> None:
        """Begin to request pictures of /cam0; each picture replaces the previous picture."""
        if any(thread.name == _CAMERA for thread in self._threads):
            return

        def read(body: bytes, at_s: float) -> None:
            try:
                store.set_image(decoded(body, size), at_s)
            except LinkError as error:
                store.refuse_image(str(error))

        store.image_fault = f"no picture arrives from {_CAMERA}; check the camera"
        thread = threading.Thread(
            target=self._poll, args=(_CAMERA, read, _CAMERA_S), name=_CAMERA, daemon=True
        )
        thread.start()
        self._threads.append(thread)

    def send(self, twist: Twist) -> None:
        """Send one velocity."""
        if self._commands is None:
            raise LinkError("/data/omnidrive: the connection has not begun")
        try:
            with self._commands.stream(
                "PUT", "/data/omnidrive", params=_CLIENT, json=list(twist)
            ) as response:
                response.raise_for_status()
                self._read(response, "/data/omnidrive")
        except httpx.HTTPError as error:
            raise LinkError(f"/data/omnidrive: {_fact(error)}") from error

    def close(self) -> None:
        """End the threads, and close the connections."""
        self._over.set()
        for thread in self._threads:
            thread.join(_FIRST_TIMEOUT_S)
        if self._commands is not None:
            self._commands.close()

    def _resolve(self) -> None:
        """Look up the address of the host once, because a name server may be slow while the robot drives."""
        try:
            family, _, _, _, found = socket.getaddrinfo(self._host, self._port, type=socket.SOCK_STREAM)[0]
        except (OSError, UnicodeError) as error:
            raise RobotUnfit(f"{self.address}: the name has no address ({error}); check it") from error
        host = f"[{found[0]}]" if family == socket.AF_INET6 else found[0]
        self._base = f"http://{host}:{self._port}"

    def _read_odometry(self, store: ReadingStore, body: bytes, at_s: float) -> None:
        """Store odometry, unless a robot that moves returns the same odometry again."""
        number, odometry = odometry_of(body)
        if (number, odometry.velocity) == self._newest and not stands(odometry.velocity):
            raise LinkError(f"/data/odometry: returned the odometry with number {number:g} again")
        self._newest = (number, odometry.velocity)
        store.set_odometry(odometry, at_s)

    def _poll(self, path: str, read: Reader, timeout_s: float = TIMEOUT_S) -> None:
        """Request a reading again and again; the age of the newest reading shows a failure."""
        due_s = self._clock.now_s()
        with self._client(timeout_s) as client:
            while not self._clock.wait(self._over, due_s):
                begin_s = self._clock.now_s()
                try:
                    body = self._got(client, path)
                    # The robot measured between request and response.
                    read(body, 0.5 * (begin_s + self._clock.now_s()))
                except LinkError as error:
                    log.debug("no reading", path=path, error=str(error))
                due_s = max(due_s + _POLL_S, self._clock.now_s())

    def _got(self, client: httpx.Client, path: str) -> bytes:
        """Return the body of a response.

        Raises:
            LinkError: the robot did not respond in time, or responded with an error or too much.
        """
        try:
            with client.stream("GET", path, params=_CLIENT) as response:
                response.raise_for_status()
                return self._read(response, path, MOST_PICTURE_BYTES if path == _CAMERA else MOST_BYTES)
        except httpx.HTTPError as error:
            raise LinkError(f"{path}: {_fact(error)}") from error

    def _read(self, response: httpx.Response, path: str, most_bytes: int = MOST_BYTES) -> bytes:
        """Return the body of a response, of a bounded size and within a bounded time.

        Raises:
            LinkError: the body is too long, or comes too slowly.
            httpx.HTTPError: the connection failed.
        """
        end_s = self._clock.now_s() + _FIRST_TIMEOUT_S
        body = bytearray()
        for part in response.iter_raw():
            body += part
            if len(body) > most_bytes or self._clock.now_s() > end_s:
                raise LinkError(f"{path}: returned more than {most_bytes} bytes, or too slowly")
        return bytes(body)

    def _client(self, timeout_s: float) -> httpx.Client:
        # A proxy of the environment, or a redirection, must not come between a robot and its commands.
        return httpx.Client(
            base_url=self._base,
            timeout=self._clock.real_s(timeout_s),
            trust_env=False,
            headers={"Host": urlsplit(self.address).netloc, "Accept-Encoding": "identity"},
            transport=httpx.HTTPTransport(socket_options=_SOCKET_OPTIONS, trust_env=False),
        )


def _parts(address: str) -> tuple[str, str, int]:
    """Return an address without a slash at its end, its host and its port.

    Raises:
        ConfigurationError: the address is not an HTTP address, or has more parts than host and port.
    """
    try:
        parts = urlsplit(address)
        plain = parts.path in {"", "/"} and not (parts.query or parts.fragment or parts.username)
        if parts.scheme == "http" and parts.hostname and parts.port != 0 and plain:
            return address.rstrip("/"), parts.hostname, parts.port or _HTTP
    except ValueError:
        pass
    raise ConfigurationError(f"robot: {address!r} is not an address such as http://192.168.0.1")


def _fact(error: httpx.HTTPError) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
