"""The connection to a Robotino over REST, as all its images since V4 have it.

Commands and each kind of reading have a persistent connection and a thread of their own. On one connection a
request would wait for the response to the request before, and a delay of 50 ms would hold back the commands
until the robot's dead man of 200 ms stops it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Final
from urllib.parse import urlsplit

import httpx
import structlog

from palaestra_trainer.errors import ConfigurationError, LinkError, RobotUnfit
from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.real_robots.rest_answers import (
    MOST_BYTES,
    bumped_of,
    charges,
    distances_of,
    odometry_of,
)
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.geometry import Twist

log = structlog.get_logger(__name__)

TIMEOUT_S: Final = 0.1  # of a request; the dead man of the robot leaves time for one more
_FIRST_TIMEOUT_S: Final = 2.0  # before the robot moves, a slow network may take longer
_POLL_S: Final = 0.05
_CLIENT: Final = {"sid": "palaestra"}  # clients of the official example name themselves so

Reader = Callable[[bytes, float], None]


class RestLink:
    """The connection to one Robotino; see `RobotLink`.

    Args:
        address: the address of the robot, such as http://192.168.0.1.
        sensors: how the robot reports its distance sensors.
        clock: the robot's clock.

    Raises:
        ConfigurationError: the address is not one of HTTP.
    """

    def __init__(
        self, address: str, sensors: SensorLayout | None = None, clock: RobotClock | None = None
    ) -> None:
        self.address = _checked(address)
        self._sensors = sensors or SensorLayout()
        self._clock = clock or RobotClock()
        self._commands = self._client(TIMEOUT_S)
        self._over = threading.Event()
        self._threads: list[threading.Thread] = []

    def refuse_unfit(self, speed_m_s: float) -> None:
        """Refuse a robot that does not respond as a Robotino, or that charges; REST has no limit of speed."""
        del speed_m_s
        with self._client(_FIRST_TIMEOUT_S) as client:
            try:
                odometry_of(self._got(client, "odometry"))
                charging = charges(self._got(client, "powermanagement"))
            except LinkError as error:
                raise RobotUnfit(
                    f"{self.address}: {error}; check the address, and that the robot is switched on"
                ) from error
        if charging:
            raise RobotUnfit(f"{self.address}: the robot is connected to its charger; unplug the charger")

    def start(self, store: ReadingStore) -> None:
        """Begin to request odometry, distances and bumper 20 times a second."""
        readers: Mapping[str, Reader] = {
            "odometry": lambda body, at_s: store.set_odometry(odometry_of(body), at_s),
            "distancesensorarray": lambda body, at_s: store.set_distances(
                distances_of(body, self._sensors), at_s
            ),
            "bumper": lambda body, at_s: store.set_bumped(at_s, bumped=bumped_of(body)),
        }
        for route, read in readers.items():
            name = f"robot-{route}"
            thread = threading.Thread(target=self._poll, args=(route, read), name=name, daemon=True)
            thread.start()
            self._threads.append(thread)

    def send(self, twist: Twist) -> None:
        """Send one velocity."""
        try:
            self._commands.put("/data/omnidrive", params=_CLIENT, json=list(twist)).raise_for_status()
        except httpx.HTTPError as error:
            raise LinkError(f"/data/omnidrive: {_fact(error)}") from error

    def close(self) -> None:
        """End the threads, and close the connections."""
        self._over.set()
        for thread in self._threads:
            thread.join(_FIRST_TIMEOUT_S)
        self._commands.close()

    def _poll(self, route: str, read: Reader) -> None:
        """Request a reading again and again; the age of the newest reading shows a failure."""
        due_s = self._clock.now_s()
        with self._client(TIMEOUT_S) as client:
            while not self._clock.wait(self._over, due_s):
                begin_s = self._clock.now_s()
                try:
                    body = self._got(client, route)
                    # The robot measured between request and response.
                    read(body, 0.5 * (begin_s + self._clock.now_s()))
                except LinkError as error:
                    log.debug("no reading", route=route, error=str(error))
                due_s = max(due_s + _POLL_S, self._clock.now_s())

    def _got(self, client: httpx.Client, route: str) -> bytes:
        """Return the body of a response.

        Raises:
            LinkError: the robot did not respond in time, or responded with an error or too much.
        """
        try:
            with client.stream("GET", f"/data/{route}", params=_CLIENT) as response:
                response.raise_for_status()
                body = b""
                for part in response.iter_raw():
                    body += part
                    if len(body) > MOST_BYTES:
                        raise LinkError(f"/data/{route}: returned more than {MOST_BYTES} bytes")
                return body
        except httpx.HTTPError as error:
            raise LinkError(f"/data/{route}: {_fact(error)}") from error

    def _client(self, timeout_s: float) -> httpx.Client:
        # A proxy of the environment, or a redirection, must not come between a robot and its commands.
        return httpx.Client(base_url=self.address, timeout=self._clock.real_s(timeout_s), trust_env=False)


def _checked(address: str) -> str:
    try:
        parts = urlsplit(address)
        if parts.scheme == "http" and parts.hostname and parts.port != 0 and parts.path in {"", "/"}:
            return address.rstrip("/")
    except ValueError:
        pass
    raise ConfigurationError(f"robot: {address!r} is not an address such as http://192.168.0.1")


def _fact(error: httpx.HTTPError) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
