"""A local Prometheus that scrapes given targets and answers queries.

It is Debian's Prometheus, which tests/cluster/programs.sh unpacks. The caller gives each target the labels
that the chart's PodMonitor and ServiceMonitor set.
"""

import json
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from palaestra.local.ports import HeldPorts
from tests.control_plane.plane import ADDRESS, started
from tests.control_plane.programs import programs
from tests.waiting import TooLate, eventually

PROGRAMS = ("prometheus", "promtool")
SCRAPE_S = 1
START_DEADLINE_S = 30
QUERY_DEADLINE_S = 10
LOOK_EVERY_S = 0.1  # the API of Prometheus has no request that waits


class NotAnswered(Exception):
    """Prometheus did not start, refused a query, or did not return an awaited result in time."""


@dataclass(frozen=True, slots=True)
class Target:
    """A scrape target: host and port, and its labels."""

    address: str
    labels: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Prometheus:
    """A running Prometheus."""

    address: str

    def query(self, expr: str) -> list[dict[str, Any]]:
        """Return the current series of an expression.

        Raises:
            NotAnswered: the expression is invalid; the message contains Prometheus' own.
        """
        return self._ask("query", query=expr)

    def over(self, expr: str, since: float, until: float, step_s: float) -> list[dict[str, Any]]:
        """Return the series of an expression between two times (Unix time), with all values."""
        return self._ask("query_range", query=expr, start=since, end=until, step=step_s)

    def until(self, claim: Callable[[], Any], deadline_s: float) -> Any:
        """Return the first true value of `claim`.

        Raises:
                NotAnswered: `claim` returned no true value within `deadline_s`.
        """
        try:
            return eventually(claim, deadline_s, LOOK_EVERY_S)
        except TooLate as late:
            raise NotAnswered(f"{late}; targets up: {self.query('up')}") from late

    def _ask(self, what: str, **parameters: Any) -> list[dict[str, Any]]:
        sent = urllib.parse.urlencode(parameters).encode()
        try:
            with urllib.request.urlopen(
                f"http://{self.address}/api/v1/{what}", sent, timeout=QUERY_DEADLINE_S
            ) as answer:
                found: list[dict[str, Any]] = json.load(answer)["data"]["result"]
                return found
        except urllib.error.HTTPError as error:
            with error:
                raise NotAnswered(f"{parameters['query']}: {error.read().decode()}") from error


@contextmanager
def scraping(targets: Sequence[Target], folder: Path, rules: Path | None = None) -> Iterator[Prometheus]:
    """Run a Prometheus that scrapes `targets`; see `configured`.

    Raises:
        NoPrograms, NotAnswered: as `configured` does.
    """
    scraped = [{"targets": [target.address], "labels": dict(target.labels)} for target in targets]
    with configured([{"job_name": "palaestra", "static_configs": scraped}], folder, rules) as prometheus:
        yield prometheus


@contextmanager
def configured(
    scrapes: Sequence[Mapping[str, Any]], folder: Path, rules: Path | None = None
) -> Iterator[Prometheus]:
    """Run a Prometheus until the block ends; `folder` must exist and be empty.

    Args:
        scrapes: the scrape_configs; every target is scraped every second.
        folder: for configuration, data and log.
        rules: a file of alerting rules, which are evaluated every second.

    Raises:
        NoPrograms: Prometheus is not built.
        NotAnswered: Prometheus did not start.
    """
    binaries = programs(PROGRAMS)
    with ExitStack() as running:
        prometheus = Prometheus(f"{ADDRESS}:{running.enter_context(HeldPorts()).any()}")
        command = _command(binaries, folder, scrapes, rules, prometheus.address)
        process = running.enter_context(started(folder, command))
        ends = time.monotonic() + START_DEADLINE_S
        while not _is_ready(prometheus.address):
            if process.poll() is not None or time.monotonic() > ends:
                raise NotAnswered(f"prometheus did not come up: {(folder / 'prometheus.log').read_text()}")
            threading.Event().wait(LOOK_EVERY_S)
        yield prometheus


def _command(
    binaries: Path, folder: Path, scrapes: Sequence[Mapping[str, Any]], rules: Path | None, address: str
) -> list[str]:
    configuration = {
        "global": {"scrape_interval": f"{SCRAPE_S}s", "evaluation_interval": f"{SCRAPE_S}s"},
        "scrape_configs": list(scrapes),
        "rule_files": [str(rules)] if rules else [],
    }
    file = folder / "prometheus.yaml"
    file.write_text(yaml.safe_dump(configuration))
    return [
        str(binaries / "prometheus"),
        f"--config.file={file}",
        f"--storage.tsdb.path={folder / 'data'}",
        f"--web.listen-address={address}",
        "--log.level=warn",
    ]


def _is_ready(address: str) -> bool:
    with suppress(OSError), urllib.request.urlopen(f"http://{address}/-/ready", timeout=5):
        return True
    return False
