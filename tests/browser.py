"""A headless Chromium that a test drives through its DevTools protocol and that ends with the test."""

from __future__ import annotations

import itertools
import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from urllib.request import urlopen

from websocket import WebSocket, create_connection

from tests.waiting import eventually

DEADLINE_S = 60.0
PROGRAM: Final = "chromium"
# The browser must not contact update servers, accounts or any other host.
QUIET = (
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--remote-debugging-port=0", "--remote-allow-origins=*", "about:blank"),
)
FLAT: Final = ("--disable-gpu", "--disable-3d-apis")  # no WebGL
DRAWING: Final = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # WebGL on the processor


class Page:
    """One page, its requests and its errors.

    Attributes:
        requests: addresses that the page has requested.
        errors: messages of its console and exceptions of its scripts.
    """

    def __init__(self, socket: WebSocket) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self._socket = socket
        self._numbers = itertools.count(1)
        self._loaded = False
        for domain in ("Page", "Network", "Log", "Runtime"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            message = self._receive()
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]

    def open(self, path: Path) -> None:
        """Open a file and wait until it is loaded."""
        self.open_address(path.as_uri())

    def open_address(self, address: str) -> None:
        """Open an address and wait until it is loaded."""
        self._loaded = False
        self.ask("Page.navigate", url=address)
        while not self._loaded:
            self._receive()

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript; a promise is awaited."""
        result = self.ask("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def show_as(self, *, width: int, scheme: str, height: int = 800) -> None:
        """Set the window size and the preferred color scheme."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 500,
        )
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def _receive(self) -> dict[str, Any]:
        message = json.loads(self._socket.recv())
        params = message.get("params", {})
        match message.get("method"):
            case "Network.requestWillBeSent":
                self.requests.append(params["request"]["url"])
            case "Log.entryAdded":
                self.errors.append(params["entry"]["text"])
            case "Runtime.exceptionThrown" | "Runtime.consoleAPICalled":
                self.errors.append(json.dumps(params)[:500])
            case "Page.loadEventFired":
                self._loaded = True
        return message


@contextmanager
def browser(folder: Path, graphics: tuple[str, ...] = FLAT) -> Iterator[Page]:
    """Start a browser with a new profile in `folder`, and yield its page; `DRAWING` gives it WebGL."""
    process = subprocess.Popen(
        [PROGRAM, *QUIET, *graphics, f"--user-data-dir={folder}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        socket = create_connection(_address(folder, process), timeout=DEADLINE_S)
        try:
            yield Page(socket)
        finally:
            socket.close()
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _address(folder: Path, process: subprocess.Popen[bytes]) -> str:
    """Return the address of the browser's first page."""
    ports = folder / "DevToolsActivePort"

    def written() -> bool:
        assert process.poll() is None, "the browser has ended"
        return ports.exists() and ports.read_text().count("\n") > 0

    eventually(written, DEADLINE_S)
    port = ports.read_text().split()[0]
    with urlopen(f"http://127.0.0.1:{port}/json/list", timeout=DEADLINE_S) as answer:
        pages = json.load(answer)
    return next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
