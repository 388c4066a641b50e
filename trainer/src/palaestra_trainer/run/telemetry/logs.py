"""Format log lines with a constant message and values as fields, and write them to standard error.

This module keeps the last lines for the termination message, because a pod's log is deleted with the pod.
"""

from __future__ import annotations

import sys
from collections import deque
from typing import Any

import structlog

from palaestra_protocol.masking import masked
from palaestra_protocol.pod.status import MOST_LINES

_last_lines: deque[str] = deque(maxlen=MOST_LINES)


def configure_logs() -> None:
    """Write log lines to the current `sys.stderr`, because a library may replace that stream."""
    structlog.configure(
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            _Renderer(colors=False, pad_event_to=0, exception_formatter=structlog.dev.plain_traceback),
        ],
        logger_factory=lambda *_: structlog.PrintLogger(sys.stderr),
    )


def last_lines() -> tuple[str, ...]:
    """Return the last logged lines, the newest last; this function never blocks."""
    return tuple(_last_lines)


class _Renderer(structlog.dev.ConsoleRenderer):
    """Renders log lines with masked passwords in addresses, and keeps the last lines."""

    def __call__(self, logger: Any, name: str, event_dict: structlog.typing.EventDict) -> str:
        text = masked(super().__call__(logger, name, event_dict))
        _last_lines.extend(line for line in text.splitlines() if line.strip())
        return text
