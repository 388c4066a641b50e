"""The format of the log: one JSON object a line on standard error, a constant message, values as fields."""

import logging
import sys

import structlog


def configure_logs() -> None:
    """Write every line to standard error from now on, with its level and the time in UTC."""
    structlog.configure(
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.dict_tracebacks,
            structlog.processors.JSONRenderer(default=str),
        ],
        logger_factory=lambda *_: structlog.PrintLogger(sys.stderr),
    )
