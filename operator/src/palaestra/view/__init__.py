"""TrainingJobs as text. This package is pure: the clock is an argument.

`tables` and `sparkline` draw tables and charts, and `durations` formats durations. `describe` prints one job
in full. `history` stores past figures of a job, and `live` shows the job's progress.
"""

from palaestra.view.describe import describe, happened, progress
from palaestra.view.durations import short
from palaestra.view.history import History
from palaestra.view.live import live
from palaestra.view.sparkline import sparkline
from palaestra.view.tables import lines_of, server_table, without_status

__all__ = [
    "History",
    "describe",
    "happened",
    "lines_of",
    "live",
    "progress",
    "server_table",
    "short",
    "sparkline",
    "without_status",
]
