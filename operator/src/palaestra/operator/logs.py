"""The format of the log: one JSON object a line on standard error; messages are constant, values fields."""

import logging
import sys
from typing import Any

import structlog

from palaestra_protocol.masking import masked

_JSON = structlog.processors.JSONRenderer(default=str)


def configure_logs() -> None:
    """Set up the log: each line goes to standard error with its level and the time in UTC."""
    structlog.configure(
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.dict_tracebacks,
            _render,
        ],
        logger_factory=lambda *_: structlog.PrintLogger(sys.stderr),
    )


def _render(logger: Any, name: str, fields: structlog.typing.EventDict) -> str:
    """Return the line, in which the user information of addresses is masked."""
    return masked(str(_JSON(logger, name, fields)))
