"""How log lines look: constant message, values as fields, on standard error."""

from __future__ import annotations

import sys

import structlog


def configure_logs() -> None:
    """Write log lines to whatever standard error is at that moment; a progress bar replaces it."""
    structlog.configure(
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            structlog.dev.ConsoleRenderer(
                colors=False, pad_event_to=0, exception_formatter=structlog.dev.plain_traceback
            ),
        ],
        logger_factory=lambda *_: structlog.PrintLogger(sys.stderr),
    )
