"""The files in the folder of one run on its volume, and functions for its files of JSON lines.

This folder is enough to inspect the run and to resume it. Whole files are replaced by
`palaestra_protocol.whole_file`, and lines are appended with fsync. So after a crash each file has either its
old or its new content.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from palaestra_protocol.whole_file import replace_file

RUN_VARIABLE = "PALAESTRA_RUN"


class RunDirectory:
    """One run directory; the folder may be missing.

    Attributes:
        path: the folder itself.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def attempts(self) -> Path:
        """One JSON line per attempt."""
        return self.path / "attempts.jsonl"

    @property
    def checkpoints(self) -> Path:
        """One folder per checkpoint, named by its step."""
        return self.path / "checkpoints"

    @property
    def configuration(self) -> Path:
        """The configuration of the run."""
        return self.path / "training.yaml"

    @property
    def end(self) -> Path:
        """The end of the newest attempt; the file is missing if the trainer could not write it."""
        return self.path / "end.json"

    @property
    def evaluations(self) -> Path:
        """One JSON line per evaluation."""
        return self.path / "evaluations.jsonl"

    @property
    def faults(self) -> Path:
        """One JSON line per fault of a simulator, and one line when that simulator is up again."""
        return self.path / "faults.jsonl"

    @property
    def hyperparameters(self) -> Path:
        """All hyperparameters with which the run began, including defaults."""
        return self.path / "hyperparameters.json"

    @property
    def confirmations(self) -> Path:
        """One JSON line per confirmation of an evaluation."""
        return self.path / "confirmations.jsonl"

    @property
    def journal(self) -> Path:
        """The counters of some seconds ago; after a kill, the next attempt continues from these counters."""
        return self.path / "journal.json"

    @property
    def model(self) -> Path:
        """The model with the best evaluation, as a zip of Stable-Baselines3."""
        return self.path / "model.zip"

    @property
    def replays(self) -> Path:
        """Recorded episodes of the best policy."""
        return self.path / "replays.json"

    @property
    def report(self) -> Path:
        """The report, one HTML file."""
        return self.path / "report.html"

    @property
    def summary(self) -> Path:
        """The result of the run; the file exists only after the run has finished."""
        return self.path / "summary.json"

    @property
    def tensorboard(self) -> Path:
        """Event files of TensorBoard."""
        return self.path / "tensorboard"

    @property
    def trackers(self) -> Path:
        """The ids of this run in the experiment trackers of the job."""
        return self.path / "trackers.json"

    def begin_attempt(
        self,
        pod_uid: str,
        reason: str,
        versions: Mapping[str, str] | None = None,
        source: Mapping[str, Any] | None = None,
    ) -> int:
        """Record the start of an attempt, and return its number, from 1.

        Args:
            pod_uid: the uid of the pod.
            reason: why the attempt begins.
            versions: the versions of its software.
            source: the commit of the job's own code.
        """
        started = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        known = {"versions": versions, "source": source}
        facts = {name: dict(value) for name, value in known.items() if value is not None}
        append_line(self.attempts, {"pod": pod_uid, "started": started, "reason": reason} | facts)
        return sum(1 for _ in read_lines(self.attempts))


def append_line(path: Path, content: dict[str, Any]) -> None:
    """Append `content` as one JSON line, and wait until the line is on the disk."""
    with path.open("ab+") as file:
        torn = False
        if file.tell():
            file.seek(-1, os.SEEK_END)
            torn = file.read(1) != b"\n"
        file.write((b"\n" if torn else b"") + json.dumps(content).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


def read_lines(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the JSON lines of a file that may be missing; skip a line that a crash truncated."""
    if not path.exists():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        with suppress(json.JSONDecodeError):
            content = json.loads(line)
            if isinstance(content, dict):
                yield content


def drop_lines(path: Path, unwanted: Callable[[dict[str, Any]], bool]) -> None:
    """Remove the unwanted lines from a file of JSON lines, which may be missing."""
    lines = list(read_lines(path))
    kept = [line for line in lines if not unwanted(line)]
    if len(kept) < len(lines):
        text = "".join(json.dumps(line) + "\n" for line in kept)
        replace_file(path, lambda name: name.write_text(text, encoding="utf-8"))
